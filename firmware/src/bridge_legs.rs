//! How a bridge with two inputs produces a mean voltage: it alternates between drive and brake and is never open.
//!
//! A driver with inputs IN1 and IN2 drives forward at high and low, in reverse at low and high, brakes (zero volts across
//! the motor) at both high, and is open at both low. For a duty, the input of the driven direction stays high throughout
//! the period, and the other input is low only for the driven share: the motor gets the supply in one direction, or zero
//! volts. At zero duty both inputs are high throughout the period. The two inputs are never low together, because that is
//! the state of a disarmed vehicle.
//!
//! The timers count up and down: the driving interval is centred on the counter's top, the braking interval on its zero.
//! The current crosses its mean in the middle of each interval. No edge is nearer to the middle of the braking interval
//! than 3 % of the period, 1.5 us; the converter samples the left and the right current there. The ballast's sample ends
//! 1.59 us after the middle, which is beyond the edge only at the largest duty.

use crate::drive_board::DUTY_MAX_PERCENT;

/// Number of timer counts for which each input of a bridge is high, from the start of the half period in which the timer
/// counts up. The other half is the mirror image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LegCounts {
    /// IN1: high drives forward.
    pub in1: u16,
    /// IN2: high drives in reverse.
    pub in2: u16,
}

/// The counts for a duty, in units of the full scale of [`model::sample::Actuation::duty`], for a half period of `half`
/// counts. The bridge limits the duty to [`DUTY_MAX_PERCENT`]. Below this limit the mean voltage is the duty's share of
/// the supply, within one count for half periods of up to 16,000 counts.
// A shift replaces the division by 2^15 - 1, and the function is inlined although the firmware is compiled for size,
// because each tick calls it three times.
#[inline(always)]
#[must_use]
pub fn leg_counts(duty: i16, half_counts: u16) -> LegCounts {
    const FULL_SCALE_BITS: u32 = 15;
    let all = i32::from(half_counts);
    let most = all * DUTY_MAX_PERCENT.cast_signed() / 100;
    let rounding = 1 << (FULL_SCALE_BITS - 1);
    let driven = ((i32::from(duty) * all + rounding) >> FULL_SCALE_BITS).clamp(-most, most);
    LegCounts {
        // The result lies between 0 and the number of counts, which is a u16.
        in1: (all + driven.min(0)) as u16,
        in2: (all - driven.max(0)) as u16,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Numbers of counts of half a period in which the bridge drives forward, drives in reverse, brakes and is open,
    /// counted one by one from the driver's table.
    fn states(counts: LegCounts, half: u16) -> [i32; 4] {
        let mut states = [0; 4];
        for count in 0..half {
            let state = match (count < counts.in1, count < counts.in2) {
                (true, false) => 0,
                (false, true) => 1,
                (true, true) => 2,
                (false, false) => 3,
            };
            states[state] += 1;
        }
        states
    }

    proptest! {
        /// For every duty, including undefined duties, the mean voltage is the duty's share of the supply within one
        /// count, up to the largest duty, and the bridge is never open. The half periods are those of both boards and
        /// others.
        #[test]
        fn a_duty_is_its_share_of_the_period(duty: i16, half in prop_oneof![Just(5_000_u16), Just(5_400), 100..=16_000_u16]) {
            let [forward, reverse, brake, open] = states(leg_counts(duty, half), half);
            prop_assert_eq!(open, 0);
            prop_assert!(forward == 0 || reverse == 0, "one direction within a period");
            let most = f64::from(DUTY_MAX_PERCENT) / 100.0;
            let wanted = (f64::from(duty) / f64::from(i16::MAX)).clamp(-most, most) * f64::from(half);
            prop_assert!((f64::from(forward - reverse) - wanted).abs() <= 1.0);
            // A brake in every period: 6 % of it, less the count that rounds.
            prop_assert!(100 * brake >= (100 - DUTY_MAX_PERCENT.cast_signed()) * i32::from(half) - 100);
        }
    }

    #[test]
    fn zero_volts_are_both_high_throughout() {
        let counts = leg_counts(0, 10_000);
        assert_eq!((counts.in1, counts.in2), (10_000, 10_000));
        assert_eq!(states(counts, 10_000), [0, 0, 10_000, 0]);
    }

    #[test]
    fn the_direction_says_which_input_falls() {
        let half = leg_counts(i16::MAX / 2, 10_000);
        assert_eq!((half.in1, half.in2), (10_000, 5_000));
        let back = leg_counts(-i16::MAX / 2, 10_000);
        assert_eq!((back.in1, back.in2), (5_000, 10_000));
    }
}
