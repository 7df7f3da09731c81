//! Heading and yaw rate from the arm's gyro.

/// Integrates the gyro's yaw rate and learns the gyro's biases at rest only.
///
/// While the vehicle drives, the wheels cannot distinguish a gyro's bias from unequal radii, from slip or from a
/// sagging tyre: at a steady speed each shows the same constant difference. (6.12) therefore corrects nothing while
/// driving. At rest the wheels do not turn noticeably, and each gyro axis shows its own bias. The estimator learns
/// the two axes' biases separately, so they stay right when the arm leaves the angle at which they were learnt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadingEstimator {
    dt_s: f32,
    bias_gain: f32,
    /// Biases of the x and z axes.
    bias_rad_s: [f32; 2],
    yaw_rate_rad_s: f32,
    heading_rad: f32,
    /// Rounding error of the last additions to the heading (Kahan).
    carry_rad: f32,
    lesson: Lesson,
}

/// Corrections of the biases at rest, held back until the rest is certain. The wheels' rates are known later than the
/// gyro's, so the estimator would otherwise learn the last ticks before a detected turn as a bias.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Lesson {
    ticks: u8,
    /// Corrections of the x and z axes in this block of ticks, and in the block before.
    new_rad_s: [f32; 2],
    ripe_rad_s: [f32; 2],
}

/// The rates of the two gyro axes across the wheels' axle, and the direction of the plane's normal between these
/// axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct YawReading {
    /// Rates about the arm's x and z axes, rad/s.
    pub gyro_xz_rad_s: [f32; 2],
    /// Sine and cosine of the angle from the arm's z axis to the plane's normal, towards x.
    pub normal_sin_cos: [f32; 2],
    /// Yaw rate from the difference of the wheels (6.12), rad/s.
    pub wheels_rad_s: f32,
}

/// Largest unexplained yaw rate at rest; a larger rate is a motion that the wheels do not show.
pub const AGREEMENT_RAD_S: f32 = 0.06;
/// Factor by which bias learning is faster at rest.
const STANDING_BIAS_FACTOR: f32 = 20.0;
/// Ticks of one block of corrections: longer than the filters of wheels and gyro take to agree.
const LESSON_TICKS: u8 = 50;
/// Yaw rate above which the estimator uses the magnitude of the gyro's vector instead of its projection.
const FAST_RAD_S: f32 = 0.2;

impl HeadingEstimator {
    /// An estimator called every `dt_s` seconds.
    pub fn new(dt_s: f32, bias_time_constant_s: f32) -> Self {
        Self {
            dt_s,
            bias_gain: STANDING_BIAS_FACTOR * dt_s / bias_time_constant_s,
            bias_rad_s: [0.0; 2],
            yaw_rate_rad_s: 0.0,
            heading_rad: 0.0,
            carry_rad: 0.0,
            lesson: Lesson::default(),
        }
    }

    /// This estimator with the heading and the biases of another estimator.
    pub fn with_heading_of(self, other: &Self) -> Self {
        Self {
            dt_s: self.dt_s,
            bias_gain: self.bias_gain,
            ..*other
        }
    }

    /// Updates the estimate with one reading; rates are positive anticlockwise (to the left).
    ///
    /// The axle lies in the plane, so every rotation of the arm about its x and z axes is yaw. A component across the
    /// assumed normal is an error of the normal's direction. To first order this error adds `across^2 / 2 along` to
    /// the rate, which matters in a fast turn (1 degree costs 0.5 degrees in nine turns).
    #[inline]
    pub fn update(&mut self, reading: &YawReading, at_rest: bool) {
        let [sin, cos] = reading.normal_sin_cos;
        let [x, z] = reading.gyro_xz_rad_s;
        let [bias_x, bias_z] = self.bias_rad_s;
        let (x, z) = (x - bias_x, z - bias_z);
        let along = z * cos + x * sin;
        let across = x * cos - z * sin;
        let rate = if along.abs() > FAST_RAD_S {
            along + 0.5 * across * across / along
        } else {
            along
        };
        if at_rest {
            let error = [x - reading.wheels_rad_s * sin, z - reading.wheels_rad_s * cos];
            if error.iter().all(|error| error.abs() < AGREEMENT_RAD_S) {
                self.learn(error);
            }
        } else {
            self.lesson = Lesson::default();
        }
        self.turn(rate);
    }

