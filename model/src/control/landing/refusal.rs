//! Slopes on which the vehicle cannot stand: the law detects such a slope once the wheels are released, and refuses it.

/// How far and how long the slope must exceed the steepest slope on which the vehicle can stand: the excess of its sine,
/// integrated over time units. While the law learns the slope, it overestimates the sine by up to 0.045 for two time
/// units and underestimates the sine afterwards. The error is a triangle of that height and length.
const EXCESS_TIME: f32 = 0.06;
/// The same once the slope has been learnt, and the time units that learning takes.
const EXCESS_LEARNT: f32 = 0.006;
const LEARNT_TIME: f32 = 20.0;

/// Landing speed below which a vehicle stands; distance, as a sine, within which the slope must be of the steepest slope
/// on which the vehicle can stand, so that standing proves anything; and the time for which the vehicle must stand. A
/// vehicle that is held by hand has not learnt its slope.
const STANDS_SPEED: f32 = 0.02;
const STANDS_EXCESS: f32 = -0.15;
const STANDS_TIME: f32 = 6.0;
/// Time units for which the slope must stay beyond the limit to be a slope once the vehicle has stood for that time on a
/// gentle one: the observer takes a push for a slope too, and nobody pushes for so long, 6.4 s with a wheel radius of 0.25 m
/// and 4 s with 0.1 m.
const PUSHED_TIME: f32 = 40.0;

/// Decides whether the law refuses a vehicle that was armed where it cannot stand.
///
/// While the vehicle is at rest with its arm hanging, no sensor shows the slope; the law learns the slope only once the
/// wheels are released. A vehicle that has been commanded to drive since arming drove onto the slope and can drive back
/// on command, so a limit is enough. A limit is also enough for a vehicle that has stood on a slope as steep: the
/// vehicle can stand there, and open bridges would let it roll.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct SlopeRefusal {
    driven: bool,
    excess: f32,
    /// The integral's value when the slope had been learnt.
    learning: f32,
    /// Time since the vehicle was armed, and time for which it has stood, in time units.
    age: f32,
    stood: f32,
    /// Time for which the vehicle has stood on a gentle slope or was held by hand, and time for which
    /// the slope has been beyond the limit since, in time units.
    rested: f32,
    beyond: f32,
    refuses: bool,
}

impl SlopeRefusal {
    /// One tick at a landing speed, uphill positive, on a slope whose absolute sine exceeds that of the steepest slope on
    /// which the vehicle can stand by `excess`. `drives` means that the operator wants a speed or a turn.
    pub(super) fn update(&mut self, excess: f32, uphill: f32, drives: bool, tick: f32) {
        self.driven |= drives;
        // A settled decision does not change.
        if self.is_settled() {
            return;
        }
        let slow = uphill.abs() < STANDS_SPEED;
        if slow && excess <= STANDS_EXCESS {
            // The vehicle stands on a shallow slope, or is held by hand and has not learnt its slope: standing does not
            // prove that it can stand here.
            self.stood = 0.0;
            self.rested += tick;
            self.beyond = 0.0;
            return;
        }
        // A vehicle that returns uphill to its place has stopped on this slope.
        let stands = slow || (uphill > 0.0 && excess < 0.0);
        self.stood = if stands { self.stood + tick } else { 0.0 };
        if self.stood > STANDS_TIME {
            self.driven = true;
            return;
        }
        if self.rested >= STANDS_TIME {
            self.beyond = if excess > 0.0 { self.beyond + tick } else { 0.0 };
            self.refuses = self.beyond > PUSHED_TIME;
            return;
        }
        self.age += tick;
        self.excess = (self.excess + excess * tick).max(0.0);
        let learns = self.age < LEARNT_TIME;
        if learns {
            self.learning = self.excess;
        }
        let most = if learns {
            EXCESS_TIME
        } else {
            self.learning + EXCESS_LEARNT
        };
        self.refuses = self.excess > most;
    }

    /// Whether the decision is final until the vehicle is armed again.
    #[inline]
    pub(super) fn is_settled(self) -> bool {
        self.driven || self.refuses
    }

