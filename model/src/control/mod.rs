//! The control laws: pure functions of what the vehicle senses and what is commanded.

pub mod ballast_plan;
pub mod equilibrium;
pub mod hold;
pub mod landing;
pub mod motor;
pub mod motor_guard;
pub mod spar;
pub mod spar_law;
pub mod speed;
pub mod speed_controller;
pub mod speed_law;
pub mod steering;
pub mod supply_guard;
pub mod swing_damped;
pub mod turning_grip;

/// What a law gives in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LawOutput<T> {
    /// The voltage asked for, V, within the law's limit.
    pub voltage_v: f32,
    /// The terms whose sum it is before the limit.
    pub terms: T,
}
