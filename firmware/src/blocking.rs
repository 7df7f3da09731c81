//! Keeps the vehicle from arming while a task stores data.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, Timer};
use model::supervise::arming::Mode;
use model::supervise::codes::Blocker;

use crate::topics::Topics;

/// Longest time that the control task may take to report that arming is blocked.
const BLOCK_TIMEOUT: Duration = Duration::from_millis(20);

/// Whether the vehicle is kept from arming.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Withheld {
    /// The vehicle is disarmed and cannot be armed before the caller allows it.
    Yes,
    /// The vehicle is armed or makes a controlled stop, or no tick came in time.
    No,
}

/// Raises `blocker` through `raise`, and waits for the first tick after that. The caller lowers
/// the blocker again in either case.
pub async fn withhold<M: RawMutex>(topics: &Topics<M>, blocker: Blocker, raise: impl FnOnce()) -> Withheld {
    let since = Instant::now();
    raise();
    while Instant::now().saturating_duration_since(since) < BLOCK_TIMEOUT {
        if let Some(status) = topics.status.latest()
            && status.at > since
        {
            let t = status.value;
            return if t.mode == Mode::Disarmed && t.blockers.contains(blocker) {
                Withheld::Yes
            } else {
                Withheld::No
            };
        }
        Timer::after(Duration::from_millis(1)).await;
    }
    Withheld::No
}
