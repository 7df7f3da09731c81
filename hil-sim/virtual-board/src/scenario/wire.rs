//! Faults of the link between operator and board: late, lost or reordered frames, and a program that
//! hangs.
//!
//! The faults act on whole frames, which end with a zero byte. Partial frames are assembled first.

use std::collections::VecDeque;

use firmware::protocol::frame::FRAME_MAX;
use plant::noise::Noise;
use serde::Deserialize;

use super::error::{ScenarioError, Within};

/// Delay of a frame that later frames overtake, in ms.
const OVERTAKEN_MS: u64 = 50;

/// Direction of a link fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WireDirection {
    /// Both directions.
    #[default]
    Both,
    /// From the operator to the board.
    ToBoard,
    /// From the board to the operator.
    ToHost,
}

/// The faults of one direction.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WireFault {
    /// Delay of every frame, ms.
    pub latency_ms: f64,
    /// Largest additional random delay, without reordering, ms.
    pub jitter_ms: f64,
    /// Share of the frames that are lost.
    pub loss: f64,
    /// Share of the frames that arrive twice.
    pub duplication: f64,
    /// Share of the frames that later frames overtake.
    pub reordering: f64,
}

/// A step that acts on the link.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum LinkStep {
    /// Sets the faults of the link from now on. Without any field, the link works again without
    /// faults.
    Link {
        /// The direction.
        #[serde(default)]
        direction: WireDirection,
        /// Delay of every frame, ms.
        #[serde(default)]
        latency_ms: f64,
        /// Largest additional random delay, ms.
        #[serde(default)]
        jitter_ms: f64,
        /// Share of the frames that are lost.
        #[serde(default)]
        loss: f64,
        /// Share of the frames that arrive twice.
        #[serde(default)]
        duplication: f64,
        /// Share of the frames that later frames overtake.
        #[serde(default)]
        reordering: f64,
    },
    /// The operator's program hangs and repeats its last drive command, byte for byte, or works again.
    StuckOperator {
        /// Whether the program hangs.
        stuck: bool,
    },
}

impl LinkStep {
    /// The names of the steps, as in files.
    pub const NAMES: [&'static str; 2] = ["link", "stuck-operator"];

    /// Checks every number.
    ///
    /// # Errors
    /// The error of `within` for the first number out of its range.
    pub fn check(&self, within: Within<'_>) -> Result<(), ScenarioError> {
        let Self::Link {
            latency_ms,
            jitter_ms,
            loss,
            duplication,
            reordering,
            ..
        } = *self
        else {
            return Ok(());
        };
        within("latency_ms", latency_ms, 0.0, 60_000.0)?;
        within("jitter_ms", jitter_ms, 0.0, 60_000.0)?;
        within("loss", loss, 0.0, 1.0)?;
        within("duplication", duplication, 0.0, 1.0)?;
        within("reordering", reordering, 0.0, 1.0)
    }
}

/// A frame in transit.
#[derive(Debug, Clone)]
struct UnderWay {
    due_ms: u64,
    bytes: Vec<u8>,
}

/// One direction of the link.
#[derive(Debug)]
pub struct FaultyWire {
    fault: WireFault,
    noise: Noise,
    /// The beginning of a frame whose end has not yet arrived.
    begun: Vec<u8>,
    /// Frames in transit, in order of their due times.
    under_way: VecDeque<UnderWay>,
    /// Due time of the last frame that keeps its order.
    last_due_ms: u64,
}

impl FaultyWire {
    /// A direction without faults, which draws later faults from `noise`.
    pub fn new(noise: Noise) -> Self {
        Self {
            fault: WireFault::default(),
            noise,
            begun: Vec::new(),
            under_way: VecDeque::new(),
            last_due_ms: 0,
        }
    }

    /// Sets the faults from now on. Frames in transit keep their due times.
    pub fn set_fault(&mut self, fault: WireFault) {
        self.fault = fault;
    }

    /// Whether bytes pass through unchanged and at once.
    fn is_clear(&self) -> bool {
        self.fault == WireFault::default() && self.under_way.is_empty() && self.begun.is_empty()
    }

    /// Accepts bytes at `now_ms` and returns the bytes that arrive at the other end.
    pub fn pass(&mut self, now_ms: u64, bytes: Vec<u8>) -> Vec<u8> {
        let idle = bytes.is_empty() && self.under_way.is_empty();
        if idle || self.is_clear() {
            return bytes;
        }
        for byte in bytes {
            self.begun.push(byte);
            if byte == 0 || self.begun.len() >= FRAME_MAX {
                let frame = std::mem::take(&mut self.begun);
                self.send(now_ms, &frame);
            }
        }
        self.arrived(now_ms)
    }

    /// Due time of the next frame.
    pub fn next_due_ms(&self) -> Option<u64> {
        self.under_way.front().map(|frame| frame.due_ms)
    }

    /// Draws whether an event with this share happens now. A share of 0 draws nothing.
    fn happens(&mut self, share: f64) -> bool {
        share > 0.0 && self.draw() < share
    }

