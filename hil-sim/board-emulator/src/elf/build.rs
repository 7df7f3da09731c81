//! The firmware under test, built on demand.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use super::firmware::Firmware;
use crate::error::Error;

/// Environment variable that names an ELF to test instead of building one.
const ELF_VARIABLE: &str = "FIRMWARE_ELF";

/// The workspace's root.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The firmware that the environment variable `FIRMWARE_ELF` names, or the workspace's own, which is built if it
/// is not up to date. Built once per process; cargo keeps other processes from building at the same time.
///
/// # Errors
/// When the firmware cannot be built or read; the same error at every call.
pub fn firmware() -> Result<&'static Firmware, &'static Error> {
    static FIRMWARE: OnceLock<Result<Firmware, Error>> = OnceLock::new();
    let made = FIRMWARE.get_or_init(|| {
        let path = match std::env::var_os(ELF_VARIABLE) {
            Some(path) => PathBuf::from(path),
            None => build()?,
        };
        Firmware::read(&path)
    });
    made.as_ref()
}

/// Builds the firmware with the toolchain that is installed; returns the ELF's path.
fn build() -> Result<PathBuf, Error> {
    let mut command = Command::new(root().join(".ci/build-board"));
    // The variables that cargo sets for this package would mislead the build of another package.
    for (name, _) in std::env::vars_os() {
        if name.to_string_lossy().starts_with("CARGO_") && name != "CARGO_HOME" {
            command.env_remove(name);
        }
    }
    // The script's own messages go to standard error.
    let output = command
        .current_dir(root())
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| Error::Build(format!(".ci/build-board: {error}")))?;
    if !output.status.success() {
        return Err(Error::Build(format!(".ci/build-board: {}", output.status)));
    }
    let path = String::from_utf8_lossy(&output.stdout);
    Ok(root().join(path.trim()))
}
