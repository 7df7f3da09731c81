//! The control laws: pure functions of what the vehicle senses and what it is asked for.

pub mod motor;
pub mod spar;
pub mod spar_law;
pub mod speed;
pub mod speed_law;
pub mod steering;