    /// One tick in which the vehicle is known to stand still, whatever a gyro with an unknown bias shows.
    pub fn stand(&mut self) {
        self.yaw_rate_rad_s = 0.0;
    }

    /// One tick without a gyro: the heading follows the wheels.
    pub fn follow(&mut self, wheels_rad_s: f32) {
        self.lesson = Lesson::default();
        self.turn(wheels_rad_s);
    }

    /// Advances the heading by one tick at a rate.
    fn turn(&mut self, rate_rad_s: f32) {
        self.yaw_rate_rad_s = rate_rad_s;
        let step = rate_rad_s * self.dt_s - self.carry_rad;
        let sum = self.heading_rad + step;
        self.carry_rad = (sum - self.heading_rad) - step;
        self.heading_rad = sum;
    }

    /// Learns from one tick at rest. The bias changes by the corrections of the block before the last whole block.
    fn learn(&mut self, error_rad_s: [f32; 2]) {
        let Lesson {
            ticks,
            new_rad_s: new,
            ripe_rad_s: ripe,
        } = &mut self.lesson;
        for (new, error) in new.iter_mut().zip(error_rad_s) {
            *new += self.bias_gain * error;
        }
        *ticks += 1;
        if *ticks == LESSON_TICKS {
            for (bias, ripe) in self.bias_rad_s.iter_mut().zip(*ripe) {
                *bias += ripe;
            }
            self.lesson = Lesson {
                ticks: 0,
                new_rad_s: [0.0; 2],
                ripe_rad_s: *new,
            };
        }
    }

    /// Sets the biases of the gyro's x and z axes, rad/s.
    pub fn set_bias(&mut self, bias_xz_rad_s: [f32; 2]) {
        self.bias_rad_s = bias_xz_rad_s;
    }

    /// Biases of the gyro's x and z axes, rad/s.
    pub fn bias_rad_s(&self) -> [f32; 2] {
        self.bias_rad_s
    }

    /// Heading in rad, anticlockwise positive, not wrapped; 0 when the core begins.
    pub fn heading_rad(&self) -> f32 {
        self.heading_rad
    }

