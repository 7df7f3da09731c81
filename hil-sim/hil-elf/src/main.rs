//! `cargo hil-elf`: builds the firmware, then tests its ELF on the emulated board.
//!
//! The firmware is built first because the emulator takes minutes to build. On a machine without the
//! board's toolchain the command thus ends at once, with the line in which `.ci/build-board` names the
//! remedy.

use std::path::{self, Path};
use std::process::{Command, ExitCode};
use std::{env, io};

use hil_elf::cost::Cost;
use hil_elf::{ELF_VARIABLE, build_board, root, without_package_variables};

fn main() -> ExitCode {
    match run() {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Builds and tests; returns whether both succeeded. The failed step has printed its reason.
fn run() -> io::Result<bool> {
    let elf = match env::var_os(ELF_VARIABLE) {
        Some(given) => {
            // The tests run in another folder.
            let elf = path::absolute(given)?;
            if !elf.is_file() {
                return Err(io::Error::other(format!(
                    "{ELF_VARIABLE}: {} is not a file",
                    elf.display()
                )));
            }
            Some(elf)
        }
        None => build_board()?,
    };
    elf.map_or(Ok(false), |elf| test(&elf))
}

/// Runs the emulated board's tests on `elf`, with this program's arguments, and prints what they cost; returns whether they
/// passed.
fn test(elf: &Path) -> io::Result<bool> {
    if !tests(elf).arg("--no-run").status()?.success() {
        return Ok(false);
    }
    let cost = Cost::begin();
    let status = tests(elf).args(env::args_os().skip(1)).status()?;
    eprintln!("{}", cost.text());
    Ok(status.success())
}

/// The command that builds and runs the tests.
fn tests(elf: &Path) -> Command {
    let mut command = Command::new("cargo");
    without_package_variables(&mut command)
        // The emulated part declares a newer Rust than it needs.
        .args(["test", "--release", "--ignore-rust-version", "--manifest-path"])
        .arg(root().join("hil-sim/board-emulator/Cargo.toml"))
        .arg("--target-dir")
        .arg(root().join("target/board-emulator"))
        .env(ELF_VARIABLE, elf);
    command
}
