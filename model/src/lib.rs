//! The biplanar bicycle: dynamics, estimation, control and every decision of the vehicle.
//!
//! Everything here is a pure step over plain values: `no_std`, no allocation, no hardware, no unsafe.
//! The drive board, the host simulator and the analysis of the vehicle class use the same code; the
//! dynamics are written once over [`real::Real`], so that `f32` is what the vehicle runs and `f64` is
//! what analysis and reference checks run.
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
