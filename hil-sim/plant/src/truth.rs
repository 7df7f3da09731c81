//! The true state of the simulated world, for logs and metrics. The vehicle never sees it.

/// The state of the simulated world at one instant, SI.
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
    /// Heading about the plane's normal, counter-clockwise.
    pub heading_rad: f64,
    /// Yaw rate.
    pub yaw_rate_rad_s: f64,
    /// Forward speed of the axle.
    pub speed_m_s: f64,
    /// Speed of the axle to the left: a rolling vehicle has none.
    pub side_speed_m_s: f64,
    /// Wheel rates theta' (left, right).
    pub wheel_rate_rad_s: [f64; 2],
    /// Arm angle from the vertical, forward positive.
    pub phi_rad: f64,
    /// Its rate.
    pub phi_rate_rad_s: f64,
    /// Spar angle from the vertical, lower end forward positive (0 without a camera).
    pub spar_rad: f64,
    /// Its rate.
    pub spar_rate_rad_s: f64,
    /// Ballast angle relative to the spar.
    pub ballast_rad: f64,
    /// Its rate.
    pub ballast_rate_rad_s: f64,
    /// Inclination of the path under the vehicle along its heading, base plane and profile, uphill positive.
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
    /// The wheels are chocked.
    pub chocked: bool,
}