    /// Yaw rate in rad/s, less the bias.
    pub fn yaw_rate_rad_s(&self) -> f32 {
        self.yaw_rate_rad_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(x: f32, z: f32, angle: f32, wheels_rad_s: f32) -> YawReading {
        YawReading {
            gyro_xz_rad_s: [x, z],
            normal_sin_cos: [angle.sin(), angle.cos()],
            wheels_rad_s,
        }
    }

    #[test]
    fn the_biases_learnt_at_rest_hold_at_every_angle_of_the_arm() {
        let [bias_x, bias_z] = [0.02_f32, -0.01];
        let mut estimator = HeadingEstimator::new(0.001, 10.0);
        for _ in 0..10_000 {
            estimator.update(&reading(bias_x, bias_z, 0.0, 0.0), true);
        }
        for angle in [-0.6_f32, 0.0, 0.3, 1.0] {
            let before = estimator.heading_rad();
            for _ in 0..10_000 {
                let (sin, cos) = angle.sin_cos();
                estimator.update(&reading(bias_x + 0.5 * sin, bias_z + 0.5 * cos, angle, 0.5), false);
            }
            let turned = estimator.heading_rad() - before;
            assert!((turned - 5.0).abs() < 0.002, "{angle}: {turned}");
        }
    }

    #[test]
    fn another_estimator_goes_on_with_heading_and_biases_at_its_own_rate_of_learning() {
        let mut before = HeadingEstimator::new(0.001, 10.0);
        for _ in 0..10_000 {
            before.update(&reading(0.0, 0.01, 0.0, 0.0), true);
        }
        for _ in 0..1_000 {
            before.update(&reading(0.0, 0.51, 0.0, 0.5), false);
        }
        let mut after = HeadingEstimator::new(0.001, 1000.0).with_heading_of(&before);
        assert_eq!(after.heading_rad(), before.heading_rad());
        assert_eq!(after.yaw_rate_rad_s(), before.yaw_rate_rad_s());
        for estimator in [&mut before, &mut after] {
            estimator.update(&reading(0.0, 0.51, 0.0, 0.5), false);
            assert!((estimator.yaw_rate_rad_s() - 0.5).abs() < 1e-3, "the bias is known");
        }
        // The estimator learns a new bias with the new time constant.
        for _ in 0..2_000 {
            before.update(&reading(0.0, 0.03, 0.0, 0.0), true);
            after.update(&reading(0.0, 0.03, 0.0, 0.0), true);
        }
        assert!(before.yaw_rate_rad_s() < 0.005 && after.yaw_rate_rad_s() > 0.015);
    }

    #[test]
    fn wheels_of_unequal_radius_or_slipping_change_nothing_while_driving() {
        for wheels_rad_s in [0.001, 0.02, 0.05, 3.0] {
            let mut estimator = HeadingEstimator::new(0.001, 10.0);
            for _ in 0..100_000 {
                estimator.update(&reading(0.0, 0.0, 0.0, wheels_rad_s), false);
            }
            assert_eq!(estimator.heading_rad(), 0.0);
        }
    }

    #[test]
    fn the_first_ticks_of_a_turn_are_no_bias() {
        for rest_ticks in [5000, 5020, 5049] {
            let mut estimator = HeadingEstimator::new(0.001, 60.0);
            for _ in 0..rest_ticks {
                estimator.update(&reading(0.0, 0.0, 0.0, 0.0), true);
            }
            // The wheels are known 8 ms later than the gyro; until they turn, the vehicle counts as resting.
            for tick in 0..8 {
                estimator.update(&reading(0.0, 0.004 * tick as f32, 0.0, 0.0), true);
            }
            estimator.update(&reading(0.0, 0.0, 0.0, 0.0), false);
            assert_eq!(estimator.yaw_rate_rad_s(), 0.0, "{rest_ticks}");
        }
    }

    #[test]
    fn a_vehicle_known_to_stand_keeps_its_heading() {
        let mut estimator = HeadingEstimator::new(0.001, 60.0);
        estimator.update(&reading(0.0, 0.5, 0.0, 0.5), false);
        let before = estimator.heading_rad();
        estimator.stand();
        assert_eq!(estimator.heading_rad(), before);
        assert_eq!(estimator.yaw_rate_rad_s(), 0.0);
    }

    #[test]
    fn a_turn_that_the_wheels_do_not_show_is_no_bias() {
        let mut estimator = HeadingEstimator::new(0.001, 10.0);
        for _ in 0..10_000 {
            estimator.update(&reading(0.0, 0.1, 0.0, 0.0), true);
        }
        assert!((estimator.heading_rad() - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_fast_turn_does_not_depend_on_the_normals_direction() {
        for (rate, off) in [(1.9_f32, 0.02_f32), (-1.9, 0.03), (0.5, -0.03), (-0.7, 0.02)] {
            let mut estimator = HeadingEstimator::new(0.001, 10.0);
            // The arm is at 0.2 rad from the normal; the estimator assumes 0.2 + off.
            let (sin, cos) = 0.2_f32.sin_cos();
            for _ in 0..30_000 {
                estimator.update(&reading(rate * sin, rate * cos, 0.2 + off, rate), false);
            }
            let error_deg = (estimator.heading_rad() - 30.0 * rate).to_degrees();
            assert!(error_deg.abs() < 0.1, "{rate} {off}: {error_deg}");
        }
    }
}