    /// A number from 0 to 1.
    fn draw(&mut self) -> f64 {
        (self.noise.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn send(&mut self, now_ms: u64, bytes: &[u8]) {
        if self.happens(self.fault.loss) {
            return;
        }
        let jitter_ms = if self.fault.jitter_ms > 0.0 {
            self.fault.jitter_ms * self.draw()
        } else {
            0.0
        };
        let due_ms = now_ms + (self.fault.latency_ms + jitter_ms).round() as u64;
        let copies = if self.happens(self.fault.duplication) { 2 } else { 1 };
        for _ in 0..copies {
            let due_ms = if self.happens(self.fault.reordering) {
                due_ms + OVERTAKEN_MS
            } else {
                self.last_due_ms = due_ms.max(self.last_due_ms);
                self.last_due_ms
            };
            let place = self.under_way.partition_point(|frame| frame.due_ms <= due_ms);
            let bytes = bytes.to_vec();
            self.under_way.insert(place, UnderWay { due_ms, bytes });
        }
    }

    fn arrived(&mut self, now_ms: u64) -> Vec<u8> {
        let mut bytes = Vec::new();
        while let Some(frame) = self.under_way.pop_front_if(|frame| frame.due_ms <= now_ms) {
            bytes.extend(frame.bytes);
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends `frames` numbered frames, one every 10 ms. Returns the arrivals as (ms, number).
    fn flight(fault: WireFault, frames: u8) -> Vec<(u64, u8)> {
        let mut wire = FaultyWire::new(Noise::new(3, 0));
        wire.set_fault(fault);
        let mut arrived = Vec::new();
        for ms in 0..u64::from(frames) * 10 + 5000 {
            let sent = if ms % 10 == 0 && ms / 10 < u64::from(frames) {
                vec![(ms / 10) as u8 + 1, 0]
            } else {
                Vec::new()
            };
            let out = wire.pass(ms, sent);
            arrived.extend(out.chunks(2).map(|frame| (ms, frame[0])));
        }
        assert!(wire.is_clear() || fault != WireFault::default());
        arrived
    }

    #[test]
    fn a_clear_way_changes_nothing_and_draws_nothing() {
        let mut wire = FaultyWire::new(Noise::new(1, 0));
        for part in [vec![1, 2], vec![], vec![3, 0, 4]] {
            assert_eq!(wire.pass(0, part.clone()), part);
        }
        assert_eq!(wire.next_due_ms(), None);
        assert_eq!(wire.noise.bits(), Noise::new(1, 0).bits());
    }

    #[test]
    fn latency_delays_and_jitter_keeps_the_order() {
        let late = flight(
            WireFault {
                latency_ms: 300.0,
                ..WireFault::default()
            },
            50,
        );
        assert!(
            late.iter()
                .enumerate()
                .all(|(i, frame)| *frame == (10 * i as u64 + 300, i as u8 + 1))
        );
        assert_eq!(late.len(), 50);
        let fault = WireFault {
            latency_ms: 20.0,
            jitter_ms: 100.0,
            ..WireFault::default()
        };
        let shaken = flight(fault, 200);
        assert!(shaken.windows(2).all(|pair| pair[0].1 < pair[1].1));
        let delays: Vec<u64> = shaken.iter().map(|(ms, n)| ms - 10 * (u64::from(*n) - 1)).collect();
        assert!(delays.iter().all(|delay| (20..=120).contains(delay)) && delays.len() == 200);
        assert!(delays.iter().min() < Some(&60) && delays.iter().max() > Some(&100));
        assert_eq!(shaken, flight(fault, 200), "from the seed alone");
    }

    #[test]
    fn shares_of_the_frames_are_lost_doubled_and_overtaken() {
        let fault = |loss, duplication, reordering| WireFault {
            loss,
            duplication,
            reordering,
            ..WireFault::default()
        };
        // Three standard deviations of 250 draws of 0.3: 22.
        let lost = 250 - flight(fault(0.3, 0.0, 0.0), 250).len();
        assert!((53..98).contains(&lost), "{lost}");
        let doubled = flight(fault(0.0, 0.3, 0.0), 250).len() - 250;
        assert!((53..98).contains(&doubled), "{doubled}");
        let mixed = flight(fault(0.0, 0.0, 0.3), 250);
        let overtaken = mixed.windows(2).filter(|pair| pair[0].1 > pair[1].1).count();
        assert!(mixed.len() == 250 && overtaken > 30, "{overtaken}");
        assert!(flight(fault(1.0, 1.0, 1.0), 250).is_empty());
    }

    #[test]
    fn frames_in_parts_stay_whole() {
        let mut wire = FaultyWire::new(Noise::new(1, 0));
        wire.set_fault(WireFault {
            latency_ms: 5.0,
            ..WireFault::default()
        });
        assert!(wire.pass(0, vec![1, 2]).is_empty());
        assert_eq!(wire.next_due_ms(), None);
        assert!(wire.pass(3, vec![3, 0, 7]).is_empty());
        assert_eq!(wire.next_due_ms(), Some(8));
        assert_eq!(wire.pass(8, vec![0]), vec![1, 2, 3, 0]);
        wire.set_fault(WireFault::default());
        assert_eq!(wire.pass(20, vec![9, 0]), vec![7, 0, 9, 0]);
        assert!(wire.is_clear());
    }
}
