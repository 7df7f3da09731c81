//! The control laws: pure functions of the vehicle's senses and the command.

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

/// A law's output in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LawOutput<T> {
    /// The wanted voltage, V, within the law's limit.
    pub voltage_v: f32,
    /// The terms. Their sum is the voltage before the limit.
    pub terms: T,
}
