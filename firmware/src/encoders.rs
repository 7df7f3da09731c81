//! Encoder counts: the hardware counters, extended to 64 bits.

use model::sample::MOTORS;

use crate::hardware::EncoderCounters;

/// Extends a wrapping 16-bit counter to 64 bits. The result is right as long as the counter moves by less
/// than 32768 counts between two calls.
///
/// ```
/// use firmware::encoders::CountExtender;
/// let mut extender = CountExtender::default();
/// assert_eq!(extender.extend(65_000), 0); // the first reading is the origin
/// assert_eq!(extender.extend(100), 636); // over the wrap
/// assert_eq!(extender.extend(64_900), -100); // and back
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CountExtender {
    last: Option<u16>,
    total: i64,
}

impl CountExtender {
    /// Processes a reading of the counter and returns the counts since the first reading.
    pub fn extend(&mut self, counter: u16) -> i64 {
        let moved = self.last.map_or(0, |last| counter.wrapping_sub(last).cast_signed());
        self.last = Some(counter);
        self.total = self.total.wrapping_add(i64::from(moved));
        self.total
    }
}

/// The counters of every motor's encoder. The control task reads them in its own tick, so the age of the counts
/// follows from the design and not from the order in which tasks run.
#[derive(Debug)]
pub struct Encoders<E> {
    counters: E,
    extenders: [CountExtender; MOTORS],
}

impl<E: EncoderCounters> Encoders<E> {
    /// The encoders behind `counters`.
    pub fn new(counters: E) -> Self {
        Self {
            counters,
            extenders: [CountExtender::default(); MOTORS],
        }
    }

    /// The present counts since the first reading.
    pub fn counts(&mut self) -> [i64; MOTORS] {
        let mut counts = [0; MOTORS];
        let raw = self.counters.counts();
        for ((count, extender), raw) in counts.iter_mut().zip(&mut self.extenders).zip(raw) {
            *count = extender.extend(raw);
        }
        counts
    }
}
