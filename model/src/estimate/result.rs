//! The result of the estimation in one tick.

/// The vehicle's estimate of itself in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[allow(clippy::struct_excessive_bools)] // Independent findings, not the states of one thing.
pub struct Estimate {
    /// Arm angle phi from the vertical, rad, forward positive.
    pub phi_rad: f32,
    /// Arm rate phi', rad/s.
    pub phi_rate_rad_s: f32,
    /// Mean wheel rate theta', rad/s, forward positive.
    pub theta_rate_rad_s: f32,
    /// Speed of the axle, m/s.
    pub speed_m_s: f32,
    /// Slope beta, rad, uphill positive.
    pub slope_rad: f32,
    /// Sine of the slope that the laws balance: the slope of the ground. Under Eq. 3.25, while the vehicle pushes at
    /// an obstacle, the slope of a hill that would need the same force.
    pub sin_slope: f32,
    /// Heading since boot, rad, anticlockwise positive, not wrapped.
    pub heading_rad: f32,
    /// Yaw rate, rad/s.
    pub yaw_rate_rad_s: f32,
    /// Distance driven since boot, m, forward positive.
    pub distance_m: f32,
    /// Dead-reckoned position along the first heading, m.
    pub x_m: f32,
    /// Dead-reckoned position to the left of the first heading, m.
    pub y_m: f32,
    /// Spar angle from the vertical, rad, in the sense of phi.
    pub spar_rad: f32,
    /// Rate of that angle, rad/s: what the spar's gyro shows, and by how much the plane tips in a turn on a slope.
    pub spar_rate_rad_s: f32,
    /// Ballast angle relative to the spar, rad.
    pub ballast_rad: f32,
    /// Ballast rate relative to the spar, rad/s.
    pub ballast_rate_rad_s: f32,
    /// Learnt bias of the arm gyro's swing axis, rad/s.
    pub gyro_bias_rad_s: f32,
    /// The gyros have been calibrated at rest.
    pub calibrated: bool,
    /// The vehicle has stood still for a while.
    pub at_rest: bool,
    /// The vehicle has come to a stop, though it may still balance about its place.
    pub stopped: bool,
    /// For a while the gyro and the accelerometer of the arm IMU have contradicted each other, or both have
    /// contradicted the wheels or gravity.
    pub contradicted: bool,
    /// For a while the spar IMU has contradicted gravity, or the ballast and the axle.
    pub spar_contradicted: bool,
    /// The wheels slide: speed and distance come from the accelerometer.
    pub sliding: bool,
    /// An obstacle blocks the vehicle, which is commanded to drive.
    pub stalled: bool,
}

impl Estimate {
    /// Whether every value that affects a motor is finite.
    pub fn is_finite(&self) -> bool {
        // An infinity or a NaN makes the sum infinite or NaN. Values so large that their sum overflows are no
        // estimate either.
        let sum = self.phi_rad
            + self.phi_rate_rad_s
            + self.theta_rate_rad_s
            + self.heading_rad
            + self.yaw_rate_rad_s
            + self.spar_rad
            + self.spar_rate_rad_s
            + self.ballast_rad
            + self.ballast_rate_rad_s;
        sum.is_finite()
    }
}
