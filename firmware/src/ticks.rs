//! When the periodic tasks run: at the ticks of the vehicle, or halfway between them.

use embassy_time::{Duration, Instant, Ticker, Timer};
use model::sample::TICK_US;

/// The period of a tick.
pub const TICK: Duration = Duration::from_micros(TICK_US as u64);

/// The begin of the tick that is under way at `now`: a whole multiple of [`TICK`] since boot.
pub fn tick_of(now: Instant) -> Instant {
    Instant::from_ticks(now.as_ticks() - now.as_ticks() % TICK.as_ticks())
}

/// A ticker with the period [`TICK`], whose ticks are whole multiples of it since boot, whenever the
/// ticker is made.
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

    /// Waits for the next tick. A tick that is late is not left out.
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
