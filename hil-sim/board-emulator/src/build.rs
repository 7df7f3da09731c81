//! The firmware under test: built on demand.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use crate::{Error, Firmware};

/// Names an ELF to test instead of building one.
pub const ELF_VARIABLE: &str = "FIRMWARE_ELF";

/// The workspace's root.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The firmware that [`ELF_VARIABLE`] names, or the workspace's own, built if it is not up to date. Once
/// a process: cargo holds off other processes that build at the same time.
///
/// # Errors
/// When it cannot be built or read.
pub fn firmware() -> Result<&'static Firmware, Error> {
    static FIRMWARE: OnceLock<Result<Firmware, String>> = OnceLock::new();
    let made = FIRMWARE.get_or_init(|| {
        let path = match std::env::var_os(ELF_VARIABLE) {
            Some(path) => PathBuf::from(path),
            None => build().map_err(|error| error.to_string())?,
        };
        Firmware::read(&path).map_err(|error| error.to_string())
    });
    made.as_ref().map_err(|error| Error::Build(error.clone()))
}

/// Builds the firmware with whichever toolchain is there; returns the ELF's path.
///
/// # Errors
/// When the build fails; its own messages are on standard error.
pub fn build() -> Result<PathBuf, Error> {
    let mut command = Command::new(root().join(".ci/build-board"));
    // What cargo tells the tests about this package is not for another package's build.
    for (name, _) in std::env::vars_os() {
        if name.to_string_lossy().starts_with("CARGO_") && name != "CARGO_HOME" {
            command.env_remove(name);
        }
    }
    let output = command
        .current_dir(root())
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| Error::Build(error.to_string()))?;
    if !output.status.success() {
        return Err(Error::Build(format!("it ended with {}", output.status)));
    }
    let path = String::from_utf8_lossy(&output.stdout);
    Ok(root().join(path.trim()))
}
