//! Tickers that tick at whole multiples of their period, so that the tasks of one tick start together.

use embassy_time::{Duration, Instant, Ticker};

/// A ticker of `period` whose ticks are multiples of it since boot, whenever it is made.
pub fn aligned(period: Duration) -> Ticker {
    let now = Instant::now().as_ticks();
    let period_ticks = period.as_ticks().max(1);
    let mut ticker = Ticker::every(period);
    ticker.reset_at(Instant::from_ticks(now - now % period_ticks));
    ticker
}
