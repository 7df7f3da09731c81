//! The restart into the boot loader.

use cortex_m::peripheral::SCB;
use firmware::hardware::Restart;

use super::bridges;

/// The part's own reset.
pub struct SystemReset;

impl Restart for SystemReset {
    fn restart(&mut self) -> ! {
        // As when the firmware dies: no task closes a bridge in between.
        cortex_m::interrupt::disable();
        bridges::open_all();
        SCB::sys_reset();
    }
}
