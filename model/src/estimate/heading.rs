//! Heading and yaw rate from the arm's gyro and the wheels.

/// Fuses the gyro's yaw rate with the difference of the wheels (6.12).
///
/// The gyro is used directly; its bias is learnt from the wheels while they do not slip (the two
/// agree within [`AGREEMENT_RAD_S`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadingEstimator {
    dt_s: f32,
    bias_gain: f32,
    bias_rad_s: f32,
    yaw_rate_rad_s: f32,
    heading_rad: f32,
    /// What the last additions to the heading lost to rounding (Kahan).
    carry_rad: f32,
}

/// Largest difference of gyro and wheels from which the bias is learnt: more is slip.
pub const AGREEMENT_RAD_S: f32 = 0.06;
/// Bias learning speed-up at rest.
const STANDSTILL_FACTOR: f32 = 20.0;

impl HeadingEstimator {
    /// An estimator called every `dt_s` seconds.
    pub fn new(dt_s: f32, bias_time_constant_s: f32) -> Self {
        Self {
            dt_s,
            bias_gain: dt_s / bias_time_constant_s,
            bias_rad_s: 0.0,
            yaw_rate_rad_s: 0.0,
            heading_rad: 0.0,
            carry_rad: 0.0,
        }
    }

    /// This estimator with the heading of another one, and with the bias from which that one goes on.
    pub fn with_heading_of(self, other: &Self) -> Self {
        Self {
            dt_s: self.dt_s,
            bias_gain: self.bias_gain,
            ..*other
        }
    }

    /// Takes the gyro's and the wheels' yaw rate in rad/s, anticlockwise (to the left) positive.
    pub fn update(&mut self, gyro_rad_s: f32, wheels_rad_s: f32, at_rest: bool) {
        let rate = gyro_rad_s - self.bias_rad_s;
        let difference = rate - wheels_rad_s;
        if difference.abs() < AGREEMENT_RAD_S {
            let factor = if at_rest { STANDSTILL_FACTOR } else { 1.0 };
            self.bias_rad_s += factor * self.bias_gain * difference;
        }
        self.yaw_rate_rad_s = rate;
        let step = rate * self.dt_s - self.carry_rad;
        let sum = self.heading_rad + step;
        self.carry_rad = (sum - self.heading_rad) - step;
        self.heading_rad = sum;
    }

    /// Sets the gyro bias, rad/s.
    pub fn set_bias(&mut self, bias_rad_s: f32) {
        self.bias_rad_s = bias_rad_s;
    }

    /// Heading in rad, anticlockwise positive, not wrapped; 0 when the core begins.
    pub fn heading_rad(&self) -> f32 {
        self.heading_rad
    }

    /// Yaw rate in rad/s with the bias taken out.
    pub fn yaw_rate_rad_s(&self) -> f32 {
        self.yaw_rate_rad_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_bias_is_learnt_from_the_wheels_and_the_heading_stops_drifting() {
        let mut estimator = HeadingEstimator::new(0.001, 10.0);
        for _ in 0..60_000 {
            estimator.update(0.5 + 0.01, 0.5, false);
        }
        let before = estimator.heading_rad();
        for _ in 0..10_000 {
            estimator.update(0.5 + 0.01, 0.5, false);
        }
        let turned = estimator.heading_rad() - before;
        assert!((turned - 5.0).abs() < 0.002, "{turned}");
    }

    #[test]
    fn another_estimator_goes_on_with_heading_and_bias_at_its_own_rate_of_learning() {
        let mut before = HeadingEstimator::new(0.001, 10.0);
        for _ in 0..60_000 {
            before.update(0.5 + 0.01, 0.5, false);
        }
        let mut after = HeadingEstimator::new(0.001, 1000.0).with_heading_of(&before);
        assert_eq!(after.heading_rad(), before.heading_rad());
        assert_eq!(after.yaw_rate_rad_s(), before.yaw_rate_rad_s());
        for estimator in [&mut before, &mut after] {
            estimator.update(0.5 + 0.01, 0.5, false);
            assert!((estimator.yaw_rate_rad_s() - 0.5).abs() < 1e-3, "the bias is known");
        }
        // A new bias is learnt in the new time.
        for _ in 0..10_000 {
            before.update(0.02, 0.0, false);
            after.update(0.02, 0.0, false);
        }
        assert!(before.yaw_rate_rad_s() < 0.005 && after.yaw_rate_rad_s() > 0.009);
    }

    #[test]
    fn slipping_wheels_are_not_believed() {
        let mut estimator = HeadingEstimator::new(0.001, 10.0);
        for _ in 0..20_000 {
            estimator.update(0.0, 3.0, false);
        }
        assert_eq!(estimator.heading_rad(), 0.0);
    }
}
