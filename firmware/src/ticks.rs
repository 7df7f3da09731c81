//! When the periodic tasks run: at the ticks of the vehicle, or halfway between them.

use core::future::poll_fn;
use core::pin::{Pin, pin};
use core::task::{Context, Poll};

use embassy_time::{Duration, Instant, Ticker};
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

/// Waits for the next tick.
pub async fn next_tick(ticker: &mut Ticker) {
    let mut next = pin!(ticker.next());
    poll_fn(|context| poll_next_tick(next.as_mut(), context)).await;
}

/// What lies behind it are the assertions of the timer on times beyond 500,000 years: `.ci/check-panics` knows them by this
/// name.
#[inline(never)]
fn poll_next_tick(next: Pin<&mut impl Future<Output = ()>>, context: &mut Context<'_>) -> Poll<()> {
    next.poll(context)
}

/// A ticker that runs half a period after [`every_tick`]'s.
pub fn between_ticks() -> Ticker {
    let mut ticker = Ticker::every(TICK);
    ticker.reset_at(Instant::from_ticks(
        tick_of(Instant::now()).as_ticks() + TICK.as_ticks() / 2,
    ));
    ticker
}
