//! Incremental encoders on the motor shafts, behind the gearboxes.
//!
//! An encoder counts the turns of its motor's shaft, so its count is the joint's angle times the gear
//! ratio: wheel relative to arm (theta + phi), or ballast relative to spar. No encoder measures theta
//! alone.

use core::f64::consts::TAU;

use super::fault::{DELAY_MS, SensorFault};
use super::noise::Noise;

/// Samples kept for [`SensorFault::Delayed`]: one per millisecond.
const DELAYED_COUNTS: usize = DELAY_MS as usize;

/// A quadrature encoder and the counter behind it.
#[derive(Debug, Clone)]
pub struct Encoder {
    counts_per_rad: f64,
    /// Counts through which the disc has turned since the start.
    truth: i64,
    /// Counts that the counter has registered.
    counted: i64,
    fault: SensorFault,
    law: CountLaw,
    /// Edges seen; only every second edge is counted ([`SensorFault::Slow`]).
    half_edges: i64,
    history: [i64; DELAYED_COUNTS],
    /// Index of the oldest entry of the history. The others follow it and wrap at the end.
    oldest: usize,
    history_ms: u64,
    /// Time of the last advance.
    time_s: f64,
    noise: Noise,
}

/// How the counter registers edges.
#[derive(Debug, Clone, Copy, PartialEq)]
enum CountLaw {
    /// According to the fault.
    Fault(SensorFault),
    /// The counter loses this share of the edges.
    Lossy(f64),
}

impl Encoder {
    /// An encoder with `counts_per_rev` counts per turn of the motor, before a gearbox of ratio
    /// `gear_ratio`.
    pub fn new(counts_per_rev: f64, gear_ratio: f64, noise: Noise) -> Self {
        Self {
            counts_per_rad: counts_per_rev * gear_ratio / TAU,
            truth: 0,
            counted: 0,
            fault: SensorFault::None,
            law: CountLaw::Fault(SensorFault::None),
            half_edges: 0,
            history: [0; DELAYED_COUNTS],
            oldest: 0,
            history_ms: 0,
            time_s: 0.0,
            noise,
        }
    }

    /// Counts per rad of the joint.
    pub fn counts_per_rad(&self) -> f64 {
        self.counts_per_rad
    }

    /// Makes the encoder fail, or repairs it ([`SensorFault::None`]). Lost counts stay lost.
    pub fn set_fault(&mut self, fault: SensorFault) {
        self.fault = fault;
        self.law = CountLaw::Fault(fault);
        self.half_edges = 0;
        self.history = [self.counted; DELAYED_COUNTS];
        self.history_ms = self.time_ms();
    }

    /// Makes the encoder lose this share of its edges from now on (0 to 1), as with a worn disc or a weak
    /// receiver. Replaces any other fault.
    pub fn set_edge_loss(&mut self, share: f64) {
        self.set_fault(SensorFault::None);
        if share > 0.0 {
            self.law = CountLaw::Lossy(share);
        }
    }

    /// The present fault.
    pub fn fault(&self) -> SensorFault {
        self.fault
    }

    /// The millisecond of the last advance. A nanosecond of slack allows for the rounding of the steps.
    fn time_ms(&self) -> u64 {
        (self.time_s * 1e3 + 1e-6) as u64
    }

    /// Follows the joint to `angle_rad` at `time_s` (called at least once a millisecond).
    #[inline]
    pub fn advance(&mut self, angle_rad: f64, time_s: f64) {
        self.time_s = time_s;
        let counts = angle_rad * self.counts_per_rad;
        // Rounds towards minus infinity without a function call.
        let cut = counts as i64;
        // The count of a shaft beyond every range wraps; the plant reports that case elsewhere.
        let truth = cut.wrapping_sub(i64::from(cut as f64 > counts));
        let edges = truth.wrapping_sub(self.truth);
        self.truth = truth;
        match self.law {
            CountLaw::Fault(SensorFault::None | SensorFault::Delayed | SensorFault::NoForce) => {
                self.counted = self.counted.wrapping_add(edges);
            }
            CountLaw::Lossy(share) => self.counted += self.kept(edges, share),
            CountLaw::Fault(SensorFault::WrongSign) => self.counted -= edges,
            CountLaw::Fault(SensorFault::Slow) => {
                self.half_edges += edges;
                self.counted += self.half_edges / 2;
                self.half_edges %= 2;
            }
            // With one dead channel, the other channel's edges move the counter back and forth by one.
            CountLaw::Fault(SensorFault::Stuck) => self.counted += edges.rem_euclid(2) * (1 - 2 * truth.rem_euclid(2)),
            CountLaw::Fault(SensorFault::Garbage) => self.counted += i64::from((self.noise.bits() >> 52) as i16) - 2048,
            CountLaw::Fault(SensorFault::Off) => {}
            CountLaw::Fault(SensorFault::Intermittent) => {
                if !self.fault.is_dead_at(self.time_ms()) {
                    self.counted += edges;
                }
            }
        }
        // A fault starts with its own history, so no history is kept without the fault.
        if self.fault == SensorFault::Delayed {
            self.remember();
        }
    }

