//! The thesis, analysed: equilibria, limits, envelopes, 3-D motion, camera platform.

pub mod lqr;
pub mod matrix;
pub mod waveform;
