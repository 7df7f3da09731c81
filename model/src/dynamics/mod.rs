//! The equations of motion, nondimensional: masses over M+m, lengths over r, time over 1/w, w = sqrt(g/r).

pub mod camera;
pub mod contact;
pub mod coupled;
pub mod planar;
pub mod spatial;
