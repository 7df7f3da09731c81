//! The link's receiving task: bytes to orders.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::Instant;
use embedded_io_async::Read;
use model::command::Request;

use super::session::{Admission, Sessions, is_from_the_future, is_late};
use crate::link::send::status_rate_max_hz;
use crate::protocol::frame::{Decoder, Received};
use crate::protocol::message::{
    About, Answer, Envelope, HostMessage, Identity, LinkCounters, Order, OrderId, PROTOCOL_VERSION, Refusal,
    STATUS_RATE_HZ,
};
use crate::topics::{Answered, Asked, DisarmBy, Topics, UpdateAsked, Wanted};

/// Reads frames for ever and publishes their orders.
pub async fn run<M: RawMutex>(topics: &Topics<M>, mut uart: impl Read, about: About) -> ! {
    let mut decoder = Decoder::new();
    let mut receiver = Receiver {
        topics,
        about,
        sessions: Sessions::new(about.boot),
        counters: LinkCounters::default(),
    };
    let mut bytes = [0; 64];
    loop {
        if let Ok(length) = uart.read(&mut bytes).await {
            let mut received = bytes.get(..length).unwrap_or_default();
            while let Some(received) = decoder.next_of(&mut received) {
                receiver.take(received, Instant::now());
            }
        } else {
            // Bytes were lost, so the next bytes are not the rest of the present frame.
            decoder.resync();
            count(&mut receiver.counters.uart_errors);
        }
        topics.link.publish(Instant::now(), receiver.counters);
    }
}

/// The task's state between frames.
struct Receiver<'a, M: RawMutex> {
    topics: &'a Topics<M>,
    about: About,
    sessions: Sessions,
    counters: LinkCounters,
}

fn count(counter: &mut u32) {
    *counter = counter.wrapping_add(1);
}

impl<M: RawMutex> Receiver<'_, M> {
    fn take(&mut self, received: Received<HostMessage>, now: Instant) {
        match received {
            Received::Nothing => {}
            Received::Bad => count(&mut self.counters.bad_frames),
            Received::Overlong => count(&mut self.counters.overlong_frames),
            Received::Message(message) => {
                count(&mut self.counters.frames);
                match message {
                    // Disarm comes first, whoever the sender is.
                    HostMessage::Disarm(id) => {
                        self.topics.ask_to_disarm(DisarmBy::Host(id));
                        self.sessions.note(id);
                    }
                    HostMessage::Identify { nonce } => self.identify(nonce, now),
                    HostMessage::Order { envelope, order } => match self.sessions.admit(envelope.id) {
                        Admission::Taken => self.obey(envelope, order, now),
                        Admission::Repeated => count(&mut self.counters.repeated_frames),
                        Admission::Foreign => {
                            count(&mut self.counters.foreign_frames);
                            self.refuse(envelope.id, Refusal::UnknownSession);
                        }
                    },
                }
            }
        }
    }

    fn identify(&mut self, nonce: u32, now: Instant) {
        let time_us = now.as_micros();
        let (session, sequence) = self.sessions.offer(nonce, time_us);
        if sequence == 0 {
            // A new host gets the status at the usual rate, whatever the host before it had chosen.
            self.topics.status_rate.put(STATUS_RATE_HZ);
        }
        self.topics.identity.signal(Identity {
            protocol: PROTOCOL_VERSION,
            nonce,
            session,
            sequence,
            time_us,
            about: self.about,
        });
    }

    /// Obeys an order of the session in force that arrived in order.
    fn obey(&mut self, envelope: Envelope, order: Order, now: Instant) {
        let Envelope { id, given_at_us } = envelope;
        let late = is_late(given_at_us, now.as_micros());
        if late {
            count(&mut self.counters.late_orders);
        }
        match order {
            Order::Drive(command) => {
                // A command that is not finite is ignored: the dead-man time continues.
                if !command.is_finite() {
                    count(&mut self.counters.bad_frames);
                } else if !is_from_the_future(given_at_us, now.as_micros()) {
                    // The age of a command counts from the time at which it was given, however long
                    // it was in transit.
                    let given_at = Instant::from_micros(given_at_us).min(now);
                    self.topics.command.publish(given_at, command);
                }
            }
            // Treated like the message Disarm, however late it is.
            Order::Request(Request::Disarm) => {
                self.topics.ask_to_disarm(DisarmBy::Host(id));
            }
            Order::Request(Request::None) => self.answer(id, Answer::Done),
            Order::Request(_) if late => self.refuse(id, Refusal::Late),
            Order::Request(request) => {
                if self.topics.requests.put(request, id) {
                    count(&mut self.counters.dropped_requests);
                }
            }
            Order::Parameters(request) => {
                if self.topics.parameter_requests.try_send(Asked { id, request }).is_err() {
                    count(&mut self.counters.dropped_requests);
                    self.refuse(id, Refusal::Busy);
                }
            }
            Order::StatusRate { hz } => {
                let max_hz = status_rate_max_hz();
                if hz <= max_hz {
                    self.topics.status_rate.put(hz);
                    self.answer(id, Answer::Done);
                } else {
                    self.refuse(id, Refusal::StatusRate { max_hz });
                }
            }
            Order::Recording { from } => {
                self.topics.recording.put(from);
                self.topics.records.stream(from.is_some());
                self.answer(id, Answer::Done);
            }
            Order::Update(request) => {
                if self
                    .topics
                    .update_requests
                    .try_send(UpdateAsked { id, request })
                    .is_err()
                {
                    count(&mut self.counters.dropped_requests);
                    self.refuse(id, Refusal::Busy);
                }
            }
            Order::Read(read) => {
                if self.topics.readings.try_send(Wanted { id, read }).is_err() {
                    count(&mut self.counters.dropped_requests);
                    self.refuse(id, Refusal::Busy);
                }
            }
        }
    }

    fn refuse(&mut self, id: OrderId, refusal: Refusal) {
        self.answer(id, Answer::Refused(refusal));
    }

    /// Leaves an answer to the sending task. A flood of questions loses answers rather than statuses.
    fn answer(&mut self, id: OrderId, answer: Answer) {
        if self.topics.answers.try_send(Answered { id, answer }).is_err() {
            count(&mut self.counters.dropped_answers);
        }
    }
}

#[cfg(test)]
mod tests;
