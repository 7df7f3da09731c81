//! Learns the accelerometer's offset in turns, where the offset looks like a slide.
//!
//! At rest the estimated vertical takes the offset over: accelerometer and estimate agree, and both are wrong by the offset `b`. In
//! a turn the error of the vertical keeps its direction in the world, while the offset turns with the body. With complex numbers in
//! the body's axes, real forward and imaginary to the left, and with a vertical that the accelerometer corrects by the share `k`
//! per second, the error of the vertical is `D b`:
//!
//! ```text
//! D' = -i psi' D + k (1 - D)      D = 1 after a rest
//! ```
//!
//! The accelerometer then differs from the estimate by `(1 - D) b`: after half a turn on the spot by twice the offset, in a long turn
//! by the offset itself. Each heading gives one equation for the same `b`, so recursive least squares find the offset. A vehicle that
//! has not turned has `1 - D = 0`: nothing is learnt, nothing is explained, and a slide on a straight is judged as before.
//!
//! A slide must not pass for an offset. The learner therefore accepts only differences that an offset can cause at the heading
//! turned so far, and trusts the accelerometer less the more the vehicle accelerates. The largest offset is bounded.

use super::facing::INTERVAL_S;
use super::trust::Trust;
use crate::bounded::Bounded;

/// The learner, called once per interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AccelerometerOffset {
    /// Share of its error by which the accelerometer corrects the vertical in an interval.
    correction: f32,
    /// `1 - D`: what the accelerometer differs by, as a share of the offset, forward and to the left.
    shown: [f32; 2],
    /// The offset, forward and to the left, m/s^2.
    offset_m_s2: [f32; 2],
    /// Variance of each component of the offset, m^2/s^4.
    variance: f32,
    explained_m_s2: [f32; 2],
}

/// Largest offset along an axis, m/s^2: the +-20 mg of the ICM-42688-P's data sheet, and 5 mg for its temperature.
const OFFSET_MAX_M_S2: f32 = 0.25;
/// Variance before the first turn, of 15 mg; and the least variance, of 2 mg, by which the learner follows the temperature.
const FIRST_VARIANCE: f32 = 0.15 * 0.15;
const LEAST_VARIANCE: f32 = 0.02 * 0.02;
/// Variance of one interval's difference, m^2/s^4, of a vehicle that does not accelerate; and by how much more of it per square of
/// the acceleration. Errors of the compensation last for some tenths of a second, or tens of intervals.
const NOISE: f32 = 0.5;
const NOISE_PER_M2_S4: f32 = 0.5;
/// Square of the largest difference that an offset of 20 mg along both axes leaves, as a multiple of the square of the share that
/// the heading shows; and the square of what errors of the compensation add, m^2/s^4.
const LARGEST: f32 = 0.08;
const LARGEST_ERROR: f32 = 0.02;
/// Yaw rate, rad/s, below which the vehicle does not turn; and square of the share below which a turn is forgotten.
const TURNS_RAD_S: f32 = 0.05;
const FORGOTTEN: f32 = 1e-4;

impl AccelerometerOffset {
    /// A learner for a vertical that the accelerometer corrects with the time constant `time_constant_s`.
    pub fn new(time_constant_s: f32) -> Self {
        Self {
            correction: INTERVAL_S / time_constant_s,
            shown: [0.0; 2],
            offset_m_s2: [0.0; 2],
            variance: FIRST_VARIANCE,
            explained_m_s2: [0.0; 2],
        }
    }

    /// By how much the learnt offset makes the accelerometer differ from the estimated vertical, forward and to the left, m/s^2.
    pub fn explained_m_s2(&self) -> [f32; 2] {
        self.explained_m_s2
    }

    /// Turns the vehicle for one interval, while the vertical is corrected with `trust`.
    ///
    /// ```
    /// use model::estimate::accelerometer_offset::AccelerometerOffset;
    /// use model::estimate::trust::Trust;
    /// // An offset of 0.15 m/s^2 to the rear, while the vehicle turns on the spot at 1 rad/s for 4 s. The offset explains all but a
    /// // hundredth of a difference that reaches 0.26 m/s^2.
    /// let [mut learner, mut oracle] = [AccelerometerOffset::new(2.0); 2];
    /// for _ in 0..800 {
    ///     learner.turn(1.0, Trust::Driving);
    ///     oracle.turn(1.0, Trust::Driving);
    ///     let left = oracle.difference_m_s2([-0.15, 0.0]);
    ///     let [forward, aside] = learner.explained_m_s2();
    ///     learner.learn([left[0] - forward, left[1] - aside], 0.0);
    /// }
    /// learner.turn(1.0, Trust::Driving);
    /// oracle.turn(1.0, Trust::Driving);
    /// let [found, true_m_s2] = [learner.explained_m_s2(), oracle.difference_m_s2([-0.15, 0.0])];
    /// assert!(found.iter().zip(true_m_s2).all(|(f, t)| (f - t).abs() < 0.005), "{found:?} of {true_m_s2:?}");
    /// ```
    #[inline]
    pub fn turn(&mut self, yaw_rate_rad_s: f32, trust: Trust) {
        let [forward, left] = self.shown;
        if yaw_rate_rad_s.abs() < TURNS_RAD_S && forward * forward + left * left < FORGOTTEN {
            self.shown = [0.0; 2];
            self.explained_m_s2 = [0.0; 2];
            return;
        }
        let (factor, _) = trust.factors();
        let (step_rad, correction) = (INTERVAL_S * yaw_rate_rad_s, factor * self.correction);
        let forward = forward + step_rad * left - correction * forward;
        // With the new forward component, a turn alone does not change the size of D.
        let left = left + step_rad * (1.0 - forward) - correction * left;
        self.shown = [forward, left];
        self.explained_m_s2 = self.difference_m_s2(self.offset_m_s2);
    }

    /// Learns from the difference that the learnt offset leaves unexplained, forward and to the left, while wheels and turn
    /// accelerate the vehicle by `motion_m_s2`.
    #[inline]
    pub fn learn(&mut self, [forward_m_s2, left_m_s2]: [f32; 2], motion_m_s2: f32) {
        let [forward, left] = self.shown;
        let shown = forward * forward + left * left;
        let size = forward_m_s2 * forward_m_s2 + left_m_s2 * left_m_s2;
        if shown < FORGOTTEN || size > LARGEST * shown + LARGEST_ERROR {
            return;
        }
        let noise = NOISE + NOISE_PER_M2_S4 * motion_m_s2 * motion_m_s2;
        let gain = self.variance / (self.variance * shown + noise);
        let most = OFFSET_MAX_M_S2;
        let [offset_forward, offset_left] = self.offset_m_s2;
        self.offset_m_s2 = [
            (offset_forward + gain * (forward * forward_m_s2 + left * left_m_s2)).bounded(-most, most),
            (offset_left + gain * (forward * left_m_s2 - left * forward_m_s2)).bounded(-most, most),
        ];
        self.variance = (gain * noise).max(LEAST_VARIANCE);
    }

    /// By how much an offset makes the accelerometer differ from the estimated vertical at this heading.
    #[must_use]
    pub fn difference_m_s2(&self, [offset_forward, offset_left]: [f32; 2]) -> [f32; 2] {
        let [forward, left] = self.shown;
        [
            forward * offset_forward - left * offset_left,
            forward * offset_left + left * offset_forward,
        ]
    }
}
