//! A booted board, and an operator at the host's end of its link.

use std::io::Write as _;
use std::sync::OnceLock;

use board_emulator::board::{BridgeOutput, DriveBoard, PartSetup};
use board_emulator::elf::{Firmware, build};
use board_emulator::run::{Emulation, EmulationSettings, Frozen};
use board_emulator::time::{Instant, MS};
use board_emulator::vehicle::BenchVehicle;
use firmware::protocol::message::{Answer, BoardStatus, Order, ParameterAnswer, ParameterRequest};
use model::command::{DriveCommand, Request};
use model::supervise::arming::Mode;
use model::supervise::codes::Blocker;
use virtual_board::link_client::LinkClient;

/// Battery voltage of the vehicle on the bench in V.
pub const BATTERY_V: f64 = 24.0;
/// Instant in ns by which the firmware has calibrated.
pub const READY: u64 = 700 * MS;

/// Time within which a board that starts runs its tasks and has answered, ms: the boot loader takes 45 ms, the firmware's
/// self-test and store 60 ms, and the client asks every 50 ms.
pub const STARTED_MS: u64 = 200;

/// The firmware under test. Without it no test can run: the first test to ask for it ends them all, with one
/// message and a failure.
pub fn firmware() -> &'static Firmware {
    build::firmware().unwrap_or_else(|error| {
        // Not `eprintln!`, whose output is lost when the process ends within a test. The lock keeps other tests
        // from repeating the message.
        let mut messages = std::io::stderr().lock();
        let _ = writeln!(messages, "error: {error}");
        std::process::exit(1)
    })
}

/// A board that was just powered up, with its vehicle on the bench.
pub fn powered() -> Emulation {
    Emulation::power_on(
        firmware(),
        Box::new(BenchVehicle::new(BATTERY_V)),
        EmulationSettings::default(),
    )
    .expect("the board powers up")
}

/// A board that has just been powered up, with its own part settings and memory contents.
pub fn powered_part(part: PartSetup, contents: &[(u64, Vec<u8>)]) -> Operator {
    let settings = EmulationSettings {
        part,
        ..EmulationSettings::default()
    };
    let bench = Box::new(BenchVehicle::new(BATTERY_V));
    let emulation = Emulation::power_on_with(firmware(), bench, settings, contents);
    Operator::new(emulation.expect("the board powers up"))
}

/// A board that is ready to arm. It boots once; every call continues from there.
pub fn ready() -> Operator {
    static READY_BOARD: OnceLock<Frozen> = OnceLock::new();
    let frozen = READY_BOARD.get_or_init(|| {
        let mut emulation = powered();
        emulation.run_until(READY).expect("it runs");
        emulation.freeze().expect("a snapshot can be taken")
    });
    Operator::new(frozen.thaw(firmware()).expect("the run continues"))
}

/// Whether every bridge is open.
pub fn open(board: &mut Operator) -> bool {
    let bridges = board.emulation.at(|stopped| stopped.bridges()).expect("it runs");
    bridges == [BridgeOutput::Open; 3]
}

/// Bytes from a xorshift generator: the same noise in every run.
pub fn noise(length: usize, seed: u64) -> Vec<u8> {
    let mut state = seed;
    (0..length)
        .map(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 32) as u8
        })
        .collect()
}

/// An operator at the host's end of the link.
pub struct Operator {
    pub emulation: Emulation,
    pub client: LinkClient,
    pub statuses: Vec<BoardStatus>,
    /// Command that is repeated every 50 ms: speed in m/s and yaw rate in rad/s.
    pub command: Option<(f32, f32)>,
}

impl Operator {
    pub fn new(emulation: Emulation) -> Self {
        Self {
            emulation,
            client: LinkClient::new(1),
            statuses: Vec::new(),
            command: None,
        }
    }

    /// Asks the board to identify itself, if it has not done so yet.
    fn identify(&mut self) {
        if self.client.identity().is_none() {
            self.emulation.send(&self.client.identify()).expect("the wire stands");
        }
    }

