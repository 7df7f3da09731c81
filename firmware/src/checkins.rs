//! Tracks which tasks are alive: each critical task checks in, and the watchdog's task checks them.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant};

/// A task that must stay alive, and how long it may be silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum CriticalTask {
    /// The control task.
    Drive = 0,
    /// The task of the arm IMU, which checks in even while the IMU is silent.
    ArmImu = 1,
    /// The task of the analogue inputs.
    Analog = 2,
    /// The sending task of the link, which stands for everything on the thread executor.
    Link = 3,
}

/// Number of critical tasks.
const TASKS: usize = 4;
/// Longest silence of a task that counts as alive, in the order of [`CriticalTask`]. The tasks of the thread
/// executor wait for each other, so their silences are longer.
const SILENCE: [Duration; TASKS] = [
    Duration::from_millis(10),
    Duration::from_millis(100),
    Duration::from_millis(100),
    Duration::from_millis(1000),
];
/// Time since boot by which every task must have checked in for the first time.
const START_UP: Duration = Duration::from_millis(1000);

/// When each critical task last checked in.
#[derive(Debug)]
pub struct Checkins<M: RawMutex> {
    last: Mutex<M, Cell<[Option<Instant>; TASKS]>>,
}

impl<M: RawMutex> Checkins<M> {
    /// No task has checked in yet.
    pub const fn new() -> Self {
        Self {
            last: Mutex::new(Cell::new([None; TASKS])),
        }
    }

    /// Records that `task` is alive now.
    pub fn check_in(&self, task: CriticalTask) {
        let now = Instant::now();
        self.last.lock(|cell| {
            if let Some(slot) = cell.as_array_of_cells().get(task as usize) {
                slot.set(Some(now));
            }
        });
    }

    /// Whether every task has checked in recently enough at `now`.
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

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_sync::blocking_mutex::raw::NoopRawMutex;

    /// The tasks with the silences that docs/safety.md allows them, us.
    const ALLOWED_US: [(CriticalTask, u64); TASKS] = [
        (CriticalTask::Drive, 10_000),
        (CriticalTask::ArmImu, 100_000),
        (CriticalTask::Analog, 100_000),
        (CriticalTask::Link, 1_000_000),
    ];
    /// By when each must have checked in first, us.
    const START_UP_US: u64 = 1_000_000;

    fn checkins(last_us: [Option<u64>; TASKS]) -> Checkins<NoopRawMutex> {
        let checkins = Checkins::new();
        checkins
            .last
            .lock(|cell| cell.set(last_us.map(|us| us.map(Instant::from_micros))));
        checkins
    }

    #[test]
    fn each_task_may_be_silent_for_its_own_time_and_no_longer() {
        let now_us = 5_000_000;
        for (task, silence_us) in ALLOWED_US {
            for (silent_us, alive) in [(silence_us, true), (silence_us + 1, false)] {
                let mut last_us = [Some(now_us); TASKS];
                last_us[task as usize] = Some(now_us - silent_us);
                let found = checkins(last_us).all_alive(Instant::from_micros(now_us));
                assert_eq!(found, alive, "{task:?} silent for {silent_us} us");
            }
        }
    }

    #[test]
    fn each_task_has_its_time_to_start() {
        for (task, _) in ALLOWED_US {
            for (now_us, alive) in [(START_UP_US, true), (START_UP_US + 1, false)] {
                let mut last_us = [Some(now_us); TASKS];
                last_us[task as usize] = None;
                let found = checkins(last_us).all_alive(Instant::from_micros(now_us));
                assert_eq!(found, alive, "{task:?} not yet there at {now_us} us");
            }
        }
    }
}