    /// Whether the vehicle was armed on a slope on which it cannot stand.
    pub(super) fn refuses(self) -> bool {
        self.refuses
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: f32 = 0.00626;
    /// A landing speed.
    const ROLLS: f32 = -0.3;

    /// Time units until the law refuses `excess`; `None` if it never does.
    fn refused_after(refusal: &mut SlopeRefusal, excess: impl Fn(f32) -> f32, drives: bool) -> Option<f32> {
        (0..10_000).map(|k| k as f32 * TICK).find(|time| {
            refusal.update(excess(*time), ROLLS, drives, TICK);
            refusal.refuses()
        })
    }

    #[test]
    fn a_slope_beyond_the_limit_is_refused_the_sooner_the_steeper() {
        let after = |excess: f32| refused_after(&mut SlopeRefusal::default(), |_| excess, false).expect("refused");
        assert!((after(0.06) - 1.0).abs() < 2.0 * TICK && (after(0.03) - 2.0).abs() < 2.0 * TICK);
        assert_eq!(refused_after(&mut SlopeRefusal::default(), |_| 0.0, false), None);
    }

    #[test]
    fn what_learning_the_slope_overestimates_is_no_refusal() {
        let learning = |time: f32| 0.045 * (1.0 - (time - 1.0).abs()).max(-1.0);
        assert_eq!(refused_after(&mut SlopeRefusal::default(), learning, false), None);
    }

    /// The slope is 31 deg; the vehicle can stand on 30.96 deg.
    #[test]
    fn a_slope_hardly_beyond_the_limit_is_refused_once_it_is_learnt() {
        let after = refused_after(&mut SlopeRefusal::default(), |_| 0.0006, false).expect("refused");
        assert!((after - 30.0).abs() < 0.1, "{after}");
        assert_eq!(refused_after(&mut SlopeRefusal::default(), |_| -0.001, false), None);
        let learning = |time: f32| if time < 2.0 { 0.0295 } else { -0.001 };
        let mut soon = SlopeRefusal::default();
        assert_eq!(
            refused_after(&mut soon, learning, false),
            None,
            "what is left of learning goes first"
        );
    }

    /// A vehicle that is held by hand for a while after arming and then released on a slope on which it can stand learns
    /// the slope as any other vehicle does.
    #[test]
    fn a_vehicle_that_was_held_learns_its_slope_before_it_is_refused() {
        let mut refusal = SlopeRefusal::default();
        for _ in 0..(40.0 / TICK) as u32 {
            refusal.update(-0.5, 0.0, false, TICK);
        }
        let learning = |time: f32| 0.045 * (1.0 - (time - 1.0).abs()).max(0.0) - 0.0145;
        assert_eq!(refused_after(&mut refusal, learning, false), None);
    }

    #[test]
    fn a_vehicle_that_has_driven_is_not_refused_and_a_refused_one_stays_so() {
        assert_eq!(refused_after(&mut SlopeRefusal::default(), |_| 0.1, true), None);
        let mut driven = SlopeRefusal::default();
        driven.update(-0.5, ROLLS, true, TICK);
        assert_eq!(refused_after(&mut driven, |_| 0.1, false), None);
        let mut refused = SlopeRefusal::default();
        refused_after(&mut refused, |_| 0.1, false).expect("refused");
        refused.update(-1.0, ROLLS, false, 10.0);
        assert!(refused.refuses());
    }

    /// A push at a vehicle that stands on level ground looks like a slope of `excess` while it lasts.
    #[test]
    fn a_push_at_a_standing_vehicle_is_no_slope_and_a_slope_that_lasts_is_one() {
        for excess in [0.003, 0.06, 0.3] {
            for (pushed, refused) in [(5.0, false), (20.0, false), (38.0, false), (42.0, true), (60.0, true)] {
                let mut refusal = SlopeRefusal::default();
                for _ in 0..2 {
                    for _ in 0..(7.0 / TICK) as u32 {
                        refusal.update(-0.5, 0.0, false, TICK);
                    }
                    for _ in 0..(pushed / TICK) as u32 {
                        refusal.update(excess, ROLLS, false, TICK);
                    }
                }
                assert_eq!(refusal.refuses(), refused, "{excess}, {pushed}");
            }
        }
    }

    /// A vehicle that is held by hand without having learnt its slope has not stood. Neither has a vehicle that stops
    /// only for a moment. A vehicle that returns uphill to its place has stood; one that still rolls down, or that somebody
    /// pushes up a slope on which it cannot stand, has not.
    #[test]
    fn a_vehicle_that_has_stood_on_the_slope_is_not_refused_later() {
        for (excess, landing, time, refused) in [
            (-0.01, 0.01, 7.0, false),
            (-0.01, -0.01, 7.0, false),
            (-0.01, 0.01, 5.0, true),
            (-0.5, 0.0, 100.0, true),
            (-0.01, -0.05, 100.0, true),
            (-0.01, 0.05, 7.0, false),
            (-0.01, 0.05, 5.0, true),
            (0.0001, 0.05, 7.0, true),
        ] {
            let mut refusal = SlopeRefusal::default();
            for _ in 0..(time / TICK) as u32 {
                refusal.update(excess, landing, false, TICK);
            }
            let found = refused_after(&mut refusal, |_| 0.03, false);
            assert_eq!(found.is_some(), refused, "{excess}, {landing}, {time}");
        }
    }
}
