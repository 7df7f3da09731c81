//! The encoder task: extends the hardware counters to 64 bits and publishes the counts once per tick.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::Instant;
use model::sample::MOTORS;

use crate::checkins::Critical;
use crate::hardware::EncoderCounters;
use crate::ticks::every_tick;
use crate::topics::Topics;

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
    /// Takes a reading of the counter; returns the counts since the first reading.
    pub fn extend(&mut self, counter: u16) -> i64 {
        let moved = self.last.map_or(0, |last| counter.wrapping_sub(last).cast_signed());
        self.last = Some(counter);
        self.total = self.total.wrapping_add(i64::from(moved));
        self.total
    }
}

/// Reads the counters every tick and publishes the counts.
pub async fn run<M: RawMutex>(topics: &Topics<M>, mut counters: impl EncoderCounters) -> ! {
    let mut extenders = [CountExtender::default(); MOTORS];
    let mut ticker = every_tick();
    loop {
        ticker.next().await;
        let at = Instant::now();
        let raw = counters.counts();
        let mut counts = [0; MOTORS];
        for ((count, extender), raw) in counts.iter_mut().zip(&mut extenders).zip(raw) {
            *count = extender.extend(raw);
        }
        topics.encoders.publish(at, counts);
        topics.checkins.check_in(Critical::Encoders);
    }
}
