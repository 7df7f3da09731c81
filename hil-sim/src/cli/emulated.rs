//! `hil-sim drive --board emulated`: runs the same command in the board emulator's own program.
//!
//! The emulator needs a newer Rust than this package and takes minutes to build. It is therefore a package
//! of its own, which cargo builds on first use.

use std::path::Path;
use std::process::Command;

use hil_elf::{ELF_VARIABLE, cannot_build_board};
use report::error::CommandError;

/// The emulator's manifest, beside this package's.
const MANIFEST: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/board-emulator/Cargo.toml");
/// The emulator's build directory, shared with `cargo hil-elf`.
const TARGET: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/board-emulator");

/// Passes this process's arguments on to the emulator's program. `firmware` is the ELF that they name.
///
/// # Errors
/// [`CommandError::Input`] at once without the emulator's sources, the ELF, or a toolchain that builds it; or if the
/// emulator refuses the input. [`CommandError::Checks`] if the run fails its checks.
pub fn run(firmware: Option<&Path>) -> Result<(), CommandError> {
    if !Path::new(MANIFEST).exists() {
        return Err(CommandError::Input(format!(
            "--board emulated: {MANIFEST} is missing; it needs the workspace's sources"
        )));
    }
    let variable = std::env::var_os(ELF_VARIABLE);
    match firmware.or(variable.as_deref().map(Path::new)) {
        Some(elf) if !elf.is_file() => {
            return Err(CommandError::Input(format!("{}: not a file", elf.display())));
        }
        Some(_) => {}
        None => {
            if let Some(why) = cannot_build_board()? {
                return Err(CommandError::Input(format!("--board emulated: {why}")));
            }
        }
    }
    let status = Command::new("cargo")
        .args(["run", "--release", "--quiet", "--ignore-rust-version"])
        .args(["--manifest-path", MANIFEST, "--target-dir", TARGET])
        .args(["--bin", "emulated-drive", "--"])
        .args(std::env::args_os().skip(2))
        .status()?;
    // The emulator's own message is on standard error.
    match status.code() {
        Some(0) => Ok(()),
        Some(1) => Err(CommandError::Checks(
            "the checks failed on the emulated board: see the message above".into(),
        )),
        _ => Err(CommandError::Input("--board emulated: see the message above".into())),
    }
}
