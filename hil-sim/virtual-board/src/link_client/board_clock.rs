//! The host's estimate of the board's clock, from the times in the board's messages. A real board's clock runs evenly
//! and close to the host's rate. A simulated board's clock may run at any rate, because the user chose the rate or
//! because the simulating machine is busy. An order must never be dated in the board's future, so the estimate follows
//! a slow clock.
//!
//! A message takes time to arrive, so its time is always behind the board's clock. The estimate is the line above all
//! recent observations that lies closest to them: the edge of the upper hull of the observations over their mean time
//! (Moon, Skelly and Towsley 1999, "Estimation and removal of clock skew from network delay measurements").

use std::collections::VecDeque;

/// Age up to which an observation counts, us of the host.
const WINDOW_US: u64 = 2_000_000;
/// Interval of which one observation is kept, us of the host.
const BETWEEN_US: u64 = 100_000;
/// Share by which the board's clock may run slower than estimated.
const DRIFT: f64 = 200e-6;

/// A message that the board sent at or after `board_us` arrived at `host_us`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct TimeHeard {
    host_us: u64,
    board_us: u64,
}

impl TimeHeard {
    /// Host's and board's time since another observation, us.
    fn after(self, other: Self) -> (f64, f64) {
        (
            self.host_us.cast_signed().wrapping_sub(other.host_us.cast_signed()) as f64,
            self.board_us.cast_signed().wrapping_sub(other.board_us.cast_signed()) as f64,
        )
    }
}

/// The host's estimate of the board's clock.
#[derive(Debug, Clone, Default)]
pub(super) struct BoardClock {
    /// The best observation of each [`BETWEEN_US`], in order.
    kept: VecDeque<TimeHeard>,
    /// Start of the interval of the last kept observation, us of the host.
    since_us: u64,
    newest: Option<TimeHeard>,
}

impl BoardClock {
    /// Records that a message that the board sent at or after `board_us` has arrived at `now_us`.
    pub fn observe(&mut self, now_us: u64, board_us: u64) {
        let newest = TimeHeard {
            host_us: now_us,
            board_us,
        };
        self.newest = Some(newest);
        match self.kept.back_mut() {
            Some(last) if now_us.saturating_sub(self.since_us) < BETWEEN_US => {
                let (host_us, board_us) = newest.after(*last);
                if board_us >= host_us {
                    *last = newest;
                }
            }
            _ => {
                while let Some(oldest) = self.kept.front()
                    && now_us.saturating_sub(oldest.host_us) > WINDOW_US
                {
                    self.kept.pop_front();
                }
                self.kept.push_back(newest);
                self.since_us = now_us;
            }
        }
    }

    /// Latest possible time of the board, us; `None` before the first message.
    pub fn board_us(&self, now_us: u64) -> Option<u64> {
        let newest = self.newest?;
        let rate = self.slope(newest).clamp(0.0, 1.0);
        let ahead_us = self.kept.iter().fold(0.0, |ahead_us: f64, each| {
            let (host_us, board_us) = each.after(newest);
            ahead_us.max(board_us - rate * host_us)
        });
        let passed_us = now_us.saturating_sub(newest.host_us) as f64;
        let after_us = ahead_us + passed_us * (rate - DRIFT).max(0.0) - 1.0;
        Some(newest.board_us.saturating_add_signed(after_us as i64))
    }

