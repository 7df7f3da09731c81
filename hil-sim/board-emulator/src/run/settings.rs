//! Rates of a run.

use crate::board::{INSTRUCTIONS_PER_SECOND, PartSetup};
use crate::time::MS;

/// Rates of a run.
#[derive(Debug, Clone, Copy)]
pub struct EmulationSettings {
    /// Virtual time between two steps of the plant in ns. A multiple or a fraction of the firmware's tick of
    /// 1 ms, because the steps are placed just before ticks.
    pub plant_interval: u64,
    /// Instructions per second of virtual time.
    pub instructions_per_second: u64,
    /// Virtual time between two drains of the log in ns.
    pub log_interval: u64,
    /// State of the part before the firmware starts.
    pub part: PartSetup,
}

impl Default for EmulationSettings {
    fn default() -> Self {
        Self {
            plant_interval: MS,
            instructions_per_second: INSTRUCTIONS_PER_SECOND,
            log_interval: 5 * MS,
            part: PartSetup::default(),
        }
    }
}
