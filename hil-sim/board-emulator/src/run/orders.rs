//! What passes between the caller and the emulator's thread.

use std::collections::VecDeque;

use super::stopped::Stopped;

/// An action where the run stands.
pub(super) type Task = Box<dyn FnOnce(&mut Stopped<'_>) + Send>;

/// An action at each instant that a run passes through.
pub(super) type Watch = Box<dyn FnMut(&mut Stopped<'_>) + Send>;

/// What the caller can order while the run stands still.
pub(super) enum Errand {
    /// Do this where the run stands.
    Do(Task),
    /// Send these bytes down the host link.
    Send(Vec<u8>),
    /// Run through these instants, ascending and in ns, and do this at each.
    Run(VecDeque<u64>, Watch),
    /// End the run.
    End,
}

/// The error that the caller gets when the run has passed the last instant of an order.
#[derive(Debug, Default)]
pub(super) struct Arrival {
    /// Virtual time in ns.
    pub(super) now: u64,
    /// Bytes that came up the host link since the last arrival.
    pub(super) received: Vec<u8>,
}
