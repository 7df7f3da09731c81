//! The watchdog's task: feeds the hardware watchdog only while every critical task is alive.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, Ticker};

use crate::hardware::Watchdog;
use crate::topics::Topics;

const FEED_PERIOD: Duration = Duration::from_millis(5);

/// Feeds the watchdog while all critical tasks are alive. Once a task is dead, the watchdog resets the part.
pub async fn run<M: RawMutex>(topics: &Topics<M>, mut watchdog: impl Watchdog) -> ! {
    let mut ticker = Ticker::every(FEED_PERIOD);
    loop {
        if topics.checkins.all_alive(Instant::now()) {
            watchdog.feed();
        }
        ticker.next().await;
    }
}
