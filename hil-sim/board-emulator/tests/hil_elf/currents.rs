//! The motors' currents: the board samples them in the middle of the brake, in step with the PWM, reports them as stale without
//! its trigger, and checks them while the bridges are open.

use std::sync::{Arc, Mutex, PoisonError};

use board_emulator::board::{BridgeOutput, MOTORS, SensedAtPins};
use board_emulator::elf::flight;
use board_emulator::run::{Emulation, EmulationSettings};
use board_emulator::vehicle::{BenchVehicle, ClosedPlant};
use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use model::command::Request;
use model::supervise::arming::Mode;
use model::supervise::codes::{Blocker, Fault};

use crate::support::{BATTERY_V, Operator, READY, firmware, ready};

/// TIM1: second control register with the choice of its trigger output, compare value of its sixth channel.
const TRIGGER_CHOICE: u64 = 0x4001_0004;
const TRIGGER_COMPARE: u64 = 0x4001_005C;
/// Timer counts per us, and in the half of a period in which the counter counts up.
const COUNTS_PER_US: f64 = 200.0;
const HALF_PERIOD_COUNTS: f64 = 5_000.0;

/// How many times steeper the currents ripple here than in the real motors, so that small duties show the ripple. Larger duties
/// would spin the wheels of the bench, whose arm does not react, until the vehicle finds its IMU implausible.
const STEEPER: u32 = 5;
/// Slope of a drive motor's current under the whole supply, A per us.
const SLOPE_A_PER_US: f64 = STEEPER as f64 * BATTERY_V / BenchVehicle::INDUCTANCES_H[0] * 1e-6;
/// The pins carry whole mV, of 36 mA each.
const ROUNDING_A: f64 = 0.036;
/// A sample of a drive motor's current lies half of a conversion of 17 cycles at 16 MHz from the middle of the brake, and the
/// converter hears the trigger half a cycle early or late.
const FROM_MIDDLE_US: f64 = 0.5 * (17.0 + 1.0) / 16.0;

/// The vehicle on the bench, which records its sensors' outputs at each step.
struct WatchedBench {
    bench: BenchVehicle,
    shown: Arc<Mutex<Vec<SensedAtPins>>>,
}

impl ClosedPlant for WatchedBench {
    fn step(&mut self, seconds: f64, bridges: &[BridgeOutput; MOTORS]) -> SensedAtPins {
        let mut sensed = self.bench.step(seconds, bridges);
        sensed.current_slope_uv_per_us = sensed.current_slope_uv_per_us.map(|slope| STEEPER * slope);
        self.shown.lock().unwrap_or_else(PoisonError::into_inner).push(sensed);
        sensed
    }

    fn fork(&self) -> Box<dyn ClosedPlant> {
        Box::new(self.bench.clone())
    }
}

/// A reading of a drive motor's current, with the true mean current.
#[derive(Debug, Clone, Copy)]
struct Reading {
    read_a: f64,
    mean_a: f64,
    /// Share of the supply on the motor at the reading, -1 to 1.
    duty: f64,
}

impl Reading {
    fn error_a(&self) -> f64 {
        self.read_a - self.mean_a
    }

    /// Largest error: the current falls under the brake by the duty's share of the slope.
    fn most_a(&self) -> f64 {
        self.duty.abs() * SLOPE_A_PER_US * FROM_MIDDLE_US + ROUNDING_A
    }
}

/// The readings of the left and the right motor's current in a drive of 250 ms forward and 250 ms in reverse, after `before` has
/// acted on the armed board.
fn readings(before: impl FnOnce(&mut Operator)) -> Vec<Reading> {
    const MILLISECONDS: u64 = 250;
    const SPEED_M_S: f32 = 0.8;
    let shown = Arc::new(Mutex::new(Vec::new()));
    let bench = WatchedBench {
        bench: BenchVehicle::new(BATTERY_V),
        shown: shown.clone(),
    };
    let emulation = Emulation::power_on(firmware(), Box::new(bench), EmulationSettings::default());
    let mut board = Operator::new(emulation.expect("the board powers up"));
    board.run(READY / 1_000_000);
    board.arm();
    before(&mut board);
    let address = flight::address(firmware()).expect("the record is the host's");
    shown.lock().expect("nobody panicked").clear();
    let probed = board
        .emulation
        .at(move |stopped| stopped.probe(address, flight::WORDS as u64));
    probed.expect("it runs");
    for command in [SPEED_M_S, -SPEED_M_S] {
        board.command = Some((command, 0.0));
        board.run(MILLISECONDS);
    }
    assert_eq!(
        board.status().vehicle.mode,
        Mode::Armed,
        "{:?}",
        board.status().vehicle.faults
    );
    let words = board.emulation.at(|stopped| stopped.take_probe()).expect("it runs");
    let records: Vec<FlightRecord> = words
        .chunks(flight::WORDS)
        .map(|words| flight::decode(words).expect("a record"))
        .collect();
    let shown = shown.lock().expect("nobody panicked");
    assert_eq!(records.len(), shown.len(), "not one record per step of the vehicle");
    assert!(records.len() > MILLISECONDS as usize);
    // The record that a step finds belongs to the tick before. Its reading is half a tick older still: it was made after the
    // step before the last, with the duties of the tick that followed that step.
    let mut readings = Vec::new();
    for n in 2..records.len() {
        let (record, flown, shown) = (&records[n], &records[n - 1], &shown[n - 2]);
        for (motor, scale) in SCALES.analog.currents().iter().enumerate().take(2) {
            let pin = f64::from(shown.analog_mv.currents()[motor]) * 65536.0 / 3300.0;
            readings.push(Reading {
                read_a: f64::from(scale.value(record.sample.analog.currents()[motor])),
                mean_a: (pin - f64::from(scale.zero_count)) * f64::from(scale.per_count),
                duty: f64::from(flown.actuation.duty[motor]) / f64::from(i16::MAX),
            });
        }
    }
    readings
}

