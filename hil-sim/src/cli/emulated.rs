//! `hil-sim drive --board emulated`: the same command in the board emulator's own program.
//!
//! The emulator asks for a newer Rust than this package and takes minutes to build, so it is a package
//! apart, built when it is first asked for.

use std::path::Path;
use std::process::Command;

use report::error::CommandError;

/// The emulator's manifest, beside this package's.
const MANIFEST: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/board-emulator/Cargo.toml");
/// Where it is built, the same as for `cargo hil-elf`.
const TARGET: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/board-emulator");

/// Passes this process's arguments on to the emulator's program.
///
/// # Errors
/// [`CommandError::Input`] without the emulator's sources or on what it calls bad input,
/// [`CommandError::Checks`] when the run fails its checks there.
pub fn run() -> Result<(), CommandError> {
    if !Path::new(MANIFEST).exists() {
        return Err(CommandError::Input(format!(
            "--board emulated: {MANIFEST} is missing; it needs the workspace's sources"
        )));
    }
    let status = Command::new("cargo")
        .args(["run", "--release", "--quiet", "--ignore-rust-version"])
        .args(["--manifest-path", MANIFEST, "--target-dir", TARGET])
        .args(["--bin", "emulated-drive", "--"])
        .args(std::env::args_os().skip(2))
        .status()?;
    // Its own message is on standard error.
    match status.code() {
        Some(0) => Ok(()),
        Some(1) => Err(CommandError::Checks("on the emulated board, as told above".into())),
        _ => Err(CommandError::Input("--board emulated: as told above".into())),
    }
}
