//! The counter of CPU cycles.

use cortex_m::peripheral::{DCB, DWT};
use firmware::hardware::CycleCounter;

/// The cycle counter of the core's trace unit.
pub struct CoreCycles(());

impl CoreCycles {
    /// Starts the counter.
    pub fn start(dcb: &mut DCB, dwt: &mut DWT) -> Self {
        dcb.enable_trace();
        DWT::unlock();
        dwt.enable_cycle_counter();
        Self(())
    }
}

impl CycleCounter for CoreCycles {
    fn cycles(&self) -> u32 {
        DWT::cycle_count()
    }
}
