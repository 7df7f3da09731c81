//! A board that `hil-sim serve` serves, from outside.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use crate::tool::{WORKSPACE, hil_sim, stderr};

/// After this time a test gives up instead of hanging; nothing is measured by it.
pub const GIVE_UP: Duration = Duration::from_mins(2);

/// A server, which ends with the test.
pub struct Served {
    pub server: Child,
    lines: Receiver<String>,
    pub port: String,
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

impl Served {
    pub fn new(arguments: &[&str]) -> Self {
        let mut server = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
            .arg("serve")
            .args(arguments)
            .current_dir(WORKSPACE)
            .stdout(Stdio::piped())
            .spawn()
            .expect("the server starts");
        let (line, lines) = channel();
        let out = BufReader::new(server.stdout.take().expect("piped"));
        std::thread::spawn(move || {
            for text in out.lines().map_while(Result::ok) {
                if line.send(text).is_err() {
                    return;
                }
            }
        });
        let mut served = Self {
            server,
            lines,
            port: String::new(),
        };
        served.port = served.wait_for("board at ").replace("board at ", "");
        served
    }

    /// The next line that contains `part`.
    pub fn wait_for(&self, part: &str) -> String {
        loop {
            let line = self
                .lines
                .recv_timeout(GIVE_UP)
                .unwrap_or_else(|_| panic!("no line with `{part}`"));
            if line.contains(part) {
                return line;
            }
        }
    }

    /// Runs the link tool with these arguments: its exit code, output and errors.
    pub fn link(&self, arguments: &[&str]) -> (Option<i32>, String, String) {
        let output = hil_sim(&[&["link", "--port", &self.port], arguments].concat());
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        (output.status.code(), text, stderr(&output))
    }
}
