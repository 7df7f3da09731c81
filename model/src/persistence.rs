//! Debounces a condition: it must persist before it counts.

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
        // The usual case: one branch costs less than counting.
        if !bad {
            self.bad = 0;
            return false;
        }
        self.bad = self.bad.saturating_add(1);
        self.stands()
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
