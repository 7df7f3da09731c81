//! A board that `hil-sim serve` serves, for tests from outside.

use std::process::Command;
use std::time::Duration;

use crate::listened::Listened;
use crate::tool::{WORKSPACE, hil_sim, stderr};

/// After this time a test gives up instead of hanging; the time measures nothing.
pub const GIVE_UP: Duration = Duration::from_mins(2);

/// A server, which ends with the test.
pub struct Served {
    pub server: Listened,
    pub port: String,
}

impl Served {
    pub fn new(arguments: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hil-sim"));
        command.arg("serve").args(arguments).current_dir(WORKSPACE);
        let server = Listened::start(&mut command, GIVE_UP);
        let port = server.wait_for("board at ");
        Self { server, port }
    }

    /// Waits for the server's next line that contains `part`, and returns the text after it.
    pub fn wait_for(&self, part: &str) -> String {
        self.server.wait_for(part)
    }

    /// Runs the link tool with these arguments: its exit code, output and errors.
    pub fn link(&self, arguments: &[&str]) -> (Option<i32>, String, String) {
        let output = hil_sim(&[&["link", "--port", &self.port], arguments].concat());
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        (output.status.code(), text, stderr(&output))
    }
}
