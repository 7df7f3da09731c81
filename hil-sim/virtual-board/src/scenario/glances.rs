//! The observer's memory of the true state in a run.

use plant::{Glance, Truth};

/// Number of ticks that the observer remembers.
const GLANCES: usize = 64;

/// The true states of the last ticks, needed because a status reports a tick that is some
/// milliseconds old.
#[derive(Debug)]
pub(super) struct Glances {
    /// The glances in order of time, in a ring.
    kept: Vec<(u64, Box<Glance>)>,
    /// Index of the oldest glance once the ring is full.
    oldest: usize,
}

impl Glances {
    pub(super) fn new() -> Self {
        Self {
            kept: Vec::with_capacity(GLANCES),
            oldest: 0,
        }
    }

    /// Adds a glance. The caller gets another glance in exchange, to be overwritten by the next.
    pub(super) fn add(&mut self, now_us: u64, glance: &mut Box<Glance>) {
        if self.kept.len() < GLANCES {
            self.begin(now_us, glance);
        } else if let Some((at_us, seen)) = self.kept.get_mut(self.oldest) {
            *at_us = now_us;
            std::mem::swap(seen, glance);
            self.oldest = (self.oldest + 1) % GLANCES;
        }
    }

    /// Adds a glance while the ring is not yet full.
    #[cold]
    fn begin(&mut self, now_us: u64, glance: &mut Box<Glance>) {
        self.kept.push((now_us, std::mem::take(glance)));
    }

    /// The truth at `us`, or at the nearest known time; of two equally near times, the earlier.
    pub(super) fn truth_at(&self, us: u64) -> Option<Truth> {
        self.nearest(us).map(|(_, glance)| glance.truth())
    }

    fn nearest(&self, us: u64) -> Option<&(u64, Box<Glance>)> {
        let (newer, older) = self.kept.split_at_checked(self.oldest)?;
        let mut nearest: Option<&(u64, Box<Glance>)> = None;
        for seen in newer.iter().rev().chain(older.iter().rev()) {
            if nearest.is_some_and(|(at, _)| at.abs_diff(us) < seen.0.abs_diff(us)) {
                // Older glances are further away.
                break;
            }
            nearest = Some(seen);
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Glances that contain their own time, one per millisecond, `glances` in all.
    fn seen(glances: u64) -> Glances {
        let mut seen = Glances::new();
        for ms in 1..=glances {
            seen.add(1000 * ms, &mut Box::default());
        }
        seen
    }

    #[test]
    fn the_nearest_in_time_is_found_and_of_two_the_earlier() {
        for glances in [5, 64, 65, 100, 128] {
            let seen = seen(glances);
            let at = |us: u64| seen.nearest(us).map(|(at_us, _)| *at_us);
            let (oldest, newest) = (1000 * glances.saturating_sub(63).max(1), 1000 * glances);
            for (us, found) in [
                (newest, newest),
                (newest + 77_000, newest),
                (newest - 400, newest),
                (newest - 500, newest - 1000),
                (newest - 600, newest - 1000),
                (newest - 3000, newest - 3000),
                (oldest + 499, oldest),
                (oldest, oldest),
                (0, oldest),
            ] {
                assert_eq!(at(us), Some(found), "{us} of {glances}");
            }
        }
        assert_eq!(Glances::new().truth_at(0), None);
    }
}
