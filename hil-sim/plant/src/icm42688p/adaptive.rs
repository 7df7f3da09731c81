//! The part's adaptive full scale: the part measures slow rates in a finer range than configured. While it
//! changes between the two ranges, its gyro data do not change.
//!
//! The function is off only if the driver disables it (INTF_CONFIG1). A rate is slow below about 100 deg/s.
//! The change takes 1 to 2 ms, as users of the part have measured.

/// Rate of any axis above which the part leaves its fine range, in rad/s: 100 deg/s.
const STALL_RAD_S: f64 = 1.745_329_251_994_329_5;
/// Rate of every axis below which the part returns to its fine range: 90 deg/s, so that noise does not
/// toggle the range.
const SLOW_RAD_S: f64 = 0.9 * STALL_RAD_S;
/// Shortest stall, in s; the longest is twice as long.
const STALL_S: f64 = 1e-3;

/// The state of one part.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct AdaptiveRange {
    fast: bool,
    stalled_until_s: f64,
}

impl AdaptiveRange {
    /// Whether the gyro's data are frozen at a sample of these rates, in rad/s, at `now_s`. `bits` returns
    /// random bits.
    pub(super) fn stalls(&mut self, now_s: f64, rates: &[f64; 3], bits: impl FnOnce() -> u64) -> bool {
        let largest = rates.iter().fold(0.0_f64, |largest, rate| largest.max(rate.abs()));
        let fast = largest > if self.fast { SLOW_RAD_S } else { STALL_RAD_S };
        if fast != self.fast {
            self.fast = fast;
            let share = (bits() >> 11) as f64 / (1_u64 << 53) as f64;
            self.stalled_until_s = now_s + STALL_S * (1.0 + share);
        }
        now_s < self.stalled_until_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_stalls_for_one_to_two_milliseconds_at_each_crossing() {
        for (bits, expected) in [(0, 1), (u64::MAX, 2)] {
            let mut range = AdaptiveRange::default();
            // Samples every ms: slow, fast for 20 ms about all three axes, slow again.
            let mut stalled = Vec::new();
            for ms in 0..60 {
                let rate = if (20..40).contains(&ms) { -1.8 } else { 1.7 };
                let rates = if ms % 2 == 0 {
                    [rate, 0.0, 0.1]
                } else {
                    [0.0, 0.1, rate]
                };
                // A nanosecond late, like the sums of steps.
                if range.stalls(f64::from(ms) * 1e-3 + 1e-9, &rates, || bits) {
                    stalled.push(ms);
                }
            }
            // 1.7 rad/s is below the threshold coming from below, above the lower one coming from above.
            let crossing: Vec<i32> = (20..20 + expected).collect();
            assert_eq!(stalled, crossing);
        }
        let mut range = AdaptiveRange::default();
        assert!(range.stalls(0.0, &[2.0, 0.0, 0.0], || 0));
        assert!(!range.stalls(1e-3, &[2.0, 0.0, 0.0], || 0));
        assert!(range.stalls(5e-3, &[1.5, 0.0, 0.0], || 0), "and on its way back");
    }
}
