//! The host tool, run from outside as a user runs it.
#![allow(dead_code)] // Each test binary uses part of it.

use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

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

/// The most that refusing an input may take: CPU time, s, and memory, KiB.
const REFUSAL_CPU_S: u32 = 20;
const REFUSAL_KIB: u32 = 4 << 20;
/// After this time a test gives up instead of hanging; the time measures nothing.
const GIVE_UP: Duration = Duration::from_mins(5);

/// Runs `hil-sim` with these arguments to its end. On Unix the system ends a tool that exceeds these limits; a tool that waits for
/// ever fails the test.
pub fn hil_sim_refuses(arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_hil-sim");
    let mut command = if cfg!(unix) {
        let mut shell = Command::new("sh");
        let limits = format!("ulimit -t {REFUSAL_CPU_S}; ulimit -v {REFUSAL_KIB}; exec \"$0\" \"$@\"");
        shell.args(["-c", &limits, program]);
        shell
    } else {
        Command::new(program)
    };
    let mut tool = command
        .args(arguments)
        .current_dir(WORKSPACE)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the tool starts");
    // A refusal is short enough for the pipes' buffers: nobody needs to read while the tool runs.
    let begun = Instant::now();
    while tool.try_wait().expect("waits").is_none() {
        if begun.elapsed() > GIVE_UP {
            tool.kill().expect("ends");
            panic!("{arguments:?} waits for ever");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    tool.wait_with_output().expect("ended")
}

/// What the tool wrote on standard error.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
