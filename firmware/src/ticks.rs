//! The times at which the periodic tasks run: at the vehicle's ticks, or halfway between them.

use embassy_time::{Duration, Instant, Ticker, Timer};
use model::sample::TICK_US;

/// The period of a tick.
pub const TICK: Duration = Duration::from_micros(TICK_US as u64);

/// The beginning of the present tick at `now`: a whole multiple of [`TICK`] since boot.
pub fn tick_of(now: Instant) -> Instant {
    Instant::from_ticks(now.as_ticks() - now.as_ticks() % TICK.as_ticks())
}

/// A ticker with the period [`TICK`]. Its ticks are whole multiples of the period since boot,
/// whenever the ticker is created.
pub fn every_tick() -> Ticker {
    let mut ticker = Ticker::every(TICK);
    ticker.reset_at(tick_of(Instant::now()));
    ticker
}

/// The ticks of the vehicle, as [`every_tick`]'s, for the control task: nothing in it can panic, not even after 500,000 years.
pub struct Ticks {
    due: Instant,
}

impl Ticks {
    /// The ticks from now on.
    pub fn from_now() -> Self {
        Self {
            due: tick_of(Instant::now()),
        }
    }

    /// Waits for the next tick. A late tick is not skipped.
    pub async fn next(&mut self) {
        self.due = self.due.checked_add(TICK).unwrap_or(Instant::MAX);
        Timer::at(self.due).await;
    }
}

/// A ticker that runs half a period after [`every_tick`]'s.
pub fn between_ticks() -> Ticker {
    let mut ticker = Ticker::every(TICK);
    ticker.reset_at(Instant::from_ticks(
        tick_of(Instant::now()).as_ticks() + TICK.as_ticks() / 2,
    ));
    ticker
}