/// The reading with the largest error.
fn worst(readings: &[Reading]) -> Reading {
    let by_error = |a: &&Reading, b: &&Reading| a.error_a().abs().total_cmp(&b.error_a().abs());
    *readings.iter().max_by(by_error).expect("there are readings")
}

/// Driving both ways, a reading is the mean of the current, whatever the duty.
#[test]
fn a_reading_is_the_mean_of_the_current() {
    let readings = readings(|_| {});
    let largest = readings.iter().map(|reading| reading.duty.abs()).fold(0.0, f64::max);
    println!(
        "{} readings, duties up to {largest:.2}, worst {:?}",
        readings.len(),
        worst(&readings)
    );
    // A sample at an edge would show: half of the ripple is several times the allowed error.
    assert!(largest > 0.1, "no duty is large enough for a ripple: {largest}");
    let (forward, reverse): (Vec<Reading>, Vec<Reading>) = readings.iter().partition(|reading| reading.duty > 0.0);
    assert!(forward.len() > 50 && reverse.len() > 50);
    for reading in &readings {
        assert!(
            reading.error_a().abs() <= reading.most_a(),
            "{reading:?}, not {}",
            reading.most_a()
        );
    }
}

/// A trigger elsewhere in the period samples the current there: the check above would notice that.
#[test]
fn a_trigger_at_an_edge_reads_the_ripple() {
    // A quarter of a period before the middle of the brake, which is an edge at half duty.
    const EARLIER_US: f64 = 12.5;
    let readings = readings(|board| {
        let counts = (EARLIER_US + 1.2) * COUNTS_PER_US;
        assert!(counts < HALF_PERIOD_COUNTS);
        write(board, TRIGGER_COMPARE, counts as u32);
    });
    let worst = worst(&readings);
    println!("worst {worst:?}");
    assert!(worst.error_a().abs() > 4.0 * worst.most_a(), "{worst:?}");
    // During the brake the current falls by the duty's share of the slope; before the middle it is above its mean.
    for reading in &readings {
        let expected = reading.duty * SLOPE_A_PER_US * EARLIER_US;
        assert!(
            (reading.error_a() - expected).abs() <= reading.most_a(),
            "{reading:?}, not {expected}"
        );
    }
}

fn write(board: &mut Operator, address: u64, value: u32) {
    let written = board
        .emulation
        .at(move |stopped| stopped.write_register(address, value));
    written.expect("it runs").expect("the register takes it");
}

fn register(board: &mut Operator, address: u64) -> u32 {
    let value = board.emulation.at(move |stopped| stopped.register(address));
    value.expect("it runs").expect("the register answers")
}

/// The converter does not stop on command: no further reading comes, the vehicle stops and does not arm, and the control task, which
/// the task of the inputs could hold up, keeps running. Once the converter stops, the readings return.
#[test]
fn a_converter_that_does_not_stop_is_told_and_hangs_nothing() {
    let mut board = ready();
    board.arm();
    board.act(|board, _| board.part().converter.jam(true));
    board.run(50);
    let status = &board.status().vehicle;
    assert!(status.faults.contains(Fault::AnalogStale), "{}", status.faults);
    assert_ne!(status.mode, Mode::Armed);
    // Longer than the critical tasks may be silent.
    board.run(500);
    let resets = board.emulation.at(|stopped| stopped.resets()).expect("it runs");
    assert_eq!(resets, []);
    assert!(board.status().vehicle.blockers.contains(Blocker::Analog));
    board.act(|board, _| board.part().converter.jam(false));
    board.run(50);
    assert!(!board.status().vehicle.blockers.contains(Blocker::Analog));
}

