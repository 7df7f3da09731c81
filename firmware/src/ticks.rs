//! The ticker of the tasks that run once per tick of the vehicle: such tasks start together.

use embassy_time::{Duration, Instant, Ticker};
use model::sample::TICK_US;

/// A ticker with the period [`TICK_US`], whose ticks are whole multiples of it since boot, whenever the
/// ticker is made.
pub fn every_tick() -> Ticker {
    let period = Duration::from_micros(u64::from(TICK_US));
    let now = Instant::now().as_ticks();
    let mut ticker = Ticker::every(period);
    ticker.reset_at(Instant::from_ticks(now - now % period.as_ticks()));
    ticker
}
