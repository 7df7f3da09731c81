//! The host tool run from outside, as a user runs it.

use std::process::{Command, Output};

/// The workspace's root, from which the tool runs.
pub const WORKSPACE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// Runs `hil-sim` with these arguments to its end.
pub fn hil_sim(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args(arguments)
        .current_dir(WORKSPACE)
        .output()
        .expect("the tool starts")
}

/// What the tool wrote on standard error.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
