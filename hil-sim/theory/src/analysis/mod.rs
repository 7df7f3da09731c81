//! The analysis of the thesis: equilibria, limits, envelopes, motion in space, spar.

pub mod camera;
pub mod carrying;
pub mod cma_es;
pub mod coupled;
pub mod critical;
pub mod design_check;
#[cfg(test)]
mod design_check_tests;
pub mod design_numbers;
pub mod dop853;
mod dop853_coefficients;
pub mod envelope;
pub mod equilibrium;
pub mod input;
pub mod jumps;
pub mod kernel;
pub mod landing_poles;
#[cfg(test)]
mod landing_poles_tests;
pub mod law_search;
pub mod law_step;
pub mod let_go;
pub mod lqr;
pub mod optimum;
pub mod poles;
pub mod random_drive;
pub mod response;
pub mod roots;
pub mod sampled;
pub mod series;
pub mod settling;
pub mod simulate;
pub mod slip;
pub mod spatial;
pub mod speed_response;
pub mod step_budget;
pub mod trajectory;
pub mod waveform;
pub mod whirl;
