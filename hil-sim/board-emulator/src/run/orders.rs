//! What passes between the caller and the emulator's thread.

use std::collections::VecDeque;

use super::stopped::Stopped;

/// An action at the run's present instant.
pub(super) type Task = Box<dyn FnOnce(&mut Stopped<'_>) + Send>;

/// An action at each instant that a run passes.
pub(super) type Watch = Box<dyn FnMut(&mut Stopped<'_>) + Send>;

/// What the caller can order while the run is stopped.
pub(super) enum Errand {
    /// Do this at the present instant.
    Do(Task),
    /// Send these bytes down the host link.
    Send(Vec<u8>),
    /// Run through these ascending instants in ns, and do this at each instant.
    Run(VecDeque<u64>, Watch),
    /// End the run.
    End,
}

/// What the caller receives when the run has reached the last instant of an order.
#[derive(Debug, Default)]
pub(super) struct Arrival {
    /// Virtual time in ns.
    pub(super) now: u64,
    /// Bytes from the host link since the last arrival.
    pub(super) received: Vec<u8>,
}
