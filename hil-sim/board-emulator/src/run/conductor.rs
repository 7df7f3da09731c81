//! The emulator's side of a run: carries out the caller's orders between two instructions.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender};

use rigless::emulator::{Driver, Host, Settled, Stop};
use rigless::session::Session;
use rigless::time::VirtualNanos;

use super::orders::{Arrival, Errand, Watch};
use super::state::EmulationState;
use super::stopped::Stopped;
use crate::board::DriveBoard;
use crate::error::Error;

/// The emulator's side of a run.
pub(super) struct Conductor {
    state: EmulationState,
    orders: Receiver<Errand>,
    arrivals: Sender<Arrival>,
    /// Instants still to run through, in ns.
    instants: VecDeque<u64>,
    /// What to do at each of them.
    watch: Watch,
    digest: [u8; 32],
}

impl Conductor {
    pub(super) fn new(
        state: EmulationState,
        orders: Receiver<Errand>,
        arrivals: Sender<Arrival>,
        digest: [u8; 32],
    ) -> Self {
        Self {
            state,
            orders,
            arrivals,
            instants: VecDeque::new(),
            watch: Box::new(|_| {}),
            digest,
        }
    }

    /// The first failure of the run, if it failed.
    pub(super) fn finish(self) -> Result<(), Error> {
        self.state.outcome()
    }

    /// Carries out orders until an order lets the run continue. `None` when the run is to end.
    fn take_orders(&mut self, session: &mut Session<DriveBoard>, stop: Stop, host: &mut dyn Host) -> Option<()> {
        loop {
            // A caller that no longer exists cannot send an order to end the run.
            match self.orders.recv().unwrap_or(Errand::End) {
                Errand::Do(task) => task(&mut Stopped {
                    session,
                    host,
                    state: &mut self.state,
                    stop,
                    digest: &self.digest,
                }),
                Errand::Send(bytes) => session.board_mut().wire().send(&bytes),
                Errand::Run(instants, watch) => {
                    self.instants = instants;
                    self.watch = watch;
                    return Some(());
                }
                Errand::End => return None,
            }
        }
    }
}

impl Driver<DriveBoard> for Conductor {
    fn on_settled(&mut self, session: &mut Session<DriveBoard>, _: &mut dyn Host, settled: Settled) {
        match settled {
            Settled::Access { access, .. } => self.state.on_access(session, &access),
            Settled::Stop(_) => self.state.stops += 1,
            // A breakpoint hit cannot happen: no instruction is watched.
            _ => {}
        }
    }

    fn on_stop(&mut self, session: &mut Session<DriveBoard>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        let now = stop.at.0;
        self.state.on_stop(session, stop, host);
        if self.state.failed() {
            return None;
        }
        loop {
            while let Some(&instant) = self.instants.front() {
                if now < instant {
                    return Some(VirtualNanos(instant.min(self.state.next_step())));
                }
                self.instants.pop_front();
                (self.watch)(&mut Stopped {
                    session,
                    host,
                    state: &mut self.state,
                    stop,
                    digest: &self.digest,
                });
            }
            // No instant is left: the run has reached the last instant of the order.
            let received = session.board_mut().wire().take();
            self.arrivals.send(Arrival { now, received }).ok()?;
            self.take_orders(session, stop, host)?;
        }
    }
}
