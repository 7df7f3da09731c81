//! A conversation with the board over one wire: the board's identity, orders and their answers, silence.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use firmware::protocol::message::{
    Answer, BoardStatus, Identity, Order, PROTOCOL_VERSION, ParameterAnswer, ParameterRequest, Refusal, UpdateRequest,
};
use model::supervise::arming::Mode;
use report::error::CommandError;
use virtual_board::link_client::{AGAIN_US, ANSWER_US, LinkClient, STORE_US};
use virtual_board::words::{not_changed_words, refusal_words};

use super::wire::Wire;

/// Time without a message from the board after which the board counts as silent, us.
pub const SILENCE_US: u64 = 300_000;

/// A conversation over one wire.
pub struct Link<W> {
    pub(in crate::cli) wire: W,
    pub(in crate::cli) client: LinkClient,
    /// Number of the user's requests to stop (Ctrl-C).
    interrupts: Arc<AtomicU32>,
    /// Time since which the tool waits for the board's first message, us.
    since_us: u64,
}

impl<W: Wire> Link<W> {
    /// A conversation over `wire`. `nonce` is a number that no host has used before on this board; `interrupts` counts
    /// the user's requests to stop.
    pub fn new(wire: W, nonce: u32, interrupts: Arc<AtomicU32>) -> Self {
        let since_us = wire.now_us();
        Self {
            wire,
            client: LinkClient::new(nonce),
            interrupts,
            since_us,
        }
    }

    /// Number of the user's requests to stop.
    pub(in crate::cli) fn interrupts(&self) -> u32 {
        self.interrupts.load(Ordering::Relaxed)
    }

    /// Takes the bytes that have arrived, and checks whether the board still sends.
    ///
    /// # Errors
    /// The wire is lost, or the board is silent.
    pub(in crate::cli) fn listen(&mut self) -> Result<(), CommandError> {
        let mut bytes = [0; 4096];
        let length = self.wire.receive(&mut bytes)?;
        let now_us = self.wire.now_us();
        self.client.receive(now_us, &bytes[..length]);
        let heard_us = self.client.heard_us.unwrap_or(0).max(self.since_us);
        if now_us.saturating_sub(heard_us) < SILENCE_US {
            return Ok(());
        }
        let ms = SILENCE_US / 1000;
        Err(CommandError::Checks(match self.client.heard_us {
            Some(_) => format!("the board is silent: nothing readable for {ms} ms"),
            None => format!("no identity from the board within {ms} ms: is it powered, flashed, and this its port?"),
        }))
    }

    /// Asks for the board's identity.
    ///
    /// # Errors
    /// No answer, or a firmware with another protocol version.
    pub fn identify(&mut self) -> Result<Identity, CommandError> {
        // A zero ends a half-sent frame on the wire.
        self.wire.send(&[0])?;
        self.since_us = self.wire.now_us();
        let mut asked_us = None;
        loop {
            self.ask_again(&mut asked_us)?;
            self.listen()?;
            if let Some(identity) = self.client.identity() {
                return Ok(*identity);
            }
            if let Some(foreign) = self.client.foreign() {
                let protocol = foreign.protocol;
                return Err(CommandError::Checks(format!(
                    "the board speaks protocol {protocol}, this tool {PROTOCOL_VERSION}"
                )));
            }
        }
    }

    /// Asks for the board's identity if a question is due.
    fn ask_again(&mut self, asked_us: &mut Option<u64>) -> Result<(), CommandError> {
        let now_us = self.wire.now_us();
        if self.client.identity().is_none() && asked_us.is_none_or(|at| now_us - at >= AGAIN_US) {
            self.wire.send(&self.client.identify())?;
            *asked_us = Some(now_us);
        }
        Ok(())
    }

    /// Gives an order and returns its number.
    ///
    /// # Errors
    /// The board has booted since it sent its identity, or another host has taken over.
    pub(in crate::cli) fn give(&mut self, order: Order) -> Result<u32, CommandError> {
        let (sequence, frame) = self
            .client
            .order(self.wire.now_us(), order)
            .ok_or_else(|| refused(Refusal::UnknownSession))?;
        self.wire.send(&frame)?;
        Ok(sequence)
    }

    /// Gives an order and waits for its answer; `meanwhile` runs during the wait.
    ///
    /// # Errors
    /// No answer in time, silence, or an error of `meanwhile`.
    pub(in crate::cli) fn ask_while(
        &mut self,
        order: Order,
        mut meanwhile: impl FnMut(&mut Self) -> Result<(), CommandError>,
    ) -> Result<Answer, CommandError> {
        let slow = [UpdateRequest::Install, UpdateRequest::State];
        let within_us = if match order {
            Order::Parameters(request) => request == ParameterRequest::Store,
            Order::Update(request) => matches!(request, UpdateRequest::Begin(_)) || slow.contains(&request),
            _ => false,
        } {
            STORE_US
        } else {
            ANSWER_US
        };
        let asked_us = self.wire.now_us();
        let sequence = self.give(order)?;
        while self.wire.now_us() - asked_us < within_us {
            meanwhile(self)?;
            self.listen()?;
            if let Some(answer) = self.client.answer_to(sequence) {
                return Ok(answer);
            }
        }
        Err(CommandError::Checks(format!(
            "the board did not answer {} within {} ms",
            name(&order),
            within_us / 1000
        )))
    }