    /// Stores the count once per millisecond.
    fn remember(&mut self) {
        let time_ms = self.time_ms();
        if time_ms > self.history_ms {
            self.history_ms = time_ms;
            self.oldest = (self.oldest + 1) % DELAYED_COUNTS;
            // The newest count replaces the oldest.
            self.history[(self.oldest + DELAYED_COUNTS - 1) % DELAYED_COUNTS] = self.counted;
        }
    }

    /// The number of `edges` that a lossy encoder counts: the lost share is drawn so that the mean is
    /// exact.
    fn kept(&mut self, edges: i64, share: f64) -> i64 {
        let draw = (self.noise.bits() >> 11) as f64 / (1_u64 << 53) as f64;
        // Rounds randomly to whole edges, so that the mean is exact.
        let now = (share * edges.unsigned_abs() as f64 + draw) as u64;
        edges.signum() * (edges.unsigned_abs() - now).cast_signed()
    }

    /// What the counter has counted, faults included, before it wraps.
    pub fn counted(&self) -> i64 {
        match self.fault {
            SensorFault::Delayed => self.history[self.oldest],
            _ => self.counted,
        }
    }

    /// The counter as the board reads it: 16 bits, wrapping.
    pub fn counter(&self) -> u16 {
        self.counted() as u16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoder() -> Encoder {
        Encoder::new(1024.0, 43.0, Noise::new(1, 0))
    }

    /// Turns the joint at a constant rate for 200 ms and returns the counts.
    fn turn(encoder: &mut Encoder, from_ms: u64, rate_counts_per_ms: f64) -> i64 {
        let before = encoder.counted();
        for ms in from_ms + 1..=from_ms + 200 {
            let angle = rate_counts_per_ms * ms as f64 / encoder.counts_per_rad();
            encoder.advance(angle + 1e-9, ms as f64 * 1e-3);
        }
        encoder.counted() - before
    }

    #[test]
    fn one_turn_of_the_wheel_is_the_gear_ratio_in_turns_of_the_motor() {
        let mut e = encoder();
        e.advance(TAU + 1e-9, 1e-3);
        assert_eq!(e.truth, 1024 * 43);
        assert_eq!(e.counter(), 1024 * 43);
        e.advance(-1.5 / e.counts_per_rad(), 2e-3);
        assert_eq!(
            e.counted(),
            -2,
            "quantisation is towards minus infinity on both sides of zero"
        );
        assert_eq!(e.counter(), 65534, "and wraps downwards");
    }

    #[test]
    fn each_fault_counts_as_it_must() {
        use SensorFault as F;
        let counts = |fault| {
            let mut e = encoder();
            e.set_fault(fault);
            turn(&mut e, 0, 10.0)
        };
        assert_eq!(counts(F::None), 2000);
        assert_eq!(counts(F::Off), 0);
        assert!(counts(F::Stuck).abs() <= 1);
        assert_eq!(counts(F::WrongSign), -2000);
        assert_eq!(counts(F::Slow), 1000);
        assert_eq!(counts(F::Delayed), 2000 - 10 * (i64::from(DELAY_MS) - 1));
        assert_eq!(counts(F::Intermittent), 1000);
        let garbage = counts(F::Garbage);
        assert!(garbage.abs() > 2000 && garbage.abs() < 200 * 2048, "{garbage}");
    }

    #[test]
    fn a_lossy_encoder_loses_its_share_at_any_speed_and_either_way() {
        for share in [0.01, 0.25, 0.9, 1.0] {
            for rate in [0.3, 10.0, -300.0] {
                let mut e = encoder();
                e.set_edge_loss(share);
                let mut steps = Vec::new();
                for round in 0..20 {
                    let before = e.counted();
                    turn(&mut e, 200 * round, rate);
                    steps.push(e.counted() - before);
                }
                let expected = (1.0 - share) * rate * 4000.0;
                let found = e.counted() as f64;
                // Four standard deviations of 4000 roundings of at most half a count each.
                assert!(
                    (found - expected).abs() <= 4.0 * 0.5 * 4000.0_f64.sqrt(),
                    "{share} at {rate}: {found} of {expected}"
                );
                if share == 0.25 && rate == 10.0 {
                    assert!(steps.iter().any(|step| *step != steps[0]), "lost at random: {steps:?}");
                }
            }
        }
        let mut e = encoder();
        e.set_edge_loss(0.5);
        e.set_edge_loss(0.0);
        assert_eq!(turn(&mut e, 0, 10.0), 2000, "and none once it is repaired");
    }

    #[test]
    fn a_repaired_encoder_counts_on_from_what_it_had() {
        let mut e = encoder();
        turn(&mut e, 0, 10.0);
        e.set_fault(SensorFault::Off);
        turn(&mut e, 200, 10.0);
        e.set_fault(SensorFault::None);
        assert_eq!(turn(&mut e, 400, 10.0), 2000);
        assert_eq!((e.counted(), e.truth), (4000, 6000));
    }
}
