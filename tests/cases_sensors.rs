//! Failures of sensors, motors and wiring that comparable machines have not noticed: scenarios on the virtual board, each kind at
//! several values and seeds.

use firmware::drive_board::SCALES;
use model::supervise::arming::Mode;
use model::supervise::codes::{Blocker, Fault, FaultSet};
use virtual_board::scenario::{self, Scenario, VirtualBackend};

mod support;
use support::flights::{at_speed, drive, first, fly, last, only, recorded, scenario};
use support::reference;

#[test]
fn a_current_sensor_that_shows_a_current_at_rest_blocks_arming() {
    for (sensor, offset_a, blocks) in [
        ("left-current", 5.0, true),
        ("right-current", -0.7, true),
        ("right-current", 40.0, true),
        ("left-current", 0.3, false),
    ] {
        for seed in [1, 11] {
            let offset =
                format!("{{ at_s = 0.5, action = \"analog-fault\", sensor = \"{sensor}\", offset = {offset_a:?} }}");
            // A scenario lists its steps in order of time, so that the fault comes before the arming.
            let text = format!(
                "title = \"t\"\nduration_s = 4.0\nseed = {seed}\nstep = [{offset}, {{ at_s = 2.0, action = \"arm\" }}]\n"
            );
            let outcome = drive(&Scenario::parse("case.toml", &text).expect("a scenario"));
            let story = format!("{sensor} {offset_a} A, seed {seed}");
            let status = &last(&outcome).status;
            assert_eq!(status.blockers.contains(Blocker::CurrentSensor), blocks, "{story}");
            assert_eq!(status.mode == Mode::Disarmed, blocks, "{story}");
            assert_eq!(outcome.trace.rows.iter().any(|row| row.bridges_on), !blocks, "{story}");
        }
    }
}

#[test]
fn a_dead_or_stuck_current_sensor_is_found_within_a_second_and_the_vehicle_stops() {
    for (speed_m_s, seeds) in [(0.0, [1, 11]), (0.3, [2, 12]), (-1.0, [3, 13]), (2.0, [4, 14])] {
        for seed in seeds {
            for (sensor, reads) in [("left-current", "dead"), ("right-current", "stuck")] {
                let steps = format!(
                    "{}, {{ at_s = 8.0, action = \"analog-fault\", sensor = \"{sensor}\", reads = \"{reads}\" }}",
                    at_speed(speed_m_s)
                );
                let outcome = fly(13.0, seed, "", &steps);
                let story = format!("{sensor} {reads} at {speed_m_s} m/s, seed {seed}");
                let found = first(&outcome, 8.0, |row| row.status.faults.contains(Fault::CurrentSensor));
                let found_s = found.unwrap_or_else(|| panic!("{story}: not found"));
                println!("{story}: {found_s:.3} s");
                assert!(found_s < 1.0, "{story}: {found_s} s");
                let faults = last(&outcome).status.faults;
                assert_eq!(faults, only(&[Fault::CurrentSensor]), "{story}");
                assert_eq!(last(&outcome).status.mode, Mode::Disarmed, "{story}");
                assert!(first(&outcome, 8.0, |row| row.status.mode == Mode::Stopping).is_some());
            }
        }
    }
}

#[test]
fn an_open_lead_is_named_by_its_motor() {
    for (speed_m_s, side, fault) in [
        (0.3, "left", Fault::LeftMotorOpen),
        (1.0, "right", Fault::RightMotorOpen),
        (2.0, "left", Fault::LeftMotorOpen),
        (-1.0, "left", Fault::LeftMotorOpen),
    ] {
        for seed in [7, 17] {
            let steps = format!(
                "{}, {{ at_s = 8.0, action = \"motor-leads\", motor = \"{side}\", leads = \"open\" }}",
                at_speed(speed_m_s)
            );
            let outcome = fly(10.0, seed, "", &steps);
            let story = format!("{side} open at {speed_m_s} m/s, seed {seed}");
            let found = first(&outcome, 8.0, |row| row.status.faults.contains(fault));
            println!("{story}: {found:?} s");
            assert!(found.is_some_and(|s| s < 0.4), "{story}: {:?}", outcome.log);
            assert_eq!(last(&outcome).status.faults, only(&[fault]), "{story}");
            assert_eq!(last(&outcome).status.mode, Mode::Disarmed, "{story}");
        }
    }
}

