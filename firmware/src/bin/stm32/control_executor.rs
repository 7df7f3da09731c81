//! The executor of the control task, on the interrupt of an unused peripheral.

use embassy_executor::{InterruptExecutor, SendSpawner};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};

/// The executor whose tasks interrupt every other task.
static CONTROL_EXECUTOR: InterruptExecutor = InterruptExecutor::new();

/// Starts the executor, with a priority below the drivers' interrupts and above the thread.
pub fn start() -> SendSpawner {
    interrupt::UART5.set_priority(Priority::P6);
    CONTROL_EXECUTOR.start(interrupt::UART5)
}

#[interrupt]
unsafe fn UART5() {
    // SAFETY: the executor runs on this interrupt, and this is the interrupt's handler.
    unsafe { CONTROL_EXECUTOR.on_interrupt() }
}
