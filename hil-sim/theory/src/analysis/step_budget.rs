//! The integration steps that a search may make.

use std::cell::Cell;

/// The most integration steps of a search. The longest search of the thesis and its errata needs 531,542; with this
/// bound every search ends after seconds, whatever the parameters.
pub const SEARCH_STEPS_MAX: u64 = 3_000_000;

/// What is left of the integration steps that a search may make.
#[derive(Debug)]
pub struct StepBudget {
    allowed: u64,
    left: Cell<u64>,
}

/// A search has made all the integration steps that it may make.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the search ended after {allowed} integration steps")]
pub struct OutOfSteps {
    /// How many it may make.
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

    /// The steps made so far.
    pub fn spent(&self) -> u64 {
        self.allowed - self.left.get()
    }

    /// The steps that are left.
    pub(super) fn left(&self) -> u64 {
        self.left.get()
    }

    /// Leaves so many steps.
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

    /// Takes a step.
    pub(super) fn take(&self) -> Result<(), OutOfSteps> {
        let left = self.left.get().checked_sub(1);
        self.left.set(left.ok_or(OutOfSteps { allowed: self.allowed })?);
        Ok(())
    }
}
