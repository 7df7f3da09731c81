//! Slopes on which the vehicle cannot stand: the law finds them once the wheels are let go, and refuses them.

/// How far and how long the slope must be beyond what the vehicle can stand on: excess of its sine, integrated over time
/// units. While the slope is learnt, it is overestimated by up to a sine of 0.045 for two time units, after which it is
/// underestimated: a triangle of that height and length.
const EXCESS_TIME: f32 = 0.06;
/// The same once the slope has been learnt, which takes so many time units.
const EXCESS_LEARNT: f32 = 0.006;
const LEARNT_TIME: f32 = 20.0;

/// Landing speed below which a vehicle stands; how near the slope has to be, as a sine, to the steepest slope that the
/// vehicle can stand on, for standing to prove anything; and for how long. A vehicle that is held by hand has not found
/// its slope.
const STANDS_SPEED: f32 = 0.02;
const STANDS_EXCESS: f32 = -0.15;
const STANDS_TIME: f32 = 6.0;

/// Whether a vehicle that was armed where it cannot stand is to be refused.
///
/// At rest with its arm hanging no sensor shows the slope; only once the wheels are let go does the law learn the slope. A
/// vehicle that has been commanded to drive since it was armed came to the slope by itself, and can drive back on
/// command: a limit is enough. The limit is also enough for a vehicle that has stood on a slope as steep: it can stand
/// there, and open bridges would let it go.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct SlopeRefusal {
    driven: bool,
    excess: f32,
    /// Its value when the slope had been learnt.
    learning: f32,
    /// Time since it was armed, and for which it has stood, in time units.
    age: f32,
    stood: f32,
    refuses: bool,
}

impl SlopeRefusal {
    /// One tick on a slope whose sine, without its sign, is `excess` more than that of the steepest one the vehicle can
    /// stand on, at a landing speed. `drives` says that the operator wants a speed or a turn.
    pub(super) fn update(&mut self, excess: f32, landing: f32, drives: bool, tick: f32) {
        self.driven |= drives;
        // Once refused, the vehicle stays so.
        if self.is_settled() {
            return;
        }
        let slow = landing.abs() < STANDS_SPEED;
        if slow && excess <= STANDS_EXCESS {
            // It stands on little of a slope, or is held by hand and has not found its slope: nothing is learnt.
            self.stood = 0.0;
            return;
        }
        self.stood = if slow { self.stood + tick } else { 0.0 };
        if self.stood > STANDS_TIME {
            self.driven = true;
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

    /// Nothing changes any more until the vehicle is armed anew.
    #[inline]
    pub(super) fn is_settled(self) -> bool {
        self.driven || self.refuses
    }

    /// The vehicle was armed on a slope on which it cannot stand.
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

    /// Time units until `excess` is refused, if it ever is.
    fn refused_after(refusal: &mut SlopeRefusal, excess: impl Fn(f32) -> f32, drives: bool) -> Option<f32> {
        (0..5000).map(|k| k as f32 * TICK).find(|time| {
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

    /// 31 deg where 30.96 stand.
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

    /// Held by hand for a while after it was armed, and then let go on a slope that it can stand on: it learns as any other.
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

    /// One that is held by hand, its slope not found, has not stood; nor has one that stops for a moment.
    #[test]
    fn a_vehicle_that_has_stood_on_the_slope_is_not_refused_later() {
        for (excess, landing, time, refused) in [
            (-0.01, 0.01, 7.0, false),
            (-0.01, -0.01, 7.0, false),
            (-0.01, 0.01, 5.0, true),
            (-0.5, 0.0, 100.0, true),
            (-0.01, 0.05, 100.0, true),
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
