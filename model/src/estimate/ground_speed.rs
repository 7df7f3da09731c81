//! Speed over the ground of a vehicle whose wheels slide: what the accelerations add to the last speed of rolling wheels.

use crate::bounded::Bounded;

/// Speed along the heading and to the left of it, m/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GroundSpeed {
    /// Along the heading.
    pub forward_m_s: f32,
    /// To the left.
    pub left_m_s: f32,
}

impl GroundSpeed {
    /// The speed of rolling wheels.
    pub fn of_wheels(wheels_m_s: f32) -> Self {
        Self {
            forward_m_s: wheels_m_s,
            left_m_s: 0.0,
        }
    }

    /// One tick of `dt_s` under accelerations over the ground, in m/s^2. The axes turn with the yaw rate, the speed does not.
    ///
    /// ```
    /// use model::estimate::ground_speed::GroundSpeed;
    /// // A quarter turn on ice without friction: the vehicle keeps its direction of motion, which is now to its right.
    /// let mut speed = GroundSpeed::of_wheels(1.0);
    /// for _ in 0..1571 {
    ///     speed.update(0.001, 1.0, [0.0, 0.0]);
    /// }
    /// assert!(speed.forward_m_s.abs() < 1e-2 && (speed.left_m_s + 1.0).abs() < 1e-2);
    /// ```
    #[inline]
    pub fn update(&mut self, dt_s: f32, yaw_rate_rad_s: f32, [forward_m_s2, left_m_s2]: [f32; 2]) {
        let Self { forward_m_s, left_m_s } = *self;
        self.forward_m_s += dt_s * (forward_m_s2 + yaw_rate_rad_s * left_m_s);
        self.left_m_s += dt_s * (left_m_s2 - yaw_rate_rad_s * forward_m_s);
    }

    /// How far it differs from the speed of rolling wheels, m/s: the sum of both components' sizes.
    pub fn slip_m_s(&self, wheels_m_s: f32) -> f32 {
        (self.forward_m_s - wheels_m_s).abs() + self.left_m_s.abs()
    }
}

/// By how much of a turn wheels of unequal radii make the gyro's yaw rate differ from theirs, while they roll.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnequalRadii {
    gain: f32,
    most_rad_m: f32,
    /// The difference of the yaw rates per speed, rad/m.
    rad_m: f32,
}

/// Largest difference of the radii that is learnt, as a share of them. With more, or faster, a wheel slides.
const RADII_MAX: f32 = 0.12;
/// How fast it is learnt: the time constant at a speed of one track per second, s.
const LEARNS_S: f32 = 1.0;

impl UnequalRadii {
    /// A learner called every `dt_s` seconds, for wheels `2 half_track_m` apart.
    pub fn new(dt_s: f32, half_track_m: f32) -> Self {
        let track_m = 2.0 * half_track_m;
        Self {
            gain: dt_s / (LEARNS_S * track_m * track_m),
            most_rad_m: RADII_MAX / track_m,
            rad_m: 0.0,
        }
    }

    /// The difference of the yaw rates at a speed of the wheels, rad/s.
    pub fn yaw_rad_s(&self, wheels_m_s: f32) -> f32 {
        self.rad_m * wheels_m_s
    }

    /// Learns from a tick of rolling wheels, and of what is left of the yaw rates' difference.
    #[inline]
    pub fn learn(&mut self, left_rad_s: f32, wheels_m_s: f32) {
        let learnt = self.rad_m + self.gain * left_rad_s * wheels_m_s;
        self.rad_m = learnt.bounded(-self.most_rad_m, self.most_rad_m);
    }
}
