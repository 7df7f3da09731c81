//! Computes how much simulated time is due, and measures the reached pace.

/// Longest host time of a go, us, and longest backlog that a go makes up for. Clients are served between goes.
const GO_MAX_US: u64 = 10_000;
/// Longest first go, ms, because the board's speed is not known yet.
const FIRST_GO_MS: f64 = 10.0;
/// Largest backlog of host time that a board makes up for, us: after the machine slept, the board does not hurry.
const BACKLOG_MAX_US: f64 = 100_000.0;
/// Host time over which the pace is measured, us.
const WINDOW_US: u64 = 3_000_000;
/// The server reports a pace that is this share below the requested pace, and reports each further change of this size.
const SHORTFALL: f64 = 0.1;

/// The board's time against the host's. Times of the host are in us from any fixed start.
#[derive(Debug)]
pub struct Pace {
    /// Requested simulated seconds per second.
    rate: f64,
    /// Shortest simulated time of a go, ms.
    go_ms: u64,
    /// Longest simulated time of a go, ms: the time that the board can run while the clients wait.
    go_max_ms: f64,
    /// Simulated time that is due, us.
    due_us: f64,
    /// Last reading of the host's clock.
    read_us: Option<u64>,
    /// Start of the window, and simulated time in the window, ms.
    window: Option<(u64, u64)>,
    /// The share of the rate that was reported last.
    told: f64,
}

impl Pace {
    /// `rate` simulated seconds per second, at least `go_ms` in one go.
    pub fn new(rate: f64, go_ms: u64) -> Self {
        Self {
            rate,
            go_ms,
            go_max_ms: FIRST_GO_MS,
            due_us: 0.0,
            read_us: None,
            window: None,
            told: 1.0,
        }
    }

    /// Notes that the host's clock has reached `now_us` while the board is off.
    pub fn rest(&mut self, now_us: u64) {
        self.due_us = 0.0;
        self.read_us = Some(now_us);
        self.window = None;
    }

    /// Notes that the host's clock has reached `now_us`; returns how long the board runs now, ms.
    pub fn go(&mut self, now_us: u64) -> u64 {
        let passed_us = now_us.saturating_sub(self.read_us.unwrap_or(now_us));
        self.read_us = Some(now_us);
        let most_us = BACKLOG_MAX_US * self.rate.max(1.0);
        self.due_us = (self.due_us + passed_us as f64 * self.rate).min(most_us);
        if !self.is_due() {
            return 0;
        }
        let go_ms = (self.due_us / 1000.0).min(self.go_max_ms) as u64;
        self.due_us -= (go_ms * 1000) as f64;
        let (_, passed_ms) = self.window.get_or_insert((now_us, 0));
        *passed_ms += go_ms;
        go_ms
    }

    /// Notes that the board has run for `go_ms`, which took `took_us` of host time.
    pub fn ran(&mut self, go_ms: u64, took_us: u64) {
        let most_ms = GO_MAX_US as f64 / 1000.0 * self.rate.max(1.0);
        if took_us > GO_MAX_US {
            self.go_max_ms = (self.go_max_ms / 2.0).max(self.go_ms as f64);
        } else if took_us < GO_MAX_US / 4 && go_ms as f64 >= self.go_max_ms / 2.0 {
            self.go_max_ms = (self.go_max_ms * 2.0).min(most_ms);
        }
    }

    /// Whether enough simulated time is due for a go, so that the server need not wait.
    pub fn is_due(&self) -> bool {
        self.due_us >= (self.go_ms * 1000) as f64
    }

    /// A message about the pace up to `now_us`, if a person should know it: too slow, or no longer too slow.
    pub fn word(&mut self, now_us: u64) -> Option<String> {
        let (since_us, passed_ms) = self.window?;
        let span_us = now_us.saturating_sub(since_us);
        if span_us < WINDOW_US {
            return None;
        }
        self.window = None;
        let reached = passed_ms as f64 * 1000.0 / span_us as f64;
        let share = (reached / self.rate).min(1.0);
        let short = share < 1.0 - SHORTFALL;
        if (share - self.told).abs() < SHORTFALL || !(short || self.told < 1.0) {
            return None;
        }
        self.told = if short { share } else { 1.0 };
        Some(if short {
            format!(
                "pace: {reached:.2} times real time; the requested rate is {}, which this machine cannot reach now",
                self.rate
            )
        } else {
            format!("pace: {reached:.2} times real time, as requested")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Advances the host's clock in steps of `step_us`, with `cost_us` per simulated ms. Returns the simulated time in
    /// ms and the messages.
    fn passes(pace: &mut Pace, from_us: u64, for_us: u64, step_us: u64, cost_us: u64) -> (u64, Vec<String>) {
        let (mut now_us, mut board_ms, mut told) = (from_us, 0, Vec::new());
        while now_us < from_us + for_us {
            let go_ms = pace.go(now_us);
            board_ms += go_ms;
            // Only while the speed is unknown may a go take so long that clients wait.
            assert!(board_ms < 100 || go_ms * cost_us <= 2 * GO_MAX_US, "{go_ms}");
            pace.ran(go_ms, go_ms * cost_us);
            now_us += step_us + go_ms * cost_us;
            told.extend(pace.word(now_us));
        }
        (board_ms, told)
    }

    #[test]
    fn a_fast_machine_keeps_every_rate_and_says_nothing() {
        for (rate, expected_ms) in [(1.0, 20_000), (0.25, 5_000), (3.0, 60_000), (100.0, 2_000_000)] {
            for go_ms in [1, 5] {
                let (board_ms, told) = passes(&mut Pace::new(rate, go_ms), 0, 20_000_000, 50, 1);
                // The first reading of the clock begins the run, and the board has yet to run the time that is due at its end.
                let missing_ms = expected_ms - board_ms;
                assert!(
                    missing_ms as f64 <= 10.0 * f64::max(rate, 1.0),
                    "rate {rate}, {go_ms} ms: {missing_ms} ms missing"
                );
                assert!(told.is_empty(), "{told:?}");
            }
        }
    }

    #[test]
    fn a_slow_machine_says_what_it_reaches_once_and_when_it_is_over() {
        let mut pace = Pace::new(1.0, 5);
        let (board_ms, told) = passes(&mut pace, 0, 20_000_000, 50, 2_000);
        assert!((9_900..=10_100).contains(&board_ms), "{board_ms}");
        assert_eq!(
            told,
            ["pace: 0.50 times real time; the requested rate is 1, which this machine cannot reach now"]
        );
        let (_, told) = passes(&mut pace, 20_000_000, 20_000_000, 100, 100);
        // No client waits at a rate far beyond the machine, either: `passes` asserts it.
        passes(&mut Pace::new(100.0, 5), 0, 20_000_000, 50, 500);
        // The pace may report a rate in between first.
        assert!(told.len() <= 2, "{told:?}");
        assert!(
            told.last().is_some_and(|word| word.ends_with("as requested")),
            "{told:?}"
        );
    }

    #[test]
    fn a_machine_that_slept_does_not_let_the_board_hurry() {
        let mut pace = Pace::new(1.0, 1);
        pace.go(0);
        let slept_us = 3_600_000_000;
        let caught_up: u64 = (0..1000).map(|_| pace.go(slept_us)).sum();
        assert_eq!(caught_up * 1000, BACKLOG_MAX_US as u64);
        // A board that was off does not hurry, either.
        pace.rest(2 * slept_us);
        assert_eq!(pace.go(2 * slept_us), 0);
    }
}
