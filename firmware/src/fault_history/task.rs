//! The task of the fault history: reads the flash once, then adds every new fault, in RAM at once and in flash when the
//! vehicle is disarmed.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Timer};
use embedded_storage_async::nor_flash::NorFlash;
use model::supervise::arming::Mode;

use super::store::FaultStore;
use crate::fault_list::{FaultEntry, NewFaults};
use crate::topics::Topics;

/// How often the task looks whether the vehicle is disarmed.
const PERIOD: Duration = Duration::from_millis(20);

/// Keeps the faults for ever; `boot` is the number of this boot. Without a store the faults are kept in RAM only.
pub async fn run<M: RawMutex, F: NorFlash>(topics: &Topics<M>, mut store: Option<FaultStore<F>>, boot: u32) -> ! {
    let mut next = 0;
    if let Some(store) = &mut store {
        for entry in store.load().await {
            next = entry.number.wrapping_add(1);
            topics.faults.push(entry);
        }
    }
    loop {
        let NewFaults { time_us, mode, faults } = topics.new_faults.receive().await;
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
            if let Some(store) = &mut store {
                until_disarmed(topics).await;
                if store.store(&entry).await.is_err() {
                    warning!("fault history: not stored, the flash failed");
                }
            }
        }
    }
}

/// Waits until every bridge is open.
async fn until_disarmed<M: RawMutex>(topics: &Topics<M>) {
    while topics
        .status
        .latest()
        .is_some_and(|status| status.value.mode != Mode::Disarmed)
    {
        Timer::after(PERIOD).await;
    }
}