    /// Gives an order and waits until the board has carried it out.
    ///
    /// # Errors
    /// The board refuses, does not answer in time, or is silent.
    pub fn order(&mut self, order: Order) -> Result<(), CommandError> {
        match self.ask_while(order, |_| Ok(()))? {
            Answer::Refused(refusal) => Err(refused(refusal)),
            _ => Ok(()),
        }
    }

    /// Sends one parameter request.
    ///
    /// # Errors
    /// No answer, or an answer that does not fit the request.
    pub fn ask(&mut self, request: ParameterRequest) -> Result<ParameterAnswer, CommandError> {
        match self.ask_while(Order::Parameters(request), |_| Ok(()))? {
            Answer::Parameters(answer) => Ok(answer),
            Answer::Refused(refusal) => Err(refused(refusal)),
            Answer::Done | Answer::Update(_) => Err(CommandError::Checks(format!("a strange answer to {request:?}"))),
        }
    }

    /// The first status that arrives from now on.
    ///
    /// # Errors
    /// Silence.
    pub(in crate::cli) fn fresh_status(&mut self) -> Result<BoardStatus, CommandError> {
        self.client.status = None;
        loop {
            self.listen()?;
            if let Some(status) = self.client.status {
                return Ok(status);
            }
        }
    }

    /// Asks for the board's identity for some time; returns the identity once the board is in another boot than number
    /// `boot`. A board without power is silent, which is not an error here.
    ///
    /// # Errors
    /// The wire is lost.
    pub(in crate::cli) fn other_boot(&mut self, boot: u32) -> Result<Option<Identity>, CommandError> {
        self.wire.send(&[0])?;
        self.wire.send(&self.client.identify())?;
        let from_us = self.wire.now_us();
        while self.wire.now_us() - from_us < AGAIN_US {
            let mut bytes = [0; 4096];
            let length = self.wire.receive(&mut bytes)?;
            self.client.receive(self.wire.now_us(), &bytes[..length]);
            if let Some(identity) = self.client.identity()
                && identity.about.boot != boot
            {
                // The silence before the identity no longer counts.
                self.since_us = self.wire.now_us();
                return Ok(Some(*identity));
            }
        }
        Ok(None)
    }

    /// Opens the bridges: first sends Disarm, whatever the board has sent, and then waits until the board confirms
    /// that it is disarmed.
    ///
    /// # Errors
    /// The Disarm has been sent, and the board did not confirm it.
    pub fn disarm(&mut self) -> Result<(), CommandError> {
        // A zero ends a half-sent frame on the wire.
        self.wire.send(&[0])?;
        let since_us = self.wire.now_us();
        self.since_us = since_us;
        let (mut sent_us, mut asked_us, mut numbers) = (None, None, Vec::new());
        let mut done = false;
        while self.wire.now_us() - since_us < SILENCE_US {
            let now_us = self.wire.now_us();
            if sent_us.is_none_or(|at| now_us - at >= AGAIN_US) {
                let (number, frame) = self.client.disarm();
                self.wire.send(&frame)?;
                numbers.push(number);
                sent_us = Some(now_us);
            }
            self.ask_again(&mut asked_us)?;
            if !done && numbers.iter().any(|number| self.client.answer_to(*number).is_some()) {
                done = true;
                self.client.status = None;
            }
            if self.listen().is_err() {
                break;
            }
            if done
                && let Some(status) = self.client.status
                && status.vehicle.mode == Mode::Disarmed
            {
                return Ok(());
            }
        }
        Err(CommandError::Checks(
            "Disarm was sent, and the board did not confirm it".into(),
        ))
    }
}

/// Name of an order in messages.
fn name(order: &Order) -> &'static str {
    match order {
        Order::Drive(_) => "Drive",
        Order::Request(request) => request.name(),
        Order::Parameters(_) => "a question about parameters",
        Order::StatusRate { .. } => "StatusRate",
        Order::Recording { .. } => "Recording",
        Order::Read(_) => "a question about its memory",
        Order::Update(_) => "a request about its update",
    }
}

/// The error that explains a refusal to the user.
pub(super) fn refused(refusal: Refusal) -> CommandError {
    CommandError::Checks(refusal_words(refusal))
}

/// The error for a parameter change that the board did not make.
pub(super) fn not_changed(answer: &ParameterAnswer) -> CommandError {
    CommandError::Checks(not_changed_words(answer))
}
