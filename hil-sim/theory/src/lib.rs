//! The theory of the vehicle class: limits, envelopes, gains and every figure of the source thesis, with the
//! commands that print them.
#![forbid(unsafe_code)]

pub mod analysis;
pub mod commands;
pub mod figures;
