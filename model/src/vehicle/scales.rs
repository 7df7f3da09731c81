//! The scales between SI units and the nondimensional numbers of (3.10), (3.11) and ch. 7.

use super::{BodyParameters, CameraMotorParameters, CameraParameters, DriveMotorParameters, GRAVITY_M_S2};
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
    pub(super) fn new(body: &BodyParameters<T>, motor: &DriveMotorParameters<T>) -> Self {
        let g = T::from_f64(GRAVITY_M_S2);
        let time_s = (body.wheel_radius_m / g).sqrt();
        let torque_n_m = body.total_mass_kg * g * body.wheel_radius_m;
        // Torque at the output of both motors a volt.
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

    /// Angular rate in rad per time unit to rad/s.
    pub fn rate_to_si(&self, rate: T) -> T {
        rate / self.time_s
    }
}

/// Scales of the camera platform (ch. 7): lengths over l_c, masses over m_c, time over 1/w_c.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraScales<T> {
    /// Time unit 1/w_c, w_c = sqrt(g/l_c), in s.
    pub time_s: T,
    /// Torque unit m_c g l_c, in N m.
    pub torque_n_m: T,
    /// Motor voltage of v = 1, in V.
    pub voltage_v: T,
}

impl<T: Real> CameraScales<T> {
    pub(super) fn new(camera: &CameraParameters<T>, motor: &CameraMotorParameters<T>) -> Self {
        let g = T::from_f64(GRAVITY_M_S2);
        let torque_n_m = camera.camera_mass_kg * g * camera.spar_length_m;
        let torque_per_volt = motor.torque_constant_n_m_per_a * motor.gear_ratio / motor.resistance_ohm;
        Self {
            time_s: (camera.spar_length_m / g).sqrt(),
            torque_n_m,
            voltage_v: torque_n_m / torque_per_volt,
        }
    }

    /// Nondimensional v to camera-motor voltage in V.
    pub fn voltage_to_si(&self, v: T) -> T {
        v * self.voltage_v
    }

    /// Angular rate in rad/s to rad per time unit of the platform.
    pub fn rate_from_si(&self, rate_rad_s: T) -> T {
        rate_rad_s * self.time_s
    }
}
