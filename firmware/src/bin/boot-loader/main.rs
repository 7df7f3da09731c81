//! The boot loader: installs an image that the firmware has stored and ordered, rolls it back if it does not come up, and
//! boots an intact image. It configures no pin of the bridges, which stay open as after the reset, enables no interrupt,
//! and does not use the RAM in which the firmware keeps data over a reset.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod boot;
#[cfg(target_os = "none")]
#[path = "../drive-board/board/core_supply.rs"]
mod core_supply;
#[cfg(target_os = "none")]
#[path = "../drive-board/board/flash_banks.rs"]
mod flash_banks;
#[cfg(target_os = "none")]
mod loader_flash;
#[cfg(target_os = "none")]
mod ram_words;
#[cfg(target_os = "none")]
mod slow_watchdog;
#[cfg(target_os = "none")]
mod stm32_registers;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("the boot loader runs on its own part: `cargo build-board`, `cargo flash-board`");
    std::process::exit(2);
}