/// The board computes the duties for the sensor's reading, and for the file's `minimum_v` if the reading is lower. The bridges
/// therefore apply at most 25.2 V / 19 V = 1.33 times the wanted voltage.
#[test]
fn a_supply_sensor_that_reads_too_low_brings_a_controlled_stop_at_the_speed_told() {
    for (speed_m_s, reads) in [
        (0.0, "gain = 0.1"),
        (1.0, "reads = \"dead\""),
        (1.0, "gain = 0.1"),
        (2.3, "gain = 0.5"),
        (2.3, "reads = \"dead\""),
        (-2.3, "offset = -20.0"),
        (2.3, "offset = -6.0"),
    ] {
        for seed in [1, 11] {
            let fault = format!("{{ at_s = 8.0, action = \"analog-fault\", sensor = \"battery-voltage\", {reads} }}");
            let outcome = fly(13.0, seed, "", &format!("{}, {fault}", at_speed(speed_m_s)));
            let story = format!("{reads} at {speed_m_s} m/s, seed {seed}");
            let found = first(&outcome, 8.0, |row| row.status.mode == Mode::Stopping);
            assert!(found.is_some_and(|s| s < 0.3), "{story}: {found:?}");
            assert_eq!(last(&outcome).status.faults, only(&[Fault::BatteryLow]), "{story}");
            assert_eq!(last(&outcome).status.mode, Mode::Disarmed, "{story}");
            let after = || outcome.trace.rows.iter().filter(|row| row.time_s() > 8.0);
            let speed_peak_m_s = after().map(|row| row.truth.speed_m_s.abs()).fold(0.0, f64::max);
            assert!(
                speed_peak_m_s < f64::abs(speed_m_s) + 0.1,
                "{story}: {speed_peak_m_s} m/s"
            );
            // The current limit of 17 A, exceeded by the ratio of the voltages.
            let current_peak_a = after().map(|row| row.truth.current_a[0].abs()).fold(0.0, f64::max);
            assert!(current_peak_a < 17.0 * 1.33, "{story}: {current_peak_a} A");
        }
    }
    for (speed_m_s, seed) in [(0.0, 1), (1.0, 2), (2.3, 3)] {
        let fault = "{ at_s = 8.0, action = \"analog-fault\", sensor = \"battery-voltage\", gain = 2.0 }";
        let outcome = fly(9.0, seed, "", &format!("{}, {fault}", at_speed(speed_m_s)));
        let found = first(&outcome, 8.0, |row| row.status.mode == Mode::Disarmed);
        assert!(found.is_some_and(|s| s < 0.15), "{speed_m_s}: {found:?}");
        assert_eq!(last(&outcome).status.faults, only(&[Fault::BatteryHigh]), "{speed_m_s}");
    }
}

