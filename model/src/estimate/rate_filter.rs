//! Angle and rate from a quantised counter.

/// The nearest `f32` to a count. Within 32 bits, as for every counter that is not broken, the conversion is one
/// instruction; the drive board's core has no instruction for 64 bits.
#[inline]
pub fn nearest(counts: i64) -> f32 {
    match i32::try_from(counts) {
        Ok(counts) => counts as f32,
        Err(_) => wide(counts),
    }
}

// Not inlined: otherwise the compiler computes this value for every count and then discards it.
#[cold]
#[inline(never)]
fn wide(counts: i64) -> f32 {
    counts as f32
}

/// A critically damped second-order tracking filter on encoder counts.
///
/// Both poles of the error lie at `exp(-dt / tau)`. The filter stores its position relative to the newest
/// count, so its resolution does not decrease as the count grows.
///
/// ```
/// use model::estimate::rate_filter::RateFilter;
/// let mut filter = RateFilter::new(0.001, 0.004);
/// for k in 0..200 {
///     filter.update(3 * k);
/// }
/// // Three counts per millisecond.
/// assert!((filter.rate_per_s() - 3000.0).abs() < 0.5);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateFilter {
    dt_s: f32,
    position_gain: f32,
    rate_gain_per_s: f32,
    last: Option<i64>,
    /// Estimated position minus the newest count, in counts.
    lead: f32,
    rate_per_s: f32,
}

impl RateFilter {
    /// A filter called every `dt_s` seconds with the time constant `tau_s`; both > 0.
    pub fn new(dt_s: f32, tau_s: f32) -> Self {
        let pole = libm::expf(-dt_s / tau_s);
        Self {
            dt_s,
            position_gain: 1.0 - pole * pole,
            rate_gain_per_s: (1.0 - pole) * (1.0 - pole) / dt_s,
            last: None,
            lead: 0.0,
            rate_per_s: 0.0,
        }
    }

    /// Updates the filter with the newest count.
    pub fn update(&mut self, count: i64) {
        // If the 64-bit count wraps, the difference wraps too, so no sum can overflow.
        let moved = nearest(self.last.map_or(0, |last| count.wrapping_sub(last)));
        self.last = Some(count);
        let predicted = self.lead + self.rate_per_s * self.dt_s;
        let error = moved - predicted;
        self.lead = (self.position_gain - 1.0) * error;
        self.rate_per_s += self.rate_gain_per_s * error;
    }

    /// Estimated rate in counts per second.
    pub fn rate_per_s(&self) -> f32 {
        self.rate_per_s
    }
}

/// A first-order low-pass filter that also returns the derivative of its input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowPass {
    gain: f32,
    derivative_gain_per_s: f32,
    value: f32,
}

impl LowPass {
    /// A filter called every `dt_s` seconds with the time constant `tau_s`; both > 0.
    pub fn new(dt_s: f32, tau_s: f32) -> Self {
        let gain = 1.0 - libm::expf(-dt_s / tau_s);
        Self {
            gain,
            derivative_gain_per_s: gain / dt_s,
            value: 0.0,
        }
    }

    /// Sets the filtered value.
    pub fn reset(&mut self, value: f32) {
        self.value = value;
    }

    /// Updates the filter with the newest input and returns the input's filtered derivative, per second.
    pub fn update(&mut self, input: f32) -> f32 {
        let ahead = input - self.value;
        self.value += self.gain * ahead;
        ahead * self.derivative_gain_per_s
    }

    /// The filtered value.
    pub fn value(&self) -> f32 {
        self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `as` is the oracle: it rounds to the nearest, halves to even.
    #[test]
    fn counts_become_the_nearest_number_whatever_their_size() {
        for magnitude in [
            0,
            1,
            16_777_217,
            16_777_219,
            i64::from(i32::MAX),
            2_147_483_777,
            1 << 53,
            i64::MAX,
        ] {
            for counts in [magnitude, -magnitude, -magnitude - 1] {
                assert_eq!(nearest(counts).to_bits(), (counts as f32).to_bits(), "{counts}");
            }
        }
    }

    #[test]
    fn the_rate_of_a_ramp_is_exact_wherever_the_count_starts() {
        for start in [0, 1 << 40, i64::MAX - 1000, -(1 << 50)] {
            let mut filter = RateFilter::new(0.001, 0.004);
            for k in 0..300_i64 {
                filter.update(start.wrapping_add(7 * k));
            }
            assert!(
                (filter.rate_per_s() - 7000.0).abs() < 0.5,
                "{start}: {}",
                filter.rate_per_s()
            );
        }
    }

    #[test]
    fn a_step_of_rate_is_followed_within_six_time_constants_and_not_at_once() {
        let mut filter = RateFilter::new(0.001, 0.004);
        let mut count = 0;
        let mut rates = [0.0; 30];
        for rate in &mut rates {
            count += 100;
            filter.update(count);
            *rate = filter.rate_per_s();
        }
        assert!(rates[1] < 30_000.0 && rates[1] > 1_000.0, "{}", rates[1]);
        assert!((rates[24] - 100_000.0).abs() < 2_000.0, "{}", rates[24]);
        // The filter is critically damped in position, so the rate overshoots by at most e^-2.
        assert!(rates.iter().all(|r| *r < 115_000.0));
    }

    #[test]
    fn the_low_pass_gives_the_derivative_of_a_ramp() {
        let mut filter = LowPass::new(0.001, 0.05);
        let mut derivative = 0.0;
        for k in 0..1000 {
            derivative = filter.update(0.002 * k as f32);
        }
        assert!((derivative - 2.0).abs() < 0.02, "{derivative}");
        assert!(
            (filter.value() - (0.002 * 999.0 - 0.1)).abs() < 0.002,
            "{}",
            filter.value()
        );
    }
}
