//! `hil-sim drive --board emulated` and `serve --board emulated`: the same command in the board emulator's own program.
//!
//! The emulator takes minutes to build, needs its own build profile, and its emulated part declares a newer Rust than
//! it needs. The emulator is therefore a separate package, which cargo builds on first use.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::Command;

use hil_elf::{ELF_VARIABLE, cannot_build_board, without_package_variables};
use report::error::CommandError;

/// The emulator's manifest, in a folder of this package.
const MANIFEST: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/board-emulator/Cargo.toml");
/// The emulator's build directory, shared with `cargo hil-elf`.
const TARGET: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/board-emulator");

/// The emulator's program, once it is built.
const PROGRAM: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../target/board-emulator/release/emulated-board"
);
/// The cargo flags for the build.
const BUILD: [&str; 10] = [
    "build",
    "--release",
    "--quiet",
    "--ignore-rust-version",
    "--manifest-path",
    MANIFEST,
    "--target-dir",
    TARGET,
    "--bin",
    "emulated-board",
];
/// First bytes of every ELF.
const ELF_MAGIC: [u8; 4] = *b"\x7fELF";

/// Refuses at once a file that is not an ELF, because a build of the emulator before the refusal would take minutes.
fn check_elf(elf: &Path) -> Result<(), CommandError> {
    let wrong = |why: &dyn std::fmt::Display| CommandError::Input(format!("--firmware: {}: {why}", elf.display()));
    if !elf.is_file() {
        return Err(wrong(&"not a file"));
    }
    let mut magic = [0; ELF_MAGIC.len()];
    let read = File::open(elf).and_then(|mut file| file.read_exact(&mut magic));
    match read {
        Err(error) if error.kind() != std::io::ErrorKind::UnexpectedEof => Err(wrong(&error)),
        Ok(()) if magic == ELF_MAGIC => Ok(()),
        _ => Err(wrong(
            &"no ELF; leave the flag out to run the firmware of this workspace",
        )),
    }
}

/// The error for `--firmware` with a board that runs no ELF.
pub fn only_emulated() -> CommandError {
    CommandError::Input(
        "--firmware: the virtual board runs the tasks it was built with; an ELF runs with --board emulated".into(),
    )
}

/// Builds the emulator's program if it is not up to date, and passes this process's arguments on to it, the command's
/// name first. `firmware` is the ELF in these arguments. If the system allows it, the program replaces this process, so
/// that a signal ends the board and not only its starter.
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
        Some(elf) => check_elf(elf)?,
        None => {
            if let Some(why) = cannot_build_board()? {
                return Err(CommandError::Input(format!("--board emulated: {why}")));
            }
        }
    }
    if !Path::new(PROGRAM).exists() {
        // Not `eprintln!`, which panics when the reader has closed the stream.
        let _ = writeln!(
            std::io::stderr(),
            "--board emulated: building the emulator, which takes minutes the first time"
        );
    }
    let built = without_package_variables(&mut Command::new("cargo"))
        .args(BUILD)
        .status()?;
    if !built.success() {
        return Err(CommandError::Input(
            "--board emulated: the emulator could not be built: see the message above".into(),
        ));
    }
    become_program(Command::new(PROGRAM).args(std::env::args_os().skip(1)))
}

/// Replaces this process by a program. Returns only if the program does not start.
#[cfg(unix)]
fn become_program(program: &mut Command) -> Result<(), CommandError> {
    use std::os::unix::process::CommandExt as _;

    Err(program.exec().into())
}

/// Runs a program to its end.
#[cfg(not(unix))]
fn become_program(program: &mut Command) -> Result<(), CommandError> {
    // The program's own message is on standard error.
    match program.status()?.code() {
        Some(0) => Ok(()),
        Some(1) => Err(CommandError::Checks(
            "the checks failed on the emulated board: see the message above".into(),
        )),
        _ => Err(CommandError::Input("--board emulated: see the message above".into())),
    }
}
