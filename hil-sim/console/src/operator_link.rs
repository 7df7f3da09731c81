//! The operator's end of the link for the page: bytes in and out, for any board.

use firmware::protocol::message::{Answer, BoardStatus, Order, ParameterAnswer, Read, Reading, Refusal};
use model::command::{DriveCommand, Request};
use model::vehicle::VehicleParameters;
use virtual_board::link_client::{AGAIN_US, ANSWER_US, LinkClient, board_kind};
use virtual_board::words::{log_line, refusal_words};

use crate::heard::{Heard, HostCounters, board_words};
use crate::parameter_work::{ParameterWork, WorkProgress};
use crate::recording::{Recording, newer};

/// Time between two reads of the log, us.
const LOG_US: u64 = 400_000;
/// Time within which the log's last lines arrive after a recording has ended, us.
const LAST_LINES_US: u64 = 1_000_000;

/// An order that waits for its answer.
#[derive(Debug, Clone, Copy)]
struct Given {
    sequence: u32,
    what: &'static str,
    at_us: u64,
}

/// The operator's end of the link. Times are the host's, in us from any fixed start.
#[derive(Debug)]
pub struct OperatorLink {
    client: LinkClient,
    outbox: Vec<u8>,
    identify_us: Option<u64>,
    boot: Option<u32>,
    /// The boot in which the board refused this host's session.
    refused_boot: Option<u32>,
    /// Whether this host gives orders. Otherwise it only listens, and may disarm.
    operates: bool,
    given: Vec<Given>,
    log_next: u32,
    log_asked: Option<Given>,
    work: Option<ParameterWork>,
    parameters: Option<VehicleParameters<f32>>,
    /// Number of complete reads of the set.
    parameters_read: u32,
    recording: Option<Recording>,
    /// Whether the stream of records must be requested again, because the board booted during the
    /// recording.
    stream_unasked: bool,
    told: Vec<String>,
    log: Vec<String>,
}

impl OperatorLink {
    /// An operator who has not sent anything yet. `nonce` is a number that no host has used before on this
    /// board.
    pub fn new(nonce: u32) -> Self {
        Self {
            client: LinkClient::new(nonce),
            // A zero ends a half-sent frame on the wire.
            outbox: vec![0],
            identify_us: None,
            boot: None,
            refused_boot: None,
            operates: false,
            given: Vec::new(),
            log_next: 0,
            log_asked: None,
            work: None,
            parameters: None,
            parameters_read: 0,
            recording: None,
            stream_unasked: false,
            told: Vec::new(),
            log: Vec::new(),
        }
    }

    /// Lets this host give orders from now on, or only listen.
    pub fn operate(&mut self, operates: bool) {
        self.operates = operates;
        self.refused_boot = None;
    }

    /// Takes bytes from the board, which arrived at `now_us`.
    pub fn receive(&mut self, now_us: u64, bytes: &[u8]) -> Heard {
        let mut statuses = Vec::new();
        // Frame by frame: the client keeps only the newest status.
        for frame in bytes.split_inclusive(|byte| *byte == 0) {
            let known = self.client.identity().map(|identity| identity.about.boot);
            self.client.receive(now_us, frame);
            statuses.extend(self.client.status.take());
            match self.client.identity().map(|identity| identity.about.boot) {
                None if known.is_some() => self.refused_boot = known,
                Some(boot) if known.is_none() => self.meet(boot),
                _ => {}
            }
        }
        self.take_answers(now_us);
        self.record_on(now_us, &statuses);
        self.heard(statuses)
    }

    /// Records the received frames. A full recording ends the stream, and is then saved or dropped.
    fn record_on(&mut self, now_us: u64, statuses: &[BoardStatus]) {
        let Some(recording) = &mut self.recording else { return };
        recording.take(&mut self.client.records, statuses);
        let counts = recording.counts;
        if counts.full && recording.goes_on() {
            self.told.push(format!(
                "the recording is full: it ends here, with {} MB and {:.0} s; what follows is not recorded",
                counts.bytes / 1_000_000,
                counts.ticks as f64 / 1000.0
            ));
            self.record(now_us, false);
        } else if let Some(ended_us) = recording.ended_us
            && !counts.complete
            && now_us.saturating_sub(ended_us) > LAST_LINES_US
        {
            recording.counts.complete = true;
            self.told
                .push("recording: the board has not told the last lines of its log".to_owned());
        }
    }

