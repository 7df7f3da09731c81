//! Debounces a condition: it must persist before it counts.

/// Counts in `run` the bad ticks in a row, with one tick's verdict. Returns true once there are `limit` of them.
#[inline]
pub fn persists(run: &mut u16, bad: bool, limit: u16) -> bool {
    // The usual case: one branch costs less than counting.
    if !bad {
        *run = 0;
        return false;
    }
    *run = run.saturating_add(1);
    *run >= limit
}

/// Counts consecutive bad ticks: a single glitch is no fault, a run of bad ticks is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Persistence {
    bad: u16,
    limit: u16,
}

impl Persistence {
    /// Trips after `limit` bad ticks in a row, at least one.
    pub const fn new(limit: u16) -> Self {
        Self { bad: 0, limit }
    }

    /// Updates the count with one tick's verdict. Returns true once the run of bad ticks is long
    /// enough.
    #[inline]
    pub fn update(&mut self, bad: bool) -> bool {
        persists(&mut self.bad, bad, self.limit)
    }

    /// Whether the run of bad ticks is at least `ticks` long, whatever the limit.
    pub fn lasts(&self, ticks: u16) -> bool {
        self.bad >= ticks
    }

    /// The result of the last update.
    pub fn stands(&self) -> bool {
        self.bad >= self.limit
    }
}
