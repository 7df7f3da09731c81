//! A program that serves something, and the lines that it prints meanwhile.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// A running program, which ends with the test.
pub struct Listened {
    pub process: Child,
    lines: Receiver<String>,
    give_up: Duration,
}

impl Drop for Listened {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Listened {
    /// Starts the program. A test that waits longer than `give_up` gives up instead of hanging; the time measures nothing.
    pub fn start(command: &mut Command, give_up: Duration) -> Self {
        let mut process = command.stdout(Stdio::piped()).spawn().expect("the program starts");
        let (line, lines) = channel();
        let out = BufReader::new(process.stdout.take().expect("piped"));
        std::thread::spawn(move || {
            for text in out.lines().map_while(Result::ok) {
                if line.send(text).is_err() {
                    return;
                }
            }
        });
        Self {
            process,
            lines,
            give_up,
        }
    }

    /// Waits for the next line that contains `part`, and returns the text after it.
    pub fn wait_for(&self, part: &str) -> String {
        loop {
            let line = self.lines.recv_timeout(self.give_up);
            let line = line.unwrap_or_else(|_| panic!("no line with `{part}`"));
            if let Some((_, rest)) = line.split_once(part) {
                return rest.to_owned();
            }
        }
    }

    /// Sends the program a signal, as the shell's `kill` names it.
    #[cfg(unix)]
    pub fn signal(&self, signal: &str) {
        let pid = self.process.id().to_string();
        let sent = Command::new("kill").args([signal, &pid]).status().expect("runs");
        assert!(sent.success(), "{signal}");
    }
}
