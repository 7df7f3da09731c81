//! Attempts at one obstacle: how long the obstacle has held the vehicle up, and how hard the vehicle may still push.
//!
//! A vehicle that bounces off an obstacle runs at it again. If each attempt began anew, the vehicle would push hard at an
//! obstacle that it cannot climb for as long as it is commanded to drive. All attempts at one place therefore share one
//! clock.

use crate::bounded::Bounded;

/// Way back, m, after which the vehicle has left the obstacle, so that it may push hard again: several times a rebound.
const LEFT_M: f32 = 0.5;
/// Time after which a stuck vehicle gives up pushing hard, and the time over which it lowers its arm, in time units.
/// Lowering the arm at once would pull the wheels off the obstacle, and the vehicle would bounce and start again. The
/// wheels keep pushing as long as the arm's weight gives more torque than its swing takes, `|phi''| < sin(phi) / L`.
/// Over four time units the arm comes down at a rate of no more than that value per time unit, so the arm can stop
/// within one time unit.
const PUSH_TIME: f32 = 14.0;
const GIVE_UP_TIME: f32 = 4.0;
/// Acceleration, g, whose arm angle a stuck vehicle adopts: while the vehicle pushes hard, and after it has given up.
/// The lower value keeps the motors cool.
const PUSH_HARD_G: f32 = 0.9;
const PUSH_ON_G: f32 = 0.25;

/// The place of the obstacle at which the vehicle tries, and for how long it has tried there.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Attempts {
    place_m: f32,
    /// In time units; 0 if nothing holds the vehicle up.
    time: f32,
}

impl Attempts {
    /// One tick in which the vehicle does not move as commanded. The furthest place that it has reached is `furthest_m`.
    #[inline]
    pub(super) fn hold(&mut self, furthest_m: f32, tick: f32) {
        if self.time == 0.0 {
            self.place_m = furthest_m;
        }
        self.time += tick;
    }

    /// The vehicle has come to `distance_m` on its way in `direction`. The attempts end when the vehicle is
    /// `progress_m` beyond the obstacle or has moved away from it.
    #[inline]
    pub(super) fn come_to(&mut self, direction: f32, distance_m: f32, progress_m: f32) {
        if self.time > 0.0 && !(-LEFT_M..progress_m).contains(&(direction * (distance_m - self.place_m))) {
            self.time = 0.0;
        }
    }

    /// The vehicle turns to another direction.
    #[inline]
    pub(super) fn end(&mut self) {
        self.time = 0.0;
    }

    /// The acceleration whose arm angle a stuck vehicle takes at most, g.
    pub(super) fn effort_g(self) -> f32 {
        let given_up = (self.time - PUSH_TIME) / GIVE_UP_TIME;
        (PUSH_HARD_G - (PUSH_HARD_G - PUSH_ON_G) * given_up).bounded(PUSH_ON_G, PUSH_HARD_G)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::equilibrium::Equilibrium;

    const TICK: f32 = 1.0 / 160.0;

    /// Attempts of `time` time units at `place_m`.
    fn held(attempts: &mut Attempts, place_m: f32, time: f32) {
        for _ in 0..(time / TICK) as u32 {
            attempts.hold(place_m, TICK);
        }
    }

    /// A vehicle that bounces off and comes back does not push hard anew, in either direction of driving.
    #[test]
    fn attempts_at_one_place_add_up() {
        for way in [1.0_f32, -1.0] {
            let mut attempts = Attempts::default();
            for k in 0..5 {
                assert_eq!(attempts.effort_g() == PUSH_HARD_G, k < 4, "{way} {k}");
                held(&mut attempts, 3.0 * way, 4.0);
                // It bounces off, and comes back.
                attempts.come_to(way, 2.7 * way, 0.01);
                attempts.come_to(way, 3.0 * way, 0.01);
            }
            assert_eq!(attempts.effort_g(), PUSH_ON_G);
        }
    }

    #[test]
    fn a_vehicle_that_has_come_over_left_or_turned_may_push_hard_again() {
        for way in [1.0_f32, -1.0] {
            let after = |end: &dyn Fn(&mut Attempts)| {
                let mut attempts = Attempts::default();
                held(&mut attempts, 3.0 * way, 20.0);
                assert_eq!(attempts.effort_g(), PUSH_ON_G);
                end(&mut attempts);
                attempts.effort_g()
            };
            assert_eq!(after(&|attempts| attempts.come_to(way, 3.02 * way, 0.01)), PUSH_HARD_G);
            assert_eq!(after(&|attempts| attempts.come_to(way, 2.4 * way, 0.01)), PUSH_HARD_G);
            assert_eq!(after(&|attempts| attempts.come_to(way, 2.6 * way, 0.01)), PUSH_ON_G);
            assert_eq!(after(&Attempts::end), PUSH_HARD_G);
        }
    }

    /// Against an obstacle the vehicle pushes hard, then less. The arm comes down so slowly that its weight alone still
    /// turns the wheels forward while the arm gains or loses its rate within one time unit.
    #[test]
    fn a_stuck_vehicle_gives_up_without_pulling_itself_off_the_obstacle() {
        const L: f32 = 0.8;
        let weight = Equilibrium {
            alpha_l: 0.9 * L,
            mass: 1.3,
            mu: 0.066,
        };
        let mut attempts = Attempts::default();
        let mut efforts = [0.0_f32; 4000];
        for effort in &mut efforts {
            attempts.hold(1.0, TICK);
            *effort = attempts.effort_g();
        }
        assert_eq!((efforts[0], efforts[3999]), (PUSH_HARD_G, PUSH_ON_G));
        for pair in efforts.windows(161) {
            let [before, now] = [pair[0], pair[160]].map(|effort| weight.arm(effort, 0.0, 1.0));
            let rate = libm::asinf(before.sin) - libm::asinf(now.sin);
            assert!(rate < now.sin / L, "{rate} at {}", now.sin);
        }
    }
}
