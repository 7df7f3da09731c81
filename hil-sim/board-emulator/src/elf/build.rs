//! The firmware under test, built on demand.

use std::path::PathBuf;
use std::sync::OnceLock;

use hil_elf::{ELF_VARIABLE, build_board};

use super::firmware::Firmware;
use crate::error::Error;

/// The firmware that the environment variable `FIRMWARE_ELF` names, or the workspace's own firmware, which is
/// built if it is not up to date. Each process builds the firmware once. Cargo keeps other processes from
/// building at the same time.
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

/// Builds the firmware; returns the ELF's path.
fn build() -> Result<PathBuf, Error> {
    let failed = |why: String| Error::Build(format!(".ci/build-board: {why}"));
    let built = build_board().map_err(|error| failed(error.to_string()))?;
    built.ok_or_else(|| failed("failed, with the messages above".to_owned()))
}
