//! The hash of the default drive's trace: `cargo run --release -p virtual-board --example trace_hash`.
//!
//! The same program, compiled for `wasm32-unknown-unknown`, exports [`trace_hash`]: `.ci/check-wasm` runs it
//! under node and compares the two numbers, which must be equal bit for bit.

use std::error::Error;

use virtual_board::scenario::file::{DEFAULT, DEFAULT_NAME};
use virtual_board::scenario::{Scenario, VirtualBackend, run};

fn main() -> Result<(), Box<dyn Error>> {
    println!("{:016x}", drive()?);
    Ok(())
}

/// Drives the default scenario and returns the hash of its trace.
fn drive() -> Result<u64, Box<dyn Error>> {
    let scenario = Scenario::parse(DEFAULT_NAME, DEFAULT)?;
    let vehicle = vehicle_file::reference()?;
    let plant = scenario.plant(&vehicle)?;
    let mut backend = VirtualBackend::boot(&vehicle, plant)?;
    Ok(run(&scenario, &mut backend, |_| {})?.trace.hash())
}

/// [`drive`] for a web page or for node; returns 0 if the drive could not be started.
// The only name that the WebAssembly module exports.
#[allow(unsafe_code)]
#[unsafe(no_mangle)]
pub extern "C" fn trace_hash() -> u64 {
    drive().unwrap_or(0)
}
