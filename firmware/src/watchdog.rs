//! The hardware watchdog is fed only while every critical task is alive.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, Ticker};

use crate::hardware::Watchdog;
use crate::topics::Topics;

/// A task that must stay alive, and how long it may be silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum Critical {
    /// The control task.
    Drive = 0,
    /// The encoder task.
    Encoders = 1,
    /// The arm IMU's task (alive even while the IMU is not).
    ArmImu = 2,
    /// The analogue inputs' task.
    Analog = 3,
    /// The link's sending task, for everything on the thread executor.
    Link = 4,
}

/// Number of critical tasks.
const TASKS: usize = 5;
/// Silence after which a task is dead, in order of [`Critical`]. The thread executor's tasks may wait
/// for each other, so they get longer.
const SILENCE: [Duration; TASKS] = [
    Duration::from_millis(10),
    Duration::from_millis(10),
    Duration::from_millis(100),
    Duration::from_millis(100),
    Duration::from_millis(1000),
];
/// Every task must have checked in for the first time by then.
const START_UP: Duration = Duration::from_millis(1000);
const PERIOD: Duration = Duration::from_millis(5);

/// When each critical task was last alive.
#[derive(Debug)]
pub struct Checkins<M: RawMutex> {
    last: Mutex<M, Cell<[Option<Instant>; TASKS]>>,
}

impl<M: RawMutex> Checkins<M> {
    /// Nobody yet.
    pub const fn new() -> Self {
        Self {
            last: Mutex::new(Cell::new([None; TASKS])),
        }
    }

    /// The task is alive now.
    pub fn check_in(&self, task: Critical) {
        let now = Instant::now();
        self.last.lock(|cell| {
            let mut last = cell.get();
            if let Some(slot) = last.get_mut(task as usize) {
                *slot = Some(now);
            }
            cell.set(last);
        });
    }

    /// Whether every task has been alive recently enough at `now`.
    pub fn all_alive(&self, now: Instant) -> bool {
        let last = self.last.lock(Cell::get);
        last.iter().zip(SILENCE).all(|(last, silence)| match last {
            Some(last) => now.saturating_duration_since(*last) <= silence,
            None => now.as_ticks() <= START_UP.as_ticks(),
        })
    }
}

impl<M: RawMutex> Default for Checkins<M> {
    fn default() -> Self {
        Self::new()
    }
}

/// Feeds the watchdog while all critical tasks are alive. A dead one lets it bite.
pub async fn run<M: RawMutex>(topics: &Topics<M>, mut watchdog: impl Watchdog) -> ! {
    let mut ticker = Ticker::every(PERIOD);
    loop {
        if topics.checkins.all_alive(Instant::now()) {
            watchdog.feed();
        }
        ticker.next().await;
    }
}
