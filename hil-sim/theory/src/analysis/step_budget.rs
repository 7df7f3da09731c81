//! A budget of integration steps for a search.

use std::cell::Cell;

/// Largest number of integration steps of a search. The longest search of the thesis and its errata needs 531,542;
/// with this bound every search ends after seconds, whatever the parameters.
pub const SEARCH_STEPS_MAX: u64 = 3_000_000;

/// The remaining integration steps of a search.
#[derive(Debug)]
pub struct StepBudget {
    allowed: u64,
    left: Cell<u64>,
}

/// A search has used up its integration steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the search ended after {allowed} integration steps")]
pub struct OutOfSteps {
    /// The allowed number of steps.
    pub allowed: u64,
}

impl Default for StepBudget {
    fn default() -> Self {
        Self::of(SEARCH_STEPS_MAX)
    }
}

impl StepBudget {
    /// A budget of `steps`.
    pub fn of(steps: u64) -> Self {
        Self {
            allowed: steps,
            left: Cell::new(steps),
        }
    }

    /// The number of used steps.
    pub fn spent(&self) -> u64 {
        self.allowed - self.left.get()
    }

    /// The number of remaining steps.
    pub(super) fn left(&self) -> u64 {
        self.left.get()
    }

    /// Sets the number of remaining steps.
    pub(super) fn leave(&self, steps: u64) {
        self.left.set(steps);
    }

    /// Fails if no step is left.
    pub(super) fn check(&self) -> Result<(), OutOfSteps> {
        if self.left() == 0 {
            return Err(OutOfSteps { allowed: self.allowed });
        }
        Ok(())
    }

    /// Uses one step.
    pub(super) fn take(&self) -> Result<(), OutOfSteps> {
        let left = self.left.get().checked_sub(1);
        self.left.set(left.ok_or(OutOfSteps { allowed: self.allowed })?);
        Ok(())
    }
}
