//! What a bridge timer drives onto its channels over time, computed from its registers: when each line is high within
//! a period, and when the timer triggers the converter.
//!
//! The part's model of a timer gives a pulse's width only for a counter with one direction, and does not keep its
//! earlier phase in the period. The bridge timers count up and down, and the currents ripple in step with them.

use serde::{Deserialize, Serialize};

/// Compare channels of an advanced timer: four with pins, two without.
pub const PWM_CHANNELS: usize = 6;

const NS_PER_S: u128 = 1_000_000_000;

/// Registers of a timer that shape the waveform.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[allow(clippy::struct_excessive_bools)] // These are bits of registers, not the states of one thing.
pub struct PwmShape {
    /// Whether the counter runs.
    pub runs: bool,
    /// Whether the end of a period loads no values.
    pub held: bool,
    /// Whether the counter counts up and down, and not only up.
    pub up_and_down: bool,
    /// Prescaler.
    pub prescaler: u64,
    /// Largest count.
    pub top: u64,
    /// Counter turns between two loads that load no values.
    pub skipped: u64,
    /// Compare values as written.
    pub compare: [u64; PWM_CHANNELS],
    /// Whether a write of the compare value waits for the next load.
    pub preloaded: [bool; PWM_CHANNELS],
    /// Whether the channel's reference is high while the counter is below the compare value (PWM mode 1).
    pub high_below: [bool; PWM_CHANNELS],
    /// Whether the reference of the sixth channel is the timer's second trigger output.
    pub triggers: bool,
    /// Whether the outputs are enabled.
    pub enabled: bool,
}

/// A timer's waveform.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct PwmWaveform {
    clock_hz: u64,
    shape: PwmShape,
    /// Compare values in force.
    compare: [u64; PWM_CHANNELS],
    /// While the counter runs: the instant at which it started from zero, in ns.
    started: Option<u64>,
    /// The instant up to which loads have been applied, in ns.
    seen: u64,
}

impl PwmWaveform {
    /// Changes the timer's clock.
    pub fn set_clock(&mut self, hz: u64) {
        self.clock_hz = hz;
    }

    /// Applies the loads up to an instant, before a register changes or the waveform is read.
    pub fn catch_up(&mut self, now: u64) {
        if let Some(started) = self.started
            && !self.shape.held
            && self.loads_by(started, now) > self.loads_by(started, self.seen)
        {
            self.compare = self.shape.compare;
        }
        self.seen = now;
    }

    /// Changes the registers' values. `restarted`: software started a new period, with the values as written.
    pub fn reshape(&mut self, now: u64, shape: PwmShape, restarted: bool) {
        self.catch_up(now);
        let ran = self.started.is_some();
        self.shape = shape;
        for channel in 0..PWM_CHANNELS {
            if restarted || !shape.preloaded[channel] {
                self.compare[channel] = shape.compare[channel];
            }
        }
        if shape.runs != ran || restarted {
            self.started = shape.runs.then_some(now);
        }
    }

    /// Resets the timer: the counter stops, and the clock setting stays.
    pub fn stop(&mut self) {
        *self = Self {
            clock_hz: self.clock_hz,
            ..Self::default()
        };
    }

    /// The instant up to which loads have been applied, in ns.
    pub fn seen(&self) -> u64 {
        self.seen
    }

    /// The shape as the registers last had it.
    pub fn shape(&self) -> &PwmShape {
        &self.shape
    }

    /// Length of a period in counts.
    fn period_counts(&self) -> u64 {
        if self.shape.up_and_down {
            2 * self.shape.top
        } else {
            self.shape.top + 1
        }
    }

    fn ns(&self, counts: u64) -> u64 {
        let clocks = u128::from(counts) * (u128::from(self.shape.prescaler) + 1);
        (clocks * NS_PER_S / u128::from(self.clock_hz.max(1))) as u64
    }

    /// The period in ns, while the counter runs.
    pub fn period_ns(&self) -> Option<u64> {
        self.started?;
        let period = self.ns(self.period_counts());
        (period > 0).then_some(period)
    }

    /// Time per period for which a channel's line is high, in ns.
    pub fn high_ns(&self, channel: usize) -> Option<u64> {
        if !self.shape.high_below[channel] {
            return None;
        }
        let below = self.compare[channel];
        Some(if self.shape.up_and_down {
            self.ns(2 * below.min(self.shape.top))
        } else {
            self.ns(below.min(self.shape.top + 1))
        })
    }