/// The timer sends no trigger: the last currents grow stale, the status reports that, the vehicle stops and does not arm, and no task
/// hangs. Once the trigger returns, the readings return.
#[test]
fn a_dead_trigger_is_told_and_stops_the_vehicle() {
    for (address, dead) in [(TRIGGER_CHOICE, 0), (TRIGGER_COMPARE, 0)] {
        let mut board = ready();
        board.arm();
        let before = register(&mut board, address);
        assert_ne!(before, dead, "{address:#x}: the firmware has not set the register");
        write(&mut board, address, dead);
        let address_of_record = flight::address(firmware()).expect("the record is the host's");
        let probed = board
            .emulation
            .at(move |stopped| stopped.probe(address_of_record, flight::WORDS as u64));
        probed.expect("it runs");
        board.run(50);
        let words = board.emulation.at(|stopped| stopped.take_probe()).expect("it runs");
        let ages: Vec<u32> = words
            .chunks(flight::WORDS)
            .map(|words| flight::decode(words).expect("a record").sample.analog_age_us)
            .collect();
        assert!(
            ages.windows(2).skip(2).all(|pair| pair[1] > pair[0]),
            "{address:#x}: {ages:?}"
        );
        let status = &board.status().vehicle;
        assert!(
            status.faults.contains(Fault::AnalogStale),
            "{address:#x}: {:?}",
            status.faults
        );
        assert_ne!(status.mode, Mode::Armed);
        // Longer than the critical tasks may be silent.
        board.run(500);
        let resets = board.emulation.at(|stopped| stopped.resets()).expect("it runs");
        assert_eq!(resets, [], "{address:#x}: the task of the inputs hangs");
        assert!(
            board.status().vehicle.blockers.contains(Blocker::Analog),
            "{address:#x}"
        );
        write(&mut board, address, before);
        board.run(50);
        assert!(
            !board.status().vehicle.blockers.contains(Blocker::Analog),
            "{address:#x}"
        );
    }
}

/// The sequence starts at the timer's second trigger, at its rising edge; the timers count up and down.
#[test]
fn the_converter_waits_for_the_timer() {
    const CONFIGURATION: u64 = 0x4002_200C;
    const CONTROLS: [u64; 2] = [0x4001_0000, 0x4001_0400];
    let mut board = ready();
    let configuration = register(&mut board, CONFIGURATION);
    assert_eq!((configuration >> 10 & 3, configuration >> 5 & 0x1F), (1, 10));
    for control in CONTROLS {
        assert_ne!(register(&mut board, control) >> 5 & 3, 0, "{control:#x}");
    }
}

/// The vehicle on the bench with an offset at the sensor of the left motor's current, in mV.
struct MisreadBench {
    bench: BenchVehicle,
    added_mv: u32,
}

impl ClosedPlant for MisreadBench {
    fn step(&mut self, seconds: f64, bridges: &[BridgeOutput; MOTORS]) -> SensedAtPins {
        let mut sensed = self.bench.step(seconds, bridges);
        sensed.analog_mv.left_current += self.added_mv;
        sensed
    }

    fn fork(&self) -> Box<dyn ClosedPlant> {
        Box::new(self.bench.clone())
    }
}

/// The sensors' voltage for a current, in mV.
fn sensor_mv(amperes: f64) -> u32 {
    (amperes / f64::from(SCALES.analog.left_current.per_count) * 3300.0 / 65536.0).round() as u32
}

/// A board that has calibrated its gyros, with an offset of `shown_a` at the sensor of the left motor's current, in A.
fn misread(shown_a: f64) -> Operator {
    let bench = MisreadBench {
        bench: BenchVehicle::new(BATTERY_V),
        added_mv: sensor_mv(shown_a),
    };
    let emulation = Emulation::power_on(firmware(), Box::new(bench), EmulationSettings::default());
    let mut board = Operator::new(emulation.expect("the board powers up"));
    board.run(READY / 1_000_000);
    board
}

/// With every bridge open no current flows: a sensor that shows more than half an ampere keeps the vehicle from arming.
#[test]
fn a_current_at_an_open_bridge_blocks_arming() {
    for (shown_a, blocks) in [(0.4, false), (0.6, true)] {
        let mut board = misread(shown_a);
        board.command = Some((0.0, 0.0));
        board.run(100);
        board.request(Request::Arm);
        let status = &board.status().vehicle;
        assert_eq!(status.blockers.contains(Blocker::CurrentSensor), blocks, "{shown_a} A");
        assert_eq!(status.mode == Mode::Armed, !blocks, "{shown_a} A");
    }
}