    /// Seconds of the board's clock per second of the host's: the slope of the upper hull's edge over the mean time of
    /// the observations; 0 while there is only one observation. Times count from `origin`.
    fn slope(&self, origin: TimeHeard) -> f64 {
        let mut hull: Vec<(f64, f64)> = Vec::with_capacity(self.kept.len());
        let mut sum_us = 0.0;
        for (host_us, board_us) in self.kept.iter().map(|each| each.after(origin)) {
            sum_us += host_us;
            while let [.., a, b] = hull[..]
                && (b.0 - a.0) * (board_us - a.1) >= (b.1 - a.1) * (host_us - a.0)
            {
                hull.pop();
            }
            hull.push((host_us, board_us));
        }
        let mean_us = sum_us / self.kept.len() as f64;
        hull.windows(2)
            .find(|edge| edge[1].0 >= mean_us)
            .map_or(0.0, |edge| (edge[1].1 - edge[0].1) / (edge[1].0 - edge[0].0).max(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest errors of an order's time, too late (positive) and too early, from `from_s` on. The board's clock runs
    /// at `rate` seconds per second, and its 20 messages per second take up to `slowest_ms`.
    fn errors_us(rate: impl Fn(f64) -> f64, slowest_ms: f64, from_s: f64) -> (i64, i64) {
        let (mut clock, mut board_us, mut worst) = (BoardClock::default(), 5e6, (i64::MIN, i64::MAX));
        let mut on_the_way: Vec<(f64, f64)> = Vec::new();
        for host_ms in 0..20_000_u32 {
            let (now_ms, now_us) = (f64::from(host_ms), u64::from(host_ms) * 1000);
            board_us += 1e3 * rate(now_ms * 1e-3);
            if host_ms % 50 == 0 {
                let share = f64::from(host_ms / 50 * 37 % 101) / 100.0;
                on_the_way.push((now_ms + share * slowest_ms, board_us));
            }
            on_the_way.retain(|&(at_ms, sent_us)| {
                if at_ms <= now_ms {
                    clock.observe(now_us, sent_us as u64);
                }
                at_ms > now_ms
            });
            if let Some(dated_us) = clock.board_us(now_us)
                && now_ms >= from_s * 1e3
            {
                let error_us = dated_us.cast_signed() - board_us as i64;
                worst = (worst.0.max(error_us), worst.1.min(error_us));
            }
        }
        worst
    }

    #[test]
    fn a_board_of_any_rate_is_followed_and_no_order_comes_from_the_future() {
        use firmware::protocol::message::CLOCK_TOLERANCE_US;
        for rate in [0.1, 0.3, 0.5, 0.9, 0.97, 0.99, 0.9999, 1.0, 1.0001, 1.1, 2.0, 5.0] {
            for slowest_ms in [0.0, 2.0, 10.0] {
                let (late_us, early_us) = errors_us(|_| rate, slowest_ms, 0.0);
                assert!(
                    late_us <= CLOCK_TOLERANCE_US.cast_signed(),
                    "rate {rate}, {slowest_ms} ms: {late_us} us in the future"
                );
                // In the worst case only the newest of 20 messages per second counts.
                let allowed_us = ((50.0 + slowest_ms) * 1e3 * rate) as i64 + 5_000;
                assert!(
                    early_us >= -allowed_us,
                    "rate {rate}, {slowest_ms} ms: {early_us} us too old"
                );
            }
        }
    }

    #[test]
    fn the_fastest_message_counts_not_the_first() {
        // A message every 10 ms. Every tenth message takes 1 ms, all others 60 ms; the fast message is never the first
        // of its ten.
        let sent_us = (0..300_u64).map(|n| (n * 10_000 + if n % 10 == 7 { 1_000 } else { 60_000 }, n * 10_000));
        let mut heard: Vec<_> = sent_us.collect();
        heard.sort_unstable();
        let mut clock = BoardClock::default();
        for (host_us, board_us) in heard {
            clock.observe(host_us, board_us);
        }
        let now_us = 3_100_000;
        let late_us = clock.board_us(now_us).expect("heard").cast_signed() - now_us.cast_signed();
        assert!((-2_000..=0).contains(&late_us), "{late_us}");
    }

    #[test]
    fn a_board_that_becomes_slow_is_followed_within_two_seconds() {
        // A machine that becomes busy at 6 s, and idle again at 12 s.
        let busy = |s: f64| if (6.0..12.0).contains(&s) { 0.6 } else { 1.0 };
        let (late_us, _) = errors_us(busy, 2.0, 15.0);
        assert!(late_us <= 0, "{late_us}");
        let steady = |s: f64| if s > 6.0 { 0.6 } else { 1.0 };
        let (late_us, early_us) = errors_us(steady, 2.0, 9.5);
        assert!(late_us <= 10_000, "{late_us}");
        assert!(early_us >= -20_000, "{early_us}");
    }
}
