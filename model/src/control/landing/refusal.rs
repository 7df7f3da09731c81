//! Slopes on which the vehicle cannot stand: found while it is let go, and refused.

/// How far and how long the slope must be beyond what the vehicle can stand on: excess of its sine, integrated over time
/// units. While the slope is learnt, it is overestimated by up to a sine of 0.045 for two time units, after which it is
/// underestimated: a triangle of that height and length.
const EXCESS_TIME: f32 = 0.06;

/// Whether a vehicle that was armed where it cannot stand is to be refused.
///
/// At rest with its arm hanging no sensor shows the slope; only once the wheels are let go does the law learn the slope. A
/// vehicle that has been told to drive since it was armed came to the slope by itself, and can be told to drive back: a limit
/// is enough for it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct SlopeRefusal {
    driven: bool,
    excess: f32,
}

impl SlopeRefusal {
    /// One tick on a slope whose sine, without its sign, is `excess` more than that of the steepest one the vehicle can
    /// stand on. `drives` tells that the operator wants a speed or a turn.
    pub(super) fn update(&mut self, excess: f32, drives: bool, tick: f32) {
        self.driven |= drives;
        // Once refused, the vehicle stays so.
        if !self.refuses() {
            self.excess = (self.excess + excess * tick).max(0.0);
        }
    }

    /// The vehicle was armed on a slope on which it cannot stand.
    pub(super) fn refuses(self) -> bool {
        !self.driven && self.excess > EXCESS_TIME
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: f32 = 0.00626;

    /// Time units until `excess` is refused, if it ever is.
    fn refused_after(refusal: &mut SlopeRefusal, excess: impl Fn(f32) -> f32, drives: bool) -> Option<f32> {
        (0..5000).map(|k| k as f32 * TICK).find(|time| {
            refusal.update(excess(*time), drives, TICK);
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

    #[test]
    fn a_vehicle_that_has_driven_is_not_refused_and_a_refused_one_stays_so() {
        assert_eq!(refused_after(&mut SlopeRefusal::default(), |_| 0.1, true), None);
        let mut driven = SlopeRefusal::default();
        driven.update(-0.5, true, TICK);
        assert_eq!(refused_after(&mut driven, |_| 0.1, false), None);
        let mut refused = SlopeRefusal::default();
        refused_after(&mut refused, |_| 0.1, false).expect("refused");
        refused.update(-1.0, false, 10.0);
        assert!(refused.refuses());
    }
}
