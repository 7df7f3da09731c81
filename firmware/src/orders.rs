//! The orders that one tick carries out: one request to the arming state machine, and the answers to the host.

use embassy_sync::blocking_mutex::raw::RawMutex;
use model::command::Request;
use model::status::Status;
use model::supervise::arming::Mode;

use crate::protocol::message::{Answer, OrderId, Refusal};
use crate::topics::{DisarmBy, Topics};

/// The operator's request to the arming state machine in one tick.
///
/// A Disarm has priority over all other requests, and cancels an order to arm of the same burst. Every other request
/// comes before Arm, as the operator means them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Orders {
    /// The mode before the tick.
    mode: Mode,
    /// The Disarm, if any.
    disarm: Option<DisarmBy>,
    /// The request that the host orders, and the order.
    ordered: Option<(Request, OrderId)>,
}

impl Orders {
    /// Takes the orders of this tick; `mode` is the mode before the tick. All other orders stay in their slots.
    pub fn take<M: RawMutex>(topics: &Topics<M>, mode: Mode) -> Self {
        let disarm = topics.disarm.take();
        let take = |request: Request| topics.requests.take(request).map(|id| (request, id));
        let ordered = if disarm.is_some() {
            take(Request::Arm)
        } else {
            // In reverse order, because Arm has the least number.
            Request::ALL.iter().rev().copied().find_map(take)
        };
        Self { mode, disarm, ordered }
    }

    /// The request of this tick.
    pub fn request(&self) -> Request {
        if self.disarm.is_some() {
            Request::Disarm
        } else {
            self.ordered.map_or(Request::None, |(request, _)| request)
        }
    }

    /// Answers every order of the tick that led to `status`. An answer without room in the channel is dropped,
    /// because the tick never waits.
    pub fn answer<M: RawMutex>(&self, topics: &Topics<M>, status: &Status) {
        let answer = |id: OrderId, answer: Answer| topics.answer_of_the_tick(id, answer);
        if let Some(DisarmBy::Host(id)) = self.disarm {
            answer(id, Answer::Done);
        }
        match self.ordered {
            None => {}
            Some((Request::Arm, id)) => answer(id, self.of_arming(status)),
            // The state machine accepts every other request only while disarmed.
            Some((_, id)) if self.mode == Mode::Disarmed => answer(id, Answer::Done),
            Some((_, id)) => answer(id, Answer::Refused(Refusal::NotDisarmed)),
        }
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

#[cfg(test)]
mod tests;
