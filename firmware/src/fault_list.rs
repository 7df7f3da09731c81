//! The vehicle's fault list: entries with time, mode and cause.

use core::cell::RefCell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::RawMutex;
use model::supervise::arming::Mode;
use model::supervise::codes::FaultSet;
use serde::{Deserialize, Serialize};

/// Number of faults that the vehicle keeps.
pub const FAULTS_KEPT: usize = 32;
/// Largest number of entries in one answer.
const BLOCK_ENTRIES: usize = 16;

/// One fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaultEntry {
    /// Number of the fault in the vehicle's life, from 0.
    pub number: u32,
    /// The boot in which the fault was latched. All entries of a boot have the same number.
    pub boot: u32,
    /// Time of the fault, us since that boot.
    pub time_us: u64,
    /// The mode before the fault.
    pub mode: Mode,
    /// Number of the fault's code.
    pub fault: u8,
}

/// Faults that one tick has latched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NewFaults {
    /// Time of the tick's sample, us since boot.
    pub time_us: u64,
    /// The mode before the tick.
    pub mode: Mode,
    /// The faults.
    pub faults: FaultSet,
}

/// Some consecutive faults, the oldest first.
pub type FaultBlock = heapless::Vec<FaultEntry, BLOCK_ENTRIES>;

/// The newest faults.
#[derive(Debug)]
pub struct FaultList<M: RawMutex> {
    entries: Mutex<M, RefCell<heapless::Deque<FaultEntry, FAULTS_KEPT>>>,
}

impl<M: RawMutex> FaultList<M> {
    /// No fault.
    pub const fn new() -> Self {
        Self {
            entries: Mutex::new(RefCell::new(heapless::Deque::new())),
        }
    }

    /// Adds the newest fault; drops the oldest fault if there is no room.
    pub fn push(&self, entry: FaultEntry) {
        self.entries.lock(|entries| {
            // No task waits inside, so the entries are never in use.
            if let Ok(mut entries) = entries.try_borrow_mut() {
                if entries.is_full() {
                    entries.pop_front();
                }
                // There is room now.
                let _ = entries.push_back(entry);
            }
        });
    }

    /// The oldest faults whose number is at least `from`.
    pub fn from(&self, from: u32) -> FaultBlock {
        self.entries.lock(|entries| {
            let entries = entries.try_borrow();
            entries
                .map(|entries| {
                    let wanted = entries.iter().filter(|entry| entry.number >= from);
                    wanted.take(BLOCK_ENTRIES).copied().collect()
                })
                .unwrap_or_default()
        })
    }
}

impl<M: RawMutex> Default for FaultList<M> {
    fn default() -> Self {
        Self::new()
    }
}
