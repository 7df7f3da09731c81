//! Speed over the ground of a vehicle whose wheels slide: what the accelerations add to the last speed of rolling wheels.

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
