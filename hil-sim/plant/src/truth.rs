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

/// The state of the simulated world at one instant, before anybody has worked out where the vertical is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Glance {
    /// The truth, with angles from the plane's normal, and without the slope.
    pub(crate) from_normal: Truth,
    pub(crate) has_spar: bool,
    /// Gravity along the heading and along the plane's normal, m/s^2.
    pub(crate) gravity_along: f64,
    pub(crate) gravity_normal: f64,
    /// Mean rise of the wheels' paths a metre along the heading.
    pub(crate) path_slope: f64,
}

impl Glance {
    /// The truth that was seen.
    pub fn truth(&self) -> Truth {
        let seen = &self.from_normal;
        let vertical = libm::atan2(self.gravity_along, self.gravity_normal);
        // Nearly always a plane.
        let path_rad = if self.path_slope == 0.0 {
            0.0
        } else {
            libm::atan(self.path_slope)
        };
        Truth {
            phi_rad: seen.phi_rad + vertical,
            spar_rad: if self.has_spar { seen.spar_rad + vertical } else { 0.0 },
            slope_rad: vertical + path_rad,
            ..*seen
        }
    }
}
