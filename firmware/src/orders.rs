//! The orders that one tick carries out: one request to the arming state machine, and the answers to the host.

use embassy_sync::blocking_mutex::raw::RawMutex;
use model::command::Request;
use model::status::Status;
use model::supervise::arming::Mode;

use crate::protocol::message::{Answer, OrderId, Refusal};
use crate::topics::{Answered, DisarmBy, Topics};

/// What the operator wants of the arming state machine in one tick.
///
/// A Disarm comes before everything else, and an order to arm that came in the same burst does not outlive it.
/// ClearFaults comes before Arm, as an operator means them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Orders {
    /// The mode before the tick.
    mode: Mode,
    /// The Disarm, if there is one.
    disarm: Option<DisarmBy>,
    /// The order to clear faults.
    clear_faults: Option<OrderId>,
    /// The order to arm.
    arm: Option<OrderId>,
}

impl Orders {
    /// Takes the orders of this tick; `mode` is the mode before it. Whatever is not for this tick stays.
    pub fn take<M: RawMutex>(topics: &Topics<M>, mode: Mode) -> Self {
        let disarm = topics.disarm.take();
        let clear_faults = if disarm.is_none() {
            topics.clear_faults.take()
        } else {
            None
        };
        let arm = if clear_faults.is_none() {
            topics.arm.take()
        } else {
            None
        };
        Self {
            mode,
            disarm,
            clear_faults,
            arm,
        }
    }

    /// The request of this tick.
    pub fn request(&self) -> Request {
        if self.disarm.is_some() {
            Request::Disarm
        } else if self.clear_faults.is_some() {
            Request::ClearFaults
        } else if self.arm.is_some() {
            Request::Arm
        } else {
            Request::None
        }
    }

    /// Answers every order of the tick that led to `status`. An answer that finds no room is dropped: the tick waits
    /// for nobody.
    pub fn answer<M: RawMutex>(&self, topics: &Topics<M>, status: &Status) {
        let answer = |id: Option<OrderId>, answer: Answer| {
            if let Some(id) = id {
                let _ = topics.answers.try_send(Answered { id, answer });
            }
        };
        if let Some(DisarmBy::Host(id)) = self.disarm {
            answer(Some(id), Answer::Done);
        }
        answer(
            self.clear_faults,
            if self.mode == Mode::Disarmed {
                Answer::Done
            } else {
                Answer::Refused(Refusal::NotDisarmed)
            },
        );
        answer(self.arm, self.of_arming(status));
    }

    /// The answer to an order to arm.
    fn of_arming(&self, status: &Status) -> Answer {
        if self.disarm.is_some() {
            return Answer::Refused(Refusal::Disarmed);
        }
        match status.mode {
            Mode::Armed => Answer::Done,
            Mode::Stopping => Answer::Refused(Refusal::Stopping),
            Mode::Disarmed => Answer::Refused(Refusal::Blocked(status.blockers)),
        }
    }
}