/// A failure at the spar may end the levelling, never the drive.
#[test]
fn no_failure_of_the_spar_ends_the_drive() {
    let sensor = |sensor: &str, fault: &str| {
        format!("{{ at_s = 10.0, action = \"sensor-fault\", sensor = \"{sensor}\", fault = \"{fault}\" }}")
    };
    let leads =
        |leads: &str| format!("{{ at_s = 10.0, action = \"motor-leads\", motor = \"ballast\", leads = \"{leads}\" }}");
    let current =
        |what: &str| format!("{{ at_s = 10.0, action = \"analog-fault\", sensor = \"ballast-current\", {what} }}");
    for (failure, fault) in [
        (sensor("ballast-encoder", "off"), None),
        (sensor("ballast-encoder", "stuck"), None),
        (sensor("ballast-encoder", "garbage"), Some(Fault::BallastEncoder)),
        (sensor("ballast-encoder", "wrong-sign"), None),
        (sensor("spar-imu", "off"), Some(Fault::SparImu)),
        (sensor("spar-imu", "stuck"), Some(Fault::SparImu)),
        (sensor("spar-imu", "garbage"), Some(Fault::SparImu)),
        (leads("open"), None),
        (leads("shorted"), Some(Fault::BallastOvercurrent)),
        (current("reads = \"dead\""), None),
        (current("offset = 50.0"), Some(Fault::BallastOvercurrent)),
    ] {
        for (slope_rad, seed) in [(0.0, 1), (-0.0873, 2), (-0.0873, 12)] {
            let tables = format!("chocked_until_armed = true\nterrain.plane = {{ slope_x_rad = {slope_rad:?} }}");
            let steps = format!(
                "{}, {failure}, {{ at_s = 14.0, action = \"drive\", speed_m_s = 0.5 }}",
                at_speed(1.0)
            );
            let outcome = fly(20.0, seed, &tables, &steps);
            let story = format!("{failure} on {slope_rad}, seed {seed}");
            let row = last(&outcome);
            assert_eq!(row.status.mode, Mode::Armed, "{story}: {}", row.status.faults);
            assert!(
                (row.truth.speed_m_s - 0.5).abs() < 0.1,
                "{story}: {}",
                row.truth.speed_m_s
            );
            let others = row.status.faults.bits() & !FaultSet::SPAR.bits();
            assert_eq!(others, 0, "{story}: {}", row.status.faults);
            if let Some(fault) = fault {
                let found = first(&outcome, 10.0, |row| row.status.faults.contains(fault));
                assert!(found.is_some_and(|s| s < 0.2), "{story}: {found:?}");
                assert_eq!(row.status.voltage_v[2], 0.0, "{story}: the ballast motor is off");
            }
        }
    }
}

#[test]
fn an_encoder_that_dies_or_reverses_is_found_within_600_ms_from_a_crawl_to_full_speed() {
    for (speed_m_s, seeds) in [
        (0.15, [1, 11]),
        (0.3, [2, 12]),
        (-0.3, [3, 13]),
        (0.6, [4, 14]),
        (1.0, [5, 15]),
        (2.5, [6, 16]),
    ] {
        for seed in seeds {
            for (sensor, fault) in [
                ("left-encoder", "off"),
                ("right-encoder", "stuck"),
                ("right-encoder", "wrong-sign"),
            ] {
                let steps = format!(
                    "{}, {{ at_s = 8.0, action = \"sensor-fault\", sensor = \"{sensor}\", fault = \"{fault}\" }}",
                    at_speed(speed_m_s)
                );
                let outcome = fly(9.0, seed, "", &steps);
                let story = format!("{sensor} {fault} at {speed_m_s} m/s, seed {seed}");
                let found = first(&outcome, 8.0, |row| !row.bridges_on);
                println!("{story}: {found:?} s");
                assert!(found.is_some_and(|s| s <= 0.6), "{story}: {found:?}");
                // At full speed the law drives hard against an encoder with the wrong sign.
                let hard = fault == "wrong-sign" && speed_m_s > 2.0;
                let cause = if hard {
                    Fault::Overcurrent
                } else {
                    Fault::EncoderImplausible
                };
                assert_eq!(last(&outcome).status.faults, only(&[cause]), "{story}");
            }
        }
    }
}

/// The adaptive full scale of an IMU holds the gyro's words for one or two ticks whenever a rate crosses 100 deg/s.
#[test]
fn a_gyro_that_crosses_100_degrees_per_second_goes_on_measuring() {
    for yaw_rate in [2.0, -2.0, 1.9] {
        for seed in [1, 11] {
            let spin = format!("{{ at_s = 4.0, action = \"drive\", yaw_rate_rad_s = {yaw_rate:?} }}");
            let scenario = scenario(8.0, seed, "", &format!("{spin}, {{ at_s = 6.0, action = \"drive\" }}"));
            // While the rate about one axis changes by 0.2 deg/s in a tick, three words with noise do not repeat together.
            let words: Vec<[i16; 3]> = recorded(&scenario).iter().map(|r| r.sample.arm_imu.raw.gyro).collect();
            let lsb_per_deg_s = SCALES.imu.gyro_lsb_per_deg_s;
            let crosses = |pair: &&[[i16; 3]]| {
                let [before, after] =
                    [pair[0], pair[pair.len() - 1]].map(|word| f32::from(word[2]).abs() / lsb_per_deg_s);
                before.min(after) < 99.0 && before.max(after) > 101.0
            };
            let crossings: Vec<_> = words.windows(16).filter(crosses).collect();
            assert!(
                !crossings.is_empty(),
                "{yaw_rate}, seed {seed}: the gyro does not cross 100 deg/s"
            );
            for window in crossings {
                let repeated = window.windows(2).filter(|pair| pair[0] == pair[1]).count();
                assert_eq!(repeated, 0, "{yaw_rate}, seed {seed}: {window:?}");
            }
        }
    }
}

