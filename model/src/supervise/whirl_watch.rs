//! Watches whether the arm comes back after it has swung beyond its largest angle.
//!
//! Beyond that angle the landing law's barrier pulls the arm home with the motors' whole torque, and so does the arm's own
//! weight. Open bridges would leave it to its weight, and a vehicle on a slope without a brake. The bridges therefore open
//! only once the arm is lost: it turns over, or it has not come back in time.

use super::arming::Mode;
use crate::bounded::Bounded;
use crate::persistence::Persistence;
use crate::vehicle::{SpeedLawChoice, Vehicle};

/// Angle from the vertical, rad, beyond which an arm turns over: neither its weight nor the motors have stopped it on the
/// way. In simulated pushes every arm that came to 121 deg at most returned, and none that came beyond 135 deg did.
const OVERTURNS_RAD: f32 = 0.75 * core::f32::consts::PI;
/// Ticks within which the arm must come back. The weight alone brings a pendulum of 0.2 m back from 135 deg in 0.35 s, after
/// as long a way up. Motors that the supply hardly turns any faster need up to 0.9 s.
const RETURN_TICKS: u16 = 1000;

/// The watch of the arm's angle: finds an arm that whirls or is about to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WhirlWatch {
    largest_rad: f32,
    /// Angle at which the arm is lost, rad; not less than `largest_rad`.
    lost_rad: f32,
    beyond: Persistence,
}

impl WhirlWatch {
    /// The watch of `vehicle`'s arm. Eq. 3.25 does not know how far the arm may swing and does not pull it home: under that
    /// law the arm is lost as soon as it is beyond `phi_max_rad`.
    pub(super) fn new(vehicle: &Vehicle<f32>) -> Self {
        let largest_rad = vehicle.parameters().safety.phi_max_rad;
        let lost_rad = match vehicle.speed_law() {
            SpeedLawChoice::Landing => OVERTURNS_RAD.bounded(largest_rad, f32::MAX),
            SpeedLawChoice::SwingDamped => largest_rad,
        };
        Self {
            largest_rad,
            lost_rad,
            beyond: Persistence::new(RETURN_TICKS),
        }
    }

    /// One tick in `mode` with the arm at `phi_rad`. Returns whether the arm is lost. A controlled stop has a cause of its own
    /// and ends with open bridges anyway: there the arm has no time to come back.
    #[inline]
    pub(super) fn update(&mut self, phi_rad: f32, mode: Mode) -> bool {
        let angle_rad = phi_rad.abs();
        let beyond = angle_rad > self.largest_rad;
        let stays = self.beyond.update(beyond);
        beyond && (stays || mode != Mode::Armed || angle_rad > self.lost_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::test_vehicle::reference;

    /// The reference vehicle's arm, whose largest angle is 1.4 rad, under a law and with another largest angle.
    fn watch(law: f32, phi_max_rad: f32) -> WhirlWatch {
        let mut parameters = *reference().parameters();
        parameters.control.law = law;
        parameters.safety.phi_max_rad = phi_max_rad;
        WhirlWatch::new(&Vehicle::new(parameters).expect("valid"))
    }

    const LANDING: f32 = 1.0;
    const EQ_3_25: f32 = 0.0;

    /// Ticks until an armed vehicle's arm at `phi_rad` is lost; `None` if it is not within 2,000.
    fn lost_after(watch: &mut WhirlWatch, phi_rad: f32) -> Option<u32> {
        (1..=2000).find(|_| watch.update(phi_rad, Mode::Armed))
    }

    #[test]
    fn an_arm_that_does_not_come_back_is_lost_after_a_second_and_one_that_turns_over_at_once() {
        for side in [-1.0, 1.0] {
            let lost = |phi_rad: f32| lost_after(&mut watch(LANDING, 1.4), side * phi_rad);
            assert_eq!(lost(1.4), None);
            assert_eq!(lost(1.41), Some(1000));
            assert_eq!(lost(2.35), Some(1000));
            assert_eq!(lost(2.36), Some(1));
        }
    }

    #[test]
    fn an_arm_that_comes_back_has_its_time_anew() {
        let mut watch = watch(LANDING, 1.4);
        for _ in 0..3 {
            for _ in 0..999 {
                assert!(!watch.update(1.5, Mode::Armed));
            }
            assert!(!watch.update(1.4, Mode::Armed));
        }
    }

    #[test]
    fn in_a_controlled_stop_an_arm_beyond_its_largest_angle_is_lost_at_once() {
        let mut watch = watch(LANDING, 1.4);
        assert!(!watch.update(1.41, Mode::Armed));
        assert!(!watch.update(1.4, Mode::Stopping));
        assert!(watch.update(-1.41, Mode::Stopping));
    }

    #[test]
    fn under_eq_3_25_an_arm_beyond_its_largest_angle_is_lost_at_once() {
        let mut watch = watch(EQ_3_25, 1.4);
        assert_eq!(lost_after(&mut watch, 1.4), None);
        assert_eq!(lost_after(&mut watch, -1.41), Some(1));
    }

    #[test]
    fn an_arm_that_may_swing_beyond_a_right_angle_and_a_half_is_lost_there() {
        let mut watch = watch(LANDING, 3.0);
        assert_eq!(lost_after(&mut watch, 2.9), None);
        assert_eq!(lost_after(&mut watch, 3.01), Some(1));
    }
}
