//! The scales between SI units and the nondimensional numbers of (3.10), (3.11) and ch. 7.

use super::gravity::GRAVITY_M_S2;
use super::{BodyParameters, MotorParameters, SparParameters};
use crate::real::Real;

/// Scales of the vehicle: one nondimensional unit in SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales<T> {
    /// Time unit 1/w, w = sqrt(g/r), in s.
    pub time_s: T,
    /// Length unit r, in m.
    pub length_m: T,
    /// Speed unit r w, in m/s (at the rim: theta' = 1).
    pub speed_m_s: T,
    /// Torque unit (M+m) g r, in N m (both wheels together).
    pub torque_n_m: T,
    /// Voltage of U = 1 with both motors at that voltage, in V (3.11).
    pub voltage_v: T,
}

impl<T: Real> Scales<T> {
    pub(super) fn new(body: &BodyParameters<T>, motor: &MotorParameters<T>) -> Self {
        let g = T::from_f64(GRAVITY_M_S2);
        let time_s = (body.wheel_radius_m / g).sqrt();
        let torque_n_m = body.total_mass_kg * g * body.wheel_radius_m;
        // Torque at the outputs of both motors per volt.
        let torque_per_volt =
            T::from_f64(2.0) * motor.torque_constant_n_m_per_a * motor.gear_ratio / motor.resistance_ohm;
        Self {
            time_s,
            length_m: body.wheel_radius_m,
            speed_m_s: body.wheel_radius_m / time_s,
            torque_n_m,
            voltage_v: torque_n_m / torque_per_volt,
        }
    }

    /// Motor voltage (both motors) in V to nondimensional U (3.11).
    pub fn voltage_from_si(&self, v: T) -> T {
        v / self.voltage_v
    }

    /// Nondimensional U to motor voltage (both motors) in V (3.11).
    pub fn voltage_to_si(&self, u: T) -> T {
        u * self.voltage_v
    }

    /// Angular rate in rad/s to rad per time unit.
    pub fn rate_from_si(&self, rate_rad_s: T) -> T {
        rate_rad_s * self.time_s
    }
}

/// Scales of the spar (ch. 7): lengths over l_c, masses over m_c, time over 1/w_c.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparScales<T> {
    /// Time unit 1/w_c, w_c = sqrt(g/l_c), in s.
    pub time_s: T,
    /// Torque unit m_c g l_c, in N m.
    pub torque_n_m: T,
    /// Voltage of the ballast motor for v = 1, in V.
    pub voltage_v: T,
}

impl<T: Real> SparScales<T> {
    pub(super) fn new(spar: &SparParameters<T>, motor: &MotorParameters<T>) -> Self {
        let g = T::from_f64(GRAVITY_M_S2);
        let torque_n_m = spar.camera_mass_kg * g * spar.spar_length_m;
        let torque_per_volt = motor.torque_constant_n_m_per_a * motor.gear_ratio / motor.resistance_ohm;
        Self {
            time_s: (spar.spar_length_m / g).sqrt(),
            torque_n_m,
            voltage_v: torque_n_m / torque_per_volt,
        }
    }

    /// Nondimensional v to ballast-motor voltage in V.
    pub fn voltage_to_si(&self, v: T) -> T {
        v * self.voltage_v
    }

    /// Angular rate in rad/s to rad per time unit of ch. 7.
    pub fn rate_from_si(&self, rate_rad_s: T) -> T {
        rate_rad_s * self.time_s
    }
}
