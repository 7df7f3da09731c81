//! What the tests cost: time, and processor time, which a busy machine changes little.

use std::fmt::Write as _;
use std::time::{Duration, Instant};
use std::{fs, thread};

/// Most time that all tests may take on two idle cores.
pub const IDLE: Duration = Duration::from_mins(12);
/// Ticks per second of the times in `/proc`, on every machine on which Linux runs this program.
const TICKS_PER_S: u64 = 100;

/// A measurement in progress.
#[derive(Debug)]
pub struct Cost {
    began: Instant,
    children: Option<Duration>,
}

impl Cost {
    /// Begins a measurement.
    pub fn begin() -> Self {
        Self {
            began: Instant::now(),
            children: children_time(),
        }
    }

    /// The measurement so far, in one line.
    pub fn text(&self) -> String {
        let processor = children_time().zip(self.children);
        let cores = thread::available_parallelism().map_or(0, usize::from);
        text(
            self.began.elapsed(),
            processor.map(|(now, then)| now.saturating_sub(then)),
            cores,
        )
    }
}

fn text(took: Duration, processor: Option<Duration>, cores: usize) -> String {
    let mut text = format!("hil-elf: the tests took {} s", took.as_secs());
    if let Some(processor) = processor {
        let _ = write!(text, ", {} s of processor time", processor.as_secs());
    }
    let _ = write!(
        text,
        ", on {cores} cores; all of them may take {} s on two idle cores",
        IDLE.as_secs()
    );
    text
}

/// The processor time of the programs that this program has run to their ends. `None` without a `/proc`.
fn children_time() -> Option<Duration> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    children_in(&stat)
}

/// The children's user and system time in a line of `/proc/PID/stat` (proc(5): fields 16 and 17). The second field is the
/// program's name in parentheses, which may contain anything.
fn children_in(stat: &str) -> Option<Duration> {
    let (_, fields) = stat.rsplit_once(')')?;
    let mut fields = fields.split_whitespace().skip(13);
    let mut ticks = || fields.next()?.parse::<u64>().ok();
    let sum = ticks()?.checked_add(ticks()?)?;
    Some(Duration::from_millis(sum.checked_mul(1000)? / TICKS_PER_S))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_says_how_long_and_how_much() {
        let long = Duration::from_millis(613_400);
        assert_eq!(
            text(long, Some(Duration::from_secs(1100)), 2),
            "hil-elf: the tests took 613 s, 1100 s of processor time, on 2 cores; all of them may take 720 s on two idle cores"
        );
        assert!(!text(long, None, 8).contains("processor"));
    }

    #[test]
    fn the_childrens_time_is_behind_the_name() {
        let stat = "7 (a) b (c) S 1 7 7 0 -1 4194304 180 5000 0 9 11 12 1234 66 20 0 1 0 1 2 3";
        assert_eq!(children_in(stat), Some(Duration::from_secs(13)));
        assert_eq!(children_in("7 (a) S 1"), None);
        assert_eq!(children_in(""), None);
    }

    /// A child that works is seen.
    #[cfg(target_os = "linux")]
    #[test]
    fn the_work_of_a_child_counts() {
        let before = children_time().expect("a /proc");
        let mut child = std::process::Command::new("sh");
        let done = child
            .args(["-c", "i=0; while [ $i -lt 300000 ]; do i=$((i+1)); done"])
            .status();
        assert!(done.expect("a shell").success());
        assert!(children_time().expect("a /proc") > before);
    }
}