    fn meet(&mut self, boot: u32) {
        if self.boot != Some(boot) {
            if self.boot.is_some() {
                self.told.push("the board has booted".to_owned());
            }
            self.boot = Some(boot);
            self.log_next = 0;
            self.work = None;
            self.parameters = None;
            if let (Some(recording), Some(identity)) = (&mut self.recording, self.client.identity()) {
                self.stream_unasked = recording.goes_on();
                if self.stream_unasked {
                    recording.meet(identity);
                } else {
                    recording.counts.complete = true;
                }
            }
        } else if self.refused_boot == Some(boot) && self.operates {
            self.operates = false;
            self.told
                .push("another operator drives this board: this page watches, and can only disarm".to_owned());
        }
        self.refused_boot = None;
        self.given.clear();
        self.log_asked = None;
    }

    fn take_answers(&mut self, now_us: u64) {
        let Self { client, told, .. } = self;
        self.given.retain(|given| match client.answer_to(given.sequence) {
            Some(Answer::Refused(Refusal::UnknownSession)) => false,
            Some(Answer::Refused(refusal)) => {
                told.push(refusal_words(refusal));
                false
            }
            Some(_) => false,
            None if now_us.saturating_sub(given.at_us) > ANSWER_US => {
                told.push(format!("the board did not answer {}", given.what));
                false
            }
            None => true,
        });
        if let Some(asked) = self.log_asked
            && let Some(Reading::Log(block)) = self.client.reading_of(asked.sequence)
        {
            self.log_asked = None;
            if block.first > self.log_next {
                let gone = block.first - self.log_next;
                self.log.push(format!("({gone} older lines are gone)"));
            }
            let new = newer(&block, self.log_next);
            self.log.extend(new.lines.iter().map(log_line));
            self.log_next = new.first.saturating_add(new.lines.len() as u32);
            if let Some(recording) = &mut self.recording {
                recording.take_log(&block);
                let since_end = recording.ended_us.is_some_and(|ended_us| asked.at_us >= ended_us);
                recording.counts.complete |= since_end && block.lines.is_empty();
            }
        }
        let Some(work) = &mut self.work else { return };
        let answer = work.awaited().and_then(|sequence| self.client.answer_to(sequence));
        let progress = match answer {
            Some(Answer::Parameters(ParameterAnswer::Value { schema, .. }))
                if Some(schema) != self.client.identity().map(|identity| identity.about.schema) =>
            {
                WorkProgress::Failed("the board answered of other parameters than it has".to_owned())
            }
            Some(Answer::Parameters(answer)) => work.answered(&answer),
            Some(Answer::Refused(refusal)) => WorkProgress::Failed(refusal_words(refusal)),
            Some(Answer::Done | Answer::Update(_)) => {
                WorkProgress::Failed("a strange answer about parameters".to_owned())
            }
            None => work.late(now_us),
        };
        match progress {
            WorkProgress::GoesOn => {}
            WorkProgress::Failed(why) => {
                self.told.push(format!("parameters: {why}"));
                // The set in force is no longer known; the last known set remains.
                self.parameters.get_or_insert(work.set());
                self.work = None;
            }
            WorkProgress::Done(stored) => {
                self.parameters = Some(work.set());
                self.parameters_read += 1;
                if stored {
                    self.told.push("parameters: the set is stored and in force".to_owned());
                }
                self.work = None;
            }
        }
    }

    fn heard(&mut self, statuses: Vec<BoardStatus>) -> Heard {
        Heard {
            board: self.client.identity().map(board_words),
            foreign: self.client.foreign().map(|identity| identity.protocol),
            statuses,
            told: std::mem::take(&mut self.told),
            log: std::mem::take(&mut self.log),
            operates: self.operates,
            parameter_work: self.work.as_ref().map(ParameterWork::share),
            parameters_read: self.parameters_read,
            recording: self.recording.as_ref().map(|recording| recording.counts),
            quality: HostCounters::of(&self.client),
        }
    }

    /// Sends every question that is due at `now_us` and returns the bytes for the board.
    pub fn poll(&mut self, now_us: u64) -> Vec<u8> {
        if self.client.identity().is_none() {
            if self.identify_us.is_none_or(|at| now_us.saturating_sub(at) >= AGAIN_US) {
                self.outbox.extend(self.client.identify());
                self.identify_us = Some(now_us);
            }
        } else if self.operates {
            self.read_on(now_us);
        }
        std::mem::take(&mut self.outbox)
    }

