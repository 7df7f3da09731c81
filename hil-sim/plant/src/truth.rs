//! The true state of the simulated vehicle and its ground, for logs and metrics. The vehicle never sees this
//! state.

use super::body::{BALLAST, FORWARD, Gravity, LEFT, LIFT, PHI, RIGHT, SIDE, SPAR, WheelContact, YAW};

/// The state of the simulated vehicle and its ground at one instant, SI.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Truth {
    /// Time since the start.
    pub time_s: f64,
    /// Axle centre along x of the base plane.
    pub x_m: f64,
    /// Axle centre along y of the base plane (left).
    pub y_m: f64,
    /// Axle centre above its height on the bare plane.
    pub height_m: f64,
    /// Heading about the plane's normal, anticlockwise positive.
    pub heading_rad: f64,
    /// Yaw rate.
    pub yaw_rate_rad_s: f64,
    /// Forward speed of the axle.
    pub speed_m_s: f64,
    /// Speed of the axle to the left; 0 for a rolling vehicle.
    pub side_speed_m_s: f64,
    /// Wheel rates theta' (left, right).
    pub wheel_rate_rad_s: [f64; 2],
    /// Arm angle from the vertical, forward positive.
    pub phi_rad: f64,
    /// Its rate.
    pub phi_rate_rad_s: f64,
    /// Spar angle from the vertical, lower end forward positive (0 without a spar).
    pub spar_rad: f64,
    /// Its rate.
    pub spar_rate_rad_s: f64,
    /// Ballast angle relative to the spar.
    pub ballast_rad: f64,
    /// Its rate.
    pub ballast_rate_rad_s: f64,
    /// Inclination of the path under the vehicle along its heading, including base plane and profile, uphill
    /// positive.
    pub slope_rad: f64,
    /// Normal force on each wheel (left, right).
    pub normal_n: [f64; 2],
    /// Longitudinal contact force on each wheel (left, right), forward positive.
    pub longitudinal_n: [f64; 2],
    /// Longitudinal slip speed of each contact (left, right): centre's speed less r theta'.
    pub slip_m_s: [f64; 2],
    /// Whether each contact slides (left, right).
    pub sliding: [bool; 2],
    /// Whether each wheel is off the ground (left, right).
    pub lifted: [bool; 2],
    /// Motor currents, in the order of [`model::sample::Motor`].
    pub current_a: [f64; 3],
    /// Motor torques at the gearbox outputs, before their friction.
    pub torque_n_m: [f64; 3],
    /// Battery voltage at its terminals.
    pub battery_v: f64,
    /// Current out of the battery (negative: into it).
    pub battery_a: f64,
    /// Whether chocks hold the wheels.
    pub chocked: bool,
}

/// The plant's own state at one instant, without the angles from the vertical. A glance copies whole arrays
/// of the plant, so it costs little more than the copy.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Glance {
    pub(crate) time_s: f64,
    /// Positions, with angles from the plane's normal, and speeds, by the indices of [`super::body`].
    pub(crate) position: [f64; 9],
    pub(crate) speed: [f64; 9],
    /// Contacts of the left and the right wheel.
    pub(crate) wheels: [WheelContact; 2],
    pub(crate) path_slopes: [f64; 2],
    pub(crate) gravity: Gravity,
    pub(crate) current_a: [f64; 3],
    pub(crate) torque_n_m: [f64; 3],
    pub(crate) battery_v: f64,
    pub(crate) battery_a: f64,
    pub(crate) has_spar: bool,
    pub(crate) chocked: bool,
}

impl Glance {
    /// Computes the truth from the glance.
    pub fn truth(&self) -> Truth {
        let (q, u) = (&self.position, &self.speed);
        let [left, right] = &self.wheels;
        let [slope_left, slope_right] = self.path_slopes;
        let vertical = libm::atan2(self.gravity.along, self.gravity.normal);
        // Nearly always a plane.
        let path_slope = 0.5 * (slope_left + slope_right);
        let path_rad = if path_slope == 0.0 { 0.0 } else { libm::atan(path_slope) };
        let (spar_rad, spar_rate_rad_s) = if self.has_spar {
            (q[SPAR] + vertical, u[SPAR])
        } else {
            (0.0, 0.0)
        };
        Truth {
            time_s: self.time_s,
            x_m: q[FORWARD],
            y_m: q[SIDE],
            height_m: q[LIFT],
            heading_rad: q[YAW],
            yaw_rate_rad_s: u[YAW],
            speed_m_s: u[FORWARD],
            side_speed_m_s: u[SIDE],
            wheel_rate_rad_s: [u[LEFT], u[RIGHT]],
            phi_rad: q[PHI] + vertical,
            phi_rate_rad_s: u[PHI],
            spar_rad,
            spar_rate_rad_s,
            ballast_rad: q[BALLAST] - q[SPAR],
            ballast_rate_rad_s: u[BALLAST] - u[SPAR],
            slope_rad: vertical + path_rad,
            normal_n: [left.normal_n, right.normal_n],
            longitudinal_n: [left.longitudinal_n, right.longitudinal_n],
            slip_m_s: [left.slip_m_s, right.slip_m_s],
            sliding: [left.sliding, right.sliding],
            lifted: [left.lifted, right.lifted],
            current_a: self.current_a,
            torque_n_m: self.torque_n_m,
            battery_v: self.battery_v,
            battery_a: self.battery_a,
            chocked: self.chocked,
        }
    }
}
