//! How the gyro's yaw rate differs from that of wheels that roll: by unequal radii, and by a track or a radius other than the
//! vehicle file's.

use crate::bounded::Bounded;

/// What rolling wheels have shown of their radii and their track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RollingYaw {
    radii_gain: f32,
    radii_most_rad_m: f32,
    turn_gain: f32,
    /// The difference of the yaw rates per speed, rad/m: the radii differ.
    radii_rad_m: f32,
    /// The difference of the yaw rates as a share of the wheels' own: the ratio of radius and track is another.
    turn_share: f32,
}

/// Largest difference of the radii that is learnt, as a share of them. With more, or faster, a wheel slides.
const RADII_MAX: f32 = 0.12;
/// Largest share of a turn that is learnt: a radius and a track that are each a tenth off, on opposite sides, and some more.
const TURN_MAX: f32 = 0.25;
/// How fast they are learnt: the time constant at a speed of one track per second, s, and that at 1 rad/s, which is longer because
/// a wheel that begins to slide in a turn must not pass for another track.
const RADII_S: f32 = 1.0;
const TURN_S: f32 = 8.0;

impl RollingYaw {
    /// A learner called every `dt_s` seconds, for wheels `2 half_track_m` apart.
    pub fn new(dt_s: f32, half_track_m: f32) -> Self {
        let track_m = 2.0 * half_track_m;
        Self {
            radii_gain: dt_s / (RADII_S * track_m * track_m),
            radii_most_rad_m: RADII_MAX / track_m,
            turn_gain: dt_s / TURN_S,
            radii_rad_m: 0.0,
            turn_share: 0.0,
        }
    }

    /// By how much the gyro's yaw rate exceeds that of rolling wheels, rad/s, at the wheels' speed and yaw rate.
    ///
    /// ```
    /// use model::estimate::rolling_yaw::RollingYaw;
    /// // A minute at 1 rad/s of wheels whose track is a tenth wider than the file says.
    /// let mut rolling = RollingYaw::new(0.001, 0.25);
    /// for _ in 0..60_000 {
    ///     let left_rad_s = 1.0 / 1.1 - 1.0 - rolling.difference_rad_s(0.0, 1.0);
    ///     rolling.learn(left_rad_s, 0.0, 1.0);
    /// }
    /// assert!((rolling.difference_rad_s(0.0, -2.0) - 2.0 * 0.1 / 1.1).abs() < 1e-3);
    /// ```
    pub fn difference_rad_s(&self, wheels_m_s: f32, wheels_yaw_rad_s: f32) -> f32 {
        self.radii_rad_m * wheels_m_s + self.turn_share * wheels_yaw_rad_s
    }

    /// Learns from a tick of rolling wheels, and of what is left of the yaw rates' difference.
    #[inline]
    pub fn learn(&mut self, left_rad_s: f32, wheels_m_s: f32, wheels_yaw_rad_s: f32) {
        let radii_rad_m = self.radii_rad_m + self.radii_gain * left_rad_s * wheels_m_s;
        self.radii_rad_m = radii_rad_m.bounded(-self.radii_most_rad_m, self.radii_most_rad_m);
        let turn_share = self.turn_share + self.turn_gain * left_rad_s * wheels_yaw_rad_s;
        self.turn_share = turn_share.bounded(-TURN_MAX, TURN_MAX);
    }
}
