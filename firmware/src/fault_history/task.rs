//! The task of the fault history: reads the flash once, then adds every new fault to the RAM at once, and to the flash
//! when the vehicle is disarmed.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, with_timeout};
use embedded_storage_async::nor_flash::NorFlash;
use model::supervise::arming::Mode;

use super::store::FaultStore;
use crate::fault_list::{FAULTS_KEPT, FaultEntry, NewFaults};
use crate::topics::Topics;

/// Period at which the task checks whether the vehicle is disarmed, while there are faults to store.
const HISTORY_PERIOD: Duration = Duration::from_millis(20);

/// Keeps the faults for ever; `boot` is the number of this boot. Without a store the faults are kept in RAM only.
pub async fn run<M: RawMutex, F: NorFlash>(topics: &Topics<M>, mut store: Option<FaultStore<F>>, boot: u32) -> ! {
    let mut next = 0;
    if let Some(store) = &mut store {
        for entry in store.load().await {
            next = entry.number.wrapping_add(1);
            topics.faults.push(entry);
        }
    }
    let mut unstored: heapless::Deque<FaultEntry, FAULTS_KEPT> = heapless::Deque::new();
    loop {
        let new = if unstored.is_empty() {
            Some(topics.new_faults.receive().await)
        } else {
            with_timeout(HISTORY_PERIOD, topics.new_faults.receive()).await.ok()
        };
        if let Some(NewFaults { time_us, mode, faults }) = new {
            for fault in faults.iter() {
                let entry = FaultEntry {
                    number: next,
                    boot,
                    time_us,
                    mode,
                    fault: fault as u8,
                };
                next = next.wrapping_add(1);
                topics.faults.push(entry);
                if store.is_some() {
                    if unstored.is_full() {
                        unstored.pop_front();
                    }
                    // There is room now.
                    let _ = unstored.push_back(entry);
                }
            }
        }
        if let Some(store) = &mut store
            && disarmed(topics)
            && let Some(entry) = unstored.pop_front()
            && store.store(&entry).await.is_err()
        {
            warning!("fault history: not stored, the flash failed");
        }
    }
}

/// Whether every bridge is open: before the first tick, too.
fn disarmed<M: RawMutex>(topics: &Topics<M>) -> bool {
    topics
        .status
        .latest()
        .is_none_or(|status| status.value.mode == Mode::Disarmed)
}

#[cfg(test)]
mod tests {
    use embassy_sync::blocking_mutex::raw::NoopRawMutex;
    use embassy_time::Instant;
    use model::status::Status;

    use super::*;

    /// Erasing the flash takes a second of the bus that the code runs from: never while a motor may turn.
    #[test]
    fn the_flash_is_written_only_while_disarmed() {
        let topics = std::boxed::Box::new(Topics::<NoopRawMutex>::new());
        assert!(disarmed(&topics), "before the first tick every bridge is open");
        for (mode, allowed) in [(Mode::Disarmed, true), (Mode::Armed, false), (Mode::Stopping, false)] {
            let status = Status {
                mode,
                ..Status::default()
            };
            topics.status.publish(Instant::from_micros(1), status);
            assert_eq!(disarmed(&topics), allowed, "{mode:?}");
        }
    }
}