    /// Time from the start of the period to an instant. The period of a counter that counts up and down starts at its
    /// zero.
    pub fn phase_ns(&self, at: u64) -> Option<u64> {
        Some(at.checked_sub(self.started?)? % self.period_ns()?)
    }

    /// Number of loads from the counter's start up to an instant, if nothing prevented a load.
    fn loads_by(&self, started: u64, at: u64) -> u64 {
        let turn = if self.shape.up_and_down {
            self.shape.top
        } else {
            self.shape.top + 1
        };
        let load_ns = self.ns(turn * (self.shape.skipped + 1));
        at.saturating_sub(started).checked_div(load_ns).unwrap_or(0)
    }

    /// The first instant after `after` at which the trigger rises.
    pub fn trigger_after(&self, after: u64) -> Option<u64> {
        let below = self.compare[PWM_CHANNELS - 1];
        if !self.shape.triggers || !self.shape.high_below[PWM_CHANNELS - 1] || below == 0 || below >= self.shape.top {
            return None;
        }
        let period = self.period_ns()?;
        let rises = if self.shape.up_and_down {
            period - self.ns(below)
        } else {
            0
        };
        let first = self.started? + rises;
        Some(first + (after + 1).saturating_sub(first).div_ceil(period) * period)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bridge timer at 200 MHz: 20 kHz, up and down.
    fn shape() -> PwmShape {
        PwmShape {
            runs: true,
            up_and_down: true,
            top: 5_000,
            skipped: 1,
            compare: [5_000, 2_500, 0, 1, 0, 240],
            preloaded: [true, true, true, true, false, false],
            high_below: [true; PWM_CHANNELS],
            triggers: true,
            ..PwmShape::default()
        }
    }

    fn waveform() -> PwmWaveform {
        let mut waveform = PwmWaveform::default();
        waveform.set_clock(200_000_000);
        waveform.reshape(0, PwmShape { runs: false, ..shape() }, true);
        waveform.reshape(1_000, shape(), false);
        waveform
    }

    #[test]
    fn a_line_is_high_for_twice_its_counts() {
        let waveform = waveform();
        assert_eq!(waveform.period_ns(), Some(50_000));
        let high: Vec<_> = (0..4).map(|channel| waveform.high_ns(channel)).collect();
        assert_eq!(high, [Some(50_000), Some(25_000), Some(0), Some(10)]);
        assert_eq!(waveform.phase_ns(1_000 + 3 * 50_000 + 7), Some(7));
    }

    #[test]
    fn values_load_at_the_end_of_a_period_unless_they_are_held() {
        let mut waveform = waveform();
        let changed = PwmShape {
            compare: [4_000, 5_000, 0, 0, 0, 240],
            ..shape()
        };
        waveform.reshape(31_000, PwmShape { held: true, ..changed }, false);
        waveform.catch_up(52_000);
        assert_eq!(waveform.high_ns(0), Some(50_000), "held");
        waveform.reshape(53_000, changed, false);
        waveform.catch_up(100_999);
        assert_eq!(waveform.high_ns(0), Some(50_000), "within the period");
        waveform.catch_up(101_000);
        assert_eq!(waveform.high_ns(0), Some(40_000));
    }

    #[test]
    fn the_trigger_rises_before_the_zero() {
        let mut waveform = waveform();
        let zero = |n: u64| 1_000 + n * 50_000;
        assert_eq!(waveform.trigger_after(0), Some(zero(1) - 1_200));
        assert_eq!(waveform.trigger_after(zero(1) - 1_201), Some(zero(1) - 1_200));
        assert_eq!(waveform.trigger_after(zero(1) - 1_200), Some(zero(2) - 1_200));
        for dead in [
            PwmShape {
                triggers: false,
                ..shape()
            },
            PwmShape { runs: false, ..shape() },
            PwmShape {
                compare: [0; PWM_CHANNELS],
                ..shape()
            },
        ] {
            waveform.reshape(zero(3), dead, false);
            assert_eq!(waveform.trigger_after(zero(3)), None, "{dead:?}");
        }
    }
}