/// On a vehicle without a spar, the board neither reads nor checks the spar's sensors.
#[test]
fn a_vehicle_without_a_spar_takes_no_fault_from_its_inputs() {
    let mut parameters = *reference().parameters();
    parameters.spar = None;
    let vehicle = model::vehicle::Vehicle::new(parameters).expect("valid");
    for (failure, seed) in [
        // The encoder input is open from the boot on: no step can name the encoder of a motor that does not exist.
        ("action = \"speak\"", 1),
        (
            "action = \"analog-fault\", sensor = \"ballast-current\", offset = 50.0",
            2,
        ),
        (
            "action = \"analog-fault\", sensor = \"ballast-current\", reads = \"dead\"",
            3,
        ),
    ] {
        let steps = format!("{}, {{ at_s = 6.0, {failure} }}", at_speed(0.5));
        let scenario = scenario(10.0, seed, "", &steps);
        let mut plant = scenario.plant(&vehicle).expect("a plant");
        let open_input = plant.encoder_mut(model::sample::Motor::Ballast);
        open_input.set_fault(plant::fault::SensorFault::Garbage);
        let mut backend = VirtualBackend::boot(&vehicle, plant).expect("boots");
        let outcome = scenario::run(&scenario, &mut backend, |_| {}).expect("valid");
        let status = &last(&outcome).status;
        assert_eq!(
            (status.mode, status.faults),
            (Mode::Armed, FaultSet::EMPTY),
            "{failure}"
        );
        assert_eq!(status.current_a[2], 0.0, "{failure}");
        let about_spar = outcome.log.iter().find(|line| line.contains("spar IMU"));
        assert_eq!(about_spar, None, "the board looks for a spar IMU");
    }
}

/// A vehicle would never notice that it crosses a limit beyond the range of its sensors.
#[test]
fn a_limit_beyond_the_sensors_is_refused_by_the_file_reader_and_by_the_board() {
    for (changes, name) in [
        (
            &[
                ("nominal_v = 25.2", "nominal_v = 58.0"),
                ("maximum_v = 30.0", "maximum_v = 75.0"),
            ][..],
            "battery.maximum_v = 75",
        ),
        (&[("maximum_v = 30.0", "maximum_v = 65.0")], "battery.maximum_v = 65"),
        (
            &[
                ("current_limit_a = 17.0", "current_limit_a = 150"),
                ("overcurrent_a = 30.0", "overcurrent_a = 200"),
            ],
            "safety.overcurrent_a = 200",
        ),
        (
            &[("overcurrent_a = 30.0", "overcurrent_a = 59.5")],
            "safety.overcurrent_a = 59.5",
        ),
    ] {
        let mut text = vehicle_file::REFERENCE.to_owned();
        for (from, to) in changes {
            assert!(text.contains(from), "{from}");
            text = text.replacen(from, to, 1);
        }
        let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
        let path = folder.join("beyond-the-sensors.toml");
        std::fs::write(&path, text).expect("writes");
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_hil-sim"))
            .args(["drive", "--json", "--vehicle", path.to_str().expect("utf-8")])
            .output()
            .expect("it starts");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{name}: {message}");
        assert!(
            message.contains(name) && message.contains("sensor") && message.contains("beyond-the-sensors.toml"),
            "{name}: {message}"
        );
        let vehicle = vehicle_file::read_vehicle(&path).expect("a vehicle of another board");
        let plant = Scenario::parse("t", "title = \"t\"\nduration_s = 1.0\n")
            .expect("a scenario")
            .plant(&reference())
            .expect("a plant");
        assert!(VirtualBackend::boot(&vehicle, plant).is_err(), "{name}");
    }
}
