//! A booted board, and an operator at the end of its link.

use std::sync::OnceLock;

use board_emulator::plant::Bench;
use board_emulator::{Emulation, Firmware, Frozen, MS, Settings, build};
use firmware::link::frame::{Decoder, Received, encode};
use firmware::link::message::{BoardMessage, BoardStatus, HostMessage, ParameterAnswer, ParameterRequest};
use model::command::Request;
use model::supervise::arming::Mode;

/// Battery of the vehicle on the bench in V.
pub const BATTERY_V: f64 = 24.0;
/// By then the firmware has calibrated.
pub const READY: u64 = 700 * MS;

/// The firmware under test.
pub fn firmware() -> &'static Firmware {
    build::firmware().expect("the firmware builds")
}

/// A board just powered up, its vehicle on the bench.
pub fn powered() -> Emulation {
    Emulation::power_on(firmware(), Box::new(Bench::new(BATTERY_V)), Settings::default()).expect("the board powers up")
}

/// A board that is ready to arm: booted once, then gone on from as often as asked.
pub fn ready() -> Operator {
    static READY_BOARD: OnceLock<Frozen> = OnceLock::new();
    let frozen = READY_BOARD.get_or_init(|| {
        let mut emulation = powered();
        emulation.run_until(READY).expect("it runs");
        emulation.freeze().expect("it can be frozen")
    });
    Operator::new(frozen.thaw(firmware()).expect("it goes on"))
}

/// Someone at the host's end of the link.
pub struct Operator {
    pub emulation: Emulation,
    decoder: Decoder,
    pub statuses: Vec<BoardStatus>,
    pub protocol: Option<u16>,
    pub answers: Vec<ParameterAnswer>,
    pub bad_frames: u32,
    /// What is being commanded: speed in m/s and yaw rate in rad/s, repeated every 50 ms.
    pub command: Option<(f32, f32)>,
}

impl Operator {
    pub fn new(emulation: Emulation) -> Self {
        Self {
            emulation,
            decoder: Decoder::new(),
            statuses: Vec::new(),
            protocol: None,
            answers: Vec::new(),
            bad_frames: 0,
            command: None,
        }
    }

    pub fn send(&mut self, message: &HostMessage) {
        self.emulation
            .send(&encode(message).expect("it fits"))
            .expect("the wire stands");
    }

    /// Runs on, repeating the command and listening.
    pub fn run(&mut self, milliseconds: u64) {
        let end = self.emulation.now() + milliseconds * MS;
        while self.emulation.now() < end {
            if let Some((speed_m_s, yaw_rate_rad_s)) = self.command {
                self.send(&HostMessage::Drive {
                    speed_m_s,
                    yaw_rate_rad_s,
                });
            }
            self.emulation
                .run_until((self.emulation.now() + 50 * MS).min(end))
                .expect("it runs");
            self.listen();
        }
    }

    pub fn listen(&mut self) {
        for byte in self.emulation.receive() {
            match self.decoder.push(byte) {
                Received::Nothing => {}
                Received::Message(BoardMessage::Status(status)) => self.statuses.push(status),
                Received::Message(BoardMessage::Identity { protocol }) => self.protocol = Some(protocol),
                Received::Message(BoardMessage::Parameters(answer)) => self.answers.push(answer),
                Received::Bad | Received::Overlong => self.bad_frames += 1,
            }
        }
    }

    /// Asks about the parameters and waits for the answer.
    pub fn ask(&mut self, request: ParameterRequest) -> ParameterAnswer {
        self.answers.clear();
        self.send(&HostMessage::Parameters(request));
        for _ in 0..100 {
            self.run(50);
            if let [answer] = self.answers[..] {
                return answer;
            }
            assert!(
                self.answers.is_empty(),
                "one answer to one question: {:?}",
                self.answers
            );
        }
        panic!("no answer to {request:?}");
    }

    /// The latest state the board sent.
    pub fn status(&self) -> &BoardStatus {
        self.statuses.last().expect("the board sends its state")
    }

    /// Arms with speed 0 commanded and makes sure of it.
    pub fn arm(&mut self) {
        self.command = Some((0.0, 0.0));
        self.run(100);
        self.send(&HostMessage::Request(Request::Arm));
        self.run(50);
        let status = &self.status().vehicle;
        assert_eq!(status.mode, Mode::Armed, "{:?}, {:?}", status.blockers, status.faults);
    }

    /// The firmware's log so far.
    pub fn log(&mut self) -> Vec<String> {
        let bytes = self
            .emulation
            .at(|stopped| stopped.log_bytes())
            .expect("it runs")
            .expect("the log is in RAM");
        firmware().decode(&bytes).expect("the log decodes")
    }
}