    /// Reads the log and works on the parameters.
    fn read_on(&mut self, now_us: u64) {
        if std::mem::take(&mut self.stream_unasked) {
            let sequence = self.order(now_us, Order::Recording { from: Some(0) });
            self.give(sequence, "Recording", now_us);
        }
        if self
            .log_asked
            .is_none_or(|asked| now_us.saturating_sub(asked.at_us) >= LOG_US)
            && let Some(sequence) = self.order(now_us, Order::Read(Read::Log { from: self.next_line() }))
        {
            self.log_asked = Some(Given {
                sequence,
                what: "Log",
                at_us: now_us,
            });
        }
        if self.work.is_none() && self.parameters.is_none() {
            self.work = self.kind().as_ref().map(ParameterWork::reading);
        }
        let question = self.work.as_mut().and_then(|work| work.question(now_us));
        if let Some(question) = question
            && let Some(sequence) = self.order(now_us, Order::Parameters(question))
            && let Some(work) = &mut self.work
        {
            work.was_asked(sequence, now_us);
        }
    }

    /// The next line of the log to read: the page's next line, or an older line that a recording still
    /// needs.
    fn next_line(&self) -> u32 {
        let recorded = self.recording.as_ref().filter(|recording| !recording.counts.complete);
        recorded.map_or(self.log_next, |recording| recording.next_line.min(self.log_next))
    }

    fn kind(&self) -> Option<VehicleParameters<f32>> {
        board_kind(self.client.identity()?.about.schema)
    }

    fn order(&mut self, now_us: u64, order: Order) -> Option<u32> {
        let (sequence, frame) = self.client.order(now_us, order)?;
        self.outbox.extend(frame);
        Some(sequence)
    }

    /// Commands speed, m/s, and yaw rate, rad/s. Does nothing while this host only listens.
    pub fn drive(&mut self, now_us: u64, speed_m_s: f32, yaw_rate_rad_s: f32) {
        if self.operates {
            self.order(now_us, Order::Drive(DriveCommand::driving(speed_m_s, yaw_rate_rad_s)));
        }
    }

    /// Opens the bridges, whoever drives and whatever the board has sent.
    pub fn disarm(&mut self, now_us: u64) {
        let (sequence, frame) = self.client.disarm();
        // A zero ends a half-sent frame on the wire.
        self.outbox.push(0);
        self.outbox.extend(frame);
        self.give(Some(sequence), "Disarm", now_us);
    }

    /// Sends this request to the arming state machine.
    pub fn request(&mut self, now_us: u64, request: Request) {
        let sequence = self.order(now_us, Order::Request(request));
        self.give(sequence, request.name(), now_us);
    }

    fn give(&mut self, sequence: Option<u32>, what: &'static str, at_us: u64) {
        match sequence {
            Some(sequence) => self.given.push(Given { sequence, what, at_us }),
            None => self.told.push(format!("{what}: the board has not said who it is")),
        }
    }

    /// The set in force, as it was last read.
    pub fn parameters(&self) -> Option<&VehicleParameters<f32>> {
        self.parameters.as_ref()
    }

    /// Changes these parameters in the board and stores the set. Without changes, reads the set again.
    pub fn change(&mut self, changes: &[(u16, f32)]) {
        self.begin_work(|set| {
            if changes.is_empty() {
                ParameterWork::reading(set)
            } else {
                ParameterWork::changing(set, changes)
            }
        });
    }

    /// Restores the firmware's built-in set.
    pub fn built_in(&mut self) {
        self.begin_work(ParameterWork::built_in);
    }

    fn begin_work(&mut self, begin: impl FnOnce(&VehicleParameters<f32>) -> ParameterWork) {
        match (self.parameters.or_else(|| self.kind()), &self.work) {
            (Some(set), None) => self.work = Some(begin(&set)),
            _ => self.told.push("parameters: the board is not ready for them".to_owned()),
        }
    }

    /// Begins a recording, from the oldest block that the board still has, or ends the stream.
    pub fn record(&mut self, now_us: u64, on: bool) {
        let from = on.then_some(0);
        if on {
            self.client.records.clear();
            self.recording = self.client.identity().map(Recording::begin);
        } else if let Some(recording) = &mut self.recording {
            recording.ended_us.get_or_insert(now_us);
        }
        let sequence = self.order(now_us, Order::Recording { from });
        self.give(sequence, "Recording", now_us);
    }

    /// Takes the recording: the bytes of its file of frames.
    pub fn take_recording(&mut self) -> Vec<u8> {
        self.recording.take().map(Recording::into_frames).unwrap_or_default()
    }
}
