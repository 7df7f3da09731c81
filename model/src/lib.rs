//! Model of the biplanar bicycle: its dynamics, estimation, control and every decision of the
//! vehicle.
//!
//! Every function is a pure step over plain values: `no_std`, no allocation, no hardware, no unsafe.
//! The drive board, the virtual board and the analysis of the vehicle class use the same code. The
//! dynamics are generic over [`real::Real`]: the vehicle runs them with `f32`, analysis and reference
//! checks with `f64`.
#![no_std]
#![forbid(unsafe_code)]

pub mod analog;
pub mod board;
pub mod bounded;
pub mod command;
pub mod control;
pub mod dynamics;
pub mod estimate;
pub mod integrate;
pub mod linear;
pub mod persistence;
pub mod real;
pub mod sample;
pub mod sensed;
pub mod status;
pub mod supervise;
pub mod tick;
pub mod vehicle;
