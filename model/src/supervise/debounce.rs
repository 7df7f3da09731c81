//! Faults whose cause must be present for some ticks in a row.

use super::codes::Fault;
use crate::persistence::persists;

/// For how many ticks in a row the cause of each debounced fault has been present.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Debounce {
    runs: [u16; Fault::DEBOUNCED],
}

impl Debounce {
    /// Takes one tick's verdict on the cause of `fault`; true once the cause has been present for its
    /// [`Fault::debounce_ticks`].
    #[inline]
    pub fn update(&mut self, fault: Fault, present: bool) -> bool {
        let Some(run) = self.run(fault) else { return present };
        persists(run, present, fault.debounce_ticks())
    }

    /// This, with the run of one fault's cause as `other` has it.
    #[must_use]
    pub fn with_run_of(mut self, fault: Fault, mut other: Self) -> Self {
        if let (Some(run), Some(other)) = (self.run(fault), other.run(fault)) {
            *run = *other;
        }
        self
    }

    /// The run of a debounced fault.
    #[inline]
    fn run(&mut self, fault: Fault) -> Option<&mut u16> {
        (fault.debounce_ticks() > 1).then(|| self.runs.get_mut(fault.debounce_place()))?
    }
}
