//! Builds the drive board's firmware from a host program.

use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

pub mod cost;
/// The firmware's definition of the seal, included as one file so that this package depends on no other
/// package.
#[path = "../../../firmware/src/image_seal.rs"]
pub mod image_seal;
pub mod seal;

/// Environment variable that names an ELF to test instead of building one.
pub const ELF_VARIABLE: &str = "FIRMWARE_ELF";

/// Prefixes of the variables that cargo sets for a program of one package.
const PACKAGE_VARIABLES: [&str; 5] = [
    "CARGO_PKG_",
    "CARGO_MANIFEST_",
    "CARGO_CRATE_",
    "CARGO_BIN_",
    "CARGO_PRIMARY_",
];

/// The workspace's root.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Builds the firmware with the installed toolchain; returns the ELF's path, or `None` when the build failed.
/// The reason, for example a missing toolchain, is then on standard error.
///
/// # Errors
/// When `.ci/build-board` cannot be started.
pub fn build_board() -> io::Result<Option<PathBuf>> {
    let output = without_package_variables(&mut Command::new(root().join(".ci/build-board")))
        .current_dir(root())
        .stderr(Stdio::inherit())
        .output()?;
    let path = String::from_utf8_lossy(&output.stdout);
    Ok(output.status.success().then(|| root().join(path.trim())))
}

/// Why the firmware cannot be built: the line in which `.ci/build-board` names the remedy. `None` if an
/// installed toolchain can build the firmware. Builds nothing.
///
/// # Errors
/// When `.ci/build-board` cannot be started.
pub fn cannot_build_board() -> io::Result<Option<String>> {
    let mut check = Command::new(root().join(".ci/build-board"));
    let output = check.arg("--check").current_dir(root()).output()?;
    let told = String::from_utf8_lossy(&output.stderr);
    Ok((!output.status.success()).then(|| told.trim().to_owned()))
}

/// Removes the variables that cargo sets for a program of one package, because they would mislead another
/// package's build.
pub fn without_package_variables(command: &mut Command) -> &mut Command {
    for (name, _) in std::env::vars_os() {
        let text = name.to_string_lossy();
        if PACKAGE_VARIABLES.iter().any(|prefix| text.starts_with(prefix)) {
            command.env_remove(&name);
        }
    }
    command
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cargo's runner for the board, on a machine without probe-rs.
    #[cfg(unix)]
    #[test]
    fn flashing_without_probe_rs_ends_with_the_remedy() {
        let output = Command::new(root().join(".ci/flash-board"))
            .arg("drive-board")
            .env("PATH", "/nowhere")
            .output()
            .expect("it starts");
        let told = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success());
        assert_eq!(told.lines().count(), 1, "{told}");
        assert!(told.contains("cargo install probe-rs-tools"), "{told}");
    }
}