    /// Gives an order and returns its number. Before the board has identified itself, sends nothing.
    pub fn order(&mut self, order: Order) -> Option<u32> {
        let now_us = self.emulation.now() / 1000;
        let (sequence, frame) = self.client.order(now_us, order)?;
        self.emulation.send(&frame).expect("the wire stands");
        Some(sequence)
    }

    /// Runs on for a time, repeats the command and receives.
    pub fn run(&mut self, milliseconds: u64) {
        let end = self.emulation.now() + milliseconds * MS;
        while self.emulation.now() < end {
            self.identify();
            if let Some((speed_m_s, yaw_rate_rad_s)) = self.command {
                self.order(Order::Drive(DriveCommand::driving(speed_m_s, yaw_rate_rad_s)));
            }
            self.emulation
                .run_until((self.emulation.now() + 50 * MS).min(end))
                .expect("it runs");
            self.listen();
        }
    }

    pub fn listen(&mut self) {
        let now_us = self.emulation.now() / 1000;
        // Byte by byte, so that every status is seen.
        for byte in self.emulation.receive() {
            self.client.receive(now_us, &[byte]);
            self.statuses.extend(self.client.status.take());
        }
    }

    /// Asks about the parameters and waits for the answer.
    pub fn ask(&mut self, request: ParameterRequest) -> ParameterAnswer {
        if self.client.identity().is_none() {
            self.run(50);
        }
        let sequence = self.order(Order::Parameters(request)).expect("identified");
        for _ in 0..100 {
            self.run(50);
            match self.client.answer_to(sequence) {
                Some(Answer::Parameters(answer)) => return answer,
                Some(other) => panic!("{request:?}: {other:?}"),
                None => {}
            }
        }
        panic!("no answer to {request:?}");
    }

    /// The latest status that the board sent.
    pub fn status(&self) -> &BoardStatus {
        self.statuses.last().expect("the board sends its status")
    }

    /// Arms with speed 0 commanded, and checks that the board is armed.
    pub fn arm(&mut self) {
        self.command = Some((0.0, 0.0));
        self.run(100);
        self.order(Order::Request(Request::Arm));
        self.run(50);
        let status = &self.status().vehicle;
        assert_eq!(status.mode, Mode::Armed, "{:?}, {:?}", status.blockers, status.faults);
    }

    /// Gives a request, and lets the board act on it.
    pub fn request(&mut self, request: Request) {
        self.order(Order::Request(request));
        self.run(50);
    }

    /// Acts on the board at the run's present instant.
    pub fn act(&mut self, act: impl FnOnce(&mut DriveBoard, Instant) + Send + 'static) {
        let acted = self.emulation.at(move |stopped| {
            let (board, now) = stopped.board_now();
            act(board, now);
        });
        acted.expect("it runs");
    }

    /// The firmware's log so far.
    pub fn log(&mut self) -> Vec<String> {
        let bytes = self
            .emulation
            .at(|stopped| stopped.log_bytes(0))
            .expect("it runs")
            .expect("the log is in RAM");
        firmware().decode(&bytes).expect("the log decodes")
    }
}

/// Whether a line of the log contains `text`.
pub fn log_has(board: &mut Operator, text: &str) -> bool {
    board.log().iter().any(|line| line.contains(text))
}

/// Asserts that the board boots, reports this blocker, and refuses to arm because of this blocker alone.
pub fn blocks_alone(board: &mut Operator, blocker: Blocker) {
    board.command = Some((0.0, 0.0));
    board.run(800);
    let told = format!("self-test: {}: ", blocker.name());
    assert!(log_has(board, &told), "{:#?}", board.log());
    board.request(Request::Arm);
    let status = &board.status().vehicle;
    assert_eq!(status.mode, Mode::Disarmed);
    assert_eq!(status.blockers.iter().collect::<Vec<_>>(), [blocker]);
    assert_eq!(status.refused_arms, 1);
    let refused = format!("not armed: {} blocks arming", blocker.name());
    assert!(log_has(board, &refused), "{:#?}", board.log());
}
