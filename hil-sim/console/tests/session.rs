//! A session as the page has it, without the page: a simulated board, an operator's link, bytes between them.

use model::command::Request;
use serde_json::Value;
use vehicle_console::operator_link::OperatorLink;
use vehicle_console::parameter_work::differences;
use vehicle_console::record_work::PageReplay;
use vehicle_console::simulation::{PageWorld, Simulation};

/// Board and operator, 10 ms at a time.
struct Session {
    board: Simulation,
    link: OperatorLink,
    now_us: u64,
    /// What the operator commands; silent if none.
    command: Option<f32>,
    told: Vec<String>,
    status: Value,
}

impl Session {
    fn new() -> Self {
        let mut link = OperatorLink::new(5);
        link.operate(true);
        Self {
            board: Simulation::boot(&PageWorld::default()).expect("the reference vehicle"),
            link,
            now_us: 0,
            command: Some(0.0),
            told: Vec::new(),
            status: Value::Null,
        }
    }

    fn run(&mut self, seconds: f64) {
        for _ in 0..(seconds * 100.0) as u32 {
            if let Some(speed_m_s) = self.command {
                self.link.drive(self.now_us, speed_m_s, 0.0);
            }
            self.board.send(&self.link.poll(self.now_us));
            let said = self.board.run(10);
            self.now_us += 10_000;
            let heard = self.link.receive(self.now_us, &said);
            let heard = serde_json::to_value(&heard).expect("JSON");
            self.told.extend(
                heard["told"]
                    .as_array()
                    .expect("a list")
                    .iter()
                    .map(ToString::to_string),
            );
            if let Some(status) = heard["statuses"].as_array().and_then(|statuses| statuses.last()) {
                self.status = status["vehicle"].clone();
            }
        }
    }

    fn arm(&mut self) {
        self.link.request(self.now_us, Request::Arm);
        self.run(0.1);
        assert_eq!(self.status["mode"], "Armed", "{:?}", self.told);
    }

    fn truth(&mut self) -> Value {
        serde_json::to_value(self.board.look()).expect("JSON")["truth"].clone()
    }
}

#[test]
fn armed_driven_and_fallen_silent() {
    let mut session = Session::new();
    session.run(2.0);
    session.arm();
    session.command = Some(0.5);
    session.run(3.0);
    assert!(session.truth()["x_m"].as_f64().expect("a number") > 1.0);
    session.command = None;
    session.run(0.4);
    assert_eq!(session.status["mode"], "Stopping");
    session.run(5.0);
    assert_eq!(session.status["mode"], "Disarmed");
    assert!(session.truth()["speed_m_s"].as_f64().expect("a number").abs() < 0.05);
}

#[test]
fn parameters_are_read_changed_and_compared() {
    let mut session = Session::new();
    session.run(4.0);
    let set = *session.link.parameters().expect("read by now");
    let number = set.number_of("control", "comfort_s").expect("a parameter");
    let before = vehicle_file::to_toml(&set);
    session.link.change(&[(number, 0.3)]);
    session.run(4.0);
    assert!(
        session.told.iter().any(|text| text.contains("stored and in force")),
        "{:?}",
        session.told
    );
    let set = *session.link.parameters().expect("read again");
    assert_eq!(set.value(number), Some(0.3));
    assert_eq!(differences(&set, &before), Ok(vec![(number, 0.2)]));
    assert!(differences(&set, "nonsense").is_err());
    // Armed, the board refuses, and the page says so.
    session.arm();
    session.link.change(&[(number, 0.2)]);
    session.run(2.0);
    assert!(
        session
            .told
            .iter()
            .any(|text| text.contains("refused: the vehicle is armed")),
        "{:?}",
        session.told
    );
}

#[test]
fn a_recording_drives_again_bit_for_bit_and_a_spoilt_one_says_where_it_differs() {
    let mut session = Session::new();
    session.run(0.3);
    session.link.record(session.now_us, true);
    session.run(2.0);
    session.arm();
    session.command = Some(0.5);
    session.run(2.0);
    let file = session.link.take_recording();
    let replay = |vehicle: &str| {
        let mut replay = PageReplay::open(&file, vehicle).expect("records");
        serde_json::to_value(replay.step(usize::MAX)).expect("JSON")
    };
    let same = replay("");
    assert!(same["ticks"][0].as_u64().expect("a number") > 3500, "{}", same["ticks"]);
    assert_eq!(same["differs"], Value::Null);
    assert_eq!(same["lost_blocks"], 0);
    // Other gains drive otherwise, and the replay says from where on.
    let other = vehicle_file::REFERENCE.replace("comfort_s = 0.2", "comfort_s = 0.4");
    assert!(
        replay(&other)["differs"]
            .as_str()
            .expect("it differs")
            .contains("differs first in tick")
    );
    assert!(PageReplay::open(b"no records", "").is_err());
}
