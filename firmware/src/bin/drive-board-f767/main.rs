//! The drive board's firmware on the NUCLEO-F767ZI: the vehicle application on a second part.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../stm32/application.rs"]
mod application;
#[cfg(target_os = "none")]
mod board;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("the drive board's firmware runs on its own part: `cargo build-board-f767`, `cargo flash-board-f767`");
    std::process::exit(2);
}
