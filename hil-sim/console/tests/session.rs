//! A session of the page, without the page: a simulated board, an operator's link, and the bytes between them.

use model::command::Request;
use serde_json::Value;
use vehicle_console::operator_link::OperatorLink;
use vehicle_console::parameter_work::differences;
use vehicle_console::recording::mcap;
use vehicle_console::replay::PageReplay;
use vehicle_console::simulation::{PageScene, Simulation};

/// Board and operator, which exchange bytes every 10 ms.
struct Session {
    board: Simulation,
    link: OperatorLink,
    now_us: u64,
    /// The commanded speed, m/s; the operator is silent without one.
    command: Option<f32>,
    told: Vec<String>,
    status: Value,
    recording: Value,
}

impl Session {
    fn new() -> Self {
        let mut link = OperatorLink::new(5);
        link.operate(true);
        Self {
            board: Simulation::boot(&PageScene::default()).expect("the reference vehicle"),
            link,
            now_us: 0,
            command: Some(0.0),
            told: Vec::new(),
            status: Value::Null,
            recording: Value::Null,
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
            self.recording = heard["recording"].clone();
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

    /// The recording as the MCAP file that the page saves.
    fn take_mcap(&mut self) -> Vec<u8> {
        let vehicle = self.link.parameters().map(vehicle_file::to_toml);
        mcap(&self.link.take_recording(), &vehicle.unwrap_or_default()).expect("written")
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
    // While armed the board refuses, and the page reports that.
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
    // With other gains the replay differs, and reports the first tick that does.
    let other = vehicle_file::REFERENCE.replace("comfort_s = 0.2", "comfort_s = 0.4");
    assert!(
        replay(&other)["differs"]
            .as_str()
            .expect("it differs")
            .contains("differs first in tick")
    );
    assert!(PageReplay::open(b"no records", "").is_err());
}

/// The session as an MCAP file, as `link record` would have written it: it has the log from the boot on, and it replays.
#[test]
fn a_recording_becomes_an_mcap_file_with_its_log() {
    let mut session = Session::new();
    session.run(1.5);
    session.link.record(session.now_us, true);
    session.run(1.0);
    session.arm();
    session.command = Some(0.5);
    session.run(1.0);
    session.link.disarm(session.now_us);
    session.link.record(session.now_us, false);
    assert_eq!(session.recording["complete"], false);
    session.run(0.5);
    assert_eq!(session.recording["complete"], true);
    let ticks = session.recording["ticks"].as_u64().expect("a number");
    let bytes = session.recording["bytes"].as_u64().expect("a number");
    let file = session.take_mcap();
    println!(
        "{ticks} ticks: {:.1} bytes a tick in memory, {:.1} as MCAP",
        bytes as f64 / ticks as f64,
        file.len() as f64 / ticks as f64
    );
    assert!(session.link.take_recording().is_empty(), "the recording is still there");

    let messages: Vec<mcap::Message<'_>> = mcap::MessageStream::new(&file)
        .expect("MCAP")
        .map(|message| message.expect("readable"))
        .collect();
    let of = |topic: &str| -> Vec<Value> {
        let found = messages.iter().filter(|message| message.channel.topic == topic);
        found
            .map(|message| serde_json::from_slice(&message.data).expect("JSON"))
            .collect()
    };
    // A status every 10 ms of 2.1 s, and the terms with each.
    assert!((200..=220).contains(&of("/status").len()), "{}", of("/status").len());
    assert_eq!(of("/terms").len(), of("/status").len());
    assert!(of("/events").iter().any(|event| event["kind"] == "mode"));
    let log: Vec<String> = of("/log").iter().map(|line| line["message"].to_string()).collect();
    for part in ["booted", "gyros calibrated", "armed", "disarmed"] {
        let lines = log
            .iter()
            .filter(|line| line.trim_matches('"').starts_with(part))
            .count();
        assert_eq!(lines, 1, "{part}: {log:?}");
    }
    let read = record_file::parse(&file).expect("readable");
    assert_eq!(read.records().count() as u64, ticks);
    let vehicle = read.boots[0].vehicle.expect("it tells").parameters().cast::<f32>();
    assert_eq!(Some(&vehicle), session.link.parameters());
    // The page replays the file with the file's own vehicle, whatever vehicle it is given.
    let other = vehicle_file::REFERENCE.replace("comfort_s = 0.2", "comfort_s = 0.4");
    let mut replay = PageReplay::open(&file, &other).expect("records");
    let replayed = serde_json::to_value(replay.step(usize::MAX)).expect("JSON");
    assert_eq!(replayed["differs"], Value::Null);
    assert_eq!(replayed["ticks"][0].as_u64(), Some(ticks));
}

/// A board that loses its supply while it is recorded boots again, and the recording continues with the new boot's first tick.
#[test]
fn a_recording_goes_on_when_the_board_has_booted() {
    let mut session = Session::new();
    session.run(1.0);
    session.link.record(session.now_us, true);
    session.run(1.0);
    for (connected, seconds) in [(false, 0.5), (true, 3.0)] {
        let step = format!("action = \"battery-contact\"\nconnected = {connected}");
        session.board.act(&step).expect("a step");
        session.run(seconds);
    }
    assert!(
        session.told.iter().any(|text| text.contains("the board has booted")),
        "{:?}",
        session.told
    );
    session.link.record(session.now_us, false);
    session.run(0.5);
    assert_eq!(session.recording["complete"], true);
    let file = session.take_mcap();
    let read = record_file::parse(&file).expect("readable");
    assert_eq!((read.lost_blocks, read.unreadable), (0, 0));
    let ticks: Vec<u32> = read.records().map(|record| record.tick).collect();
    let again = ticks
        .windows(2)
        .position(|pair| pair[1] != pair[0] + 1)
        .expect("two boots")
        + 1;
    // 2 s of the first boot except its last block, which the board lost with its supply; then the second boot from its first tick.
    assert!((1900..=2001).contains(&again), "{again}");
    assert!(
        ticks[0] == 1 && ticks[again] == 1 && ticks.len() - again > 2500,
        "{} {again}",
        ticks.len()
    );
    assert!(ticks[again..].windows(2).all(|pair| pair[1] == pair[0] + 1));
    for boot in &read.boots {
        let booted = boot.log.iter().filter(|line| line.text.starts_with("booted"));
        assert_eq!(booted.count(), 1, "{:?}", boot.log);
    }
    // The page replays each boot with a vehicle that starts anew.
    let mut replay = PageReplay::open(&file, "").expect("records");
    for (boot, done) in [(1, again), (2, ticks.len())] {
        let replayed = serde_json::to_value(replay.step(usize::MAX)).expect("JSON");
        assert_eq!(replayed["differs"], Value::Null);
        assert_eq!(replayed["boot"], serde_json::json!([boot, 2]));
        assert_eq!(replayed["ticks"], serde_json::json!([done, ticks.len()]));
    }
}
