//! The thesis, analysed: equilibria, limits, envelopes, 3-D motion, camera platform.

pub mod waveform;
