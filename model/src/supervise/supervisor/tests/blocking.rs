//! What blocks arming, what ends a run of bad ticks, and what a change of the parameters keeps.

use super::*;

type Change = fn(&mut Bench);

/// The blocker, the ticks after which it shows, what causes it, and what ends it.
const CAUSES: [(Blocker, u32, Change, Change); 14] = [
    (
        Blocker::EmergencyStop,
        1,
        |b| (b.sensed.emergency_stop, b.sensed.break_input) = (true, true),
        |b| {
            (b.sensed.emergency_stop, b.sensed.break_input) = (false, false);
        },
    ),
    (
        Blocker::BridgeBreak,
        1,
        |b| b.sensed.bridge_break = true,
        |b| b.sensed.bridge_break = false,
    ),
    (
        Blocker::Imu,
        1,
        |b| b.sensed.arm_imu.age_us = 5001,
        |b| b.sensed.arm_imu.age_us = 300,
    ),
    (
        Blocker::Imu,
        1,
        |b| b.estimate.contradicted = true,
        |b| b.estimate.contradicted = false,
    ),
    (
        Blocker::Imu,
        1,
        |b| b.estimate.heading_rad = f32::NAN,
        |b| b.estimate.heading_rad = 0.0,
    ),
    (
        Blocker::Encoder,
        1,
        |b| b.sensed.encoder_age_us = 5001,
        |b| b.sensed.encoder_age_us = 0,
    ),
    (Blocker::Encoder, 1, |b| b.sensed.encoder_counts[0] += 10_000, |_| {}),
    (
        Blocker::Analog,
        1,
        |b| b.sensed.analog_age_us = 5001,
        |b| b.sensed.analog_age_us = 0,
    ),
    (
        Blocker::Battery,
        50,
        |b| b.sensed.battery_v = 18.0,
        |b| b.sensed.battery_v = 25.0,
    ),
    (
        Blocker::Battery,
        50,
        |b| b.sensed.battery_v = 31.0,
        |b| b.sensed.battery_v = 25.0,
    ),
    (
        Blocker::NotAtRest,
        1,
        |b| b.estimate.at_rest = false,
        |b| b.estimate.at_rest = true,
    ),
    (
        Blocker::ArmAngle,
        1,
        |b| b.estimate.phi_rad = -0.71,
        |b| b.estimate.phi_rad = -0.69,
    ),
    (
        Blocker::NoCommand,
        1,
        |b| b.command.age_us = 250_001,
        |b| b.command.age_us = 250_000,
    ),
    (
        Blocker::Parameters,
        1,
        |b| b.command.parameters_pending = true,
        |b| b.command.parameters_pending = false,
    ),
];

/// Each cause that a sensor shows blocks arming while it lasts, under the blocker of its kind, and no longer.
#[test]
fn each_cause_blocks_arming_under_its_name_while_it_lasts() {
    for (n, (blocker, ticks, cause, end)) in CAUSES.into_iter().enumerate() {
        let mut bench = Bench::new();
        bench.tick();
        cause(&mut bench);
        for tick in 1..=ticks {
            bench.tick();
            assert_eq!(
                bench.supervisor.blocking().contains(blocker),
                tick == ticks,
                "cause {n}, tick {tick}"
            );
        }
        let mut only = BlockerSet::EMPTY;
        only.insert(blocker);
        assert_eq!(bench.supervisor.blocking(), only, "cause {n}");
        end(&mut bench);
        bench.tick();
        assert_eq!(bench.supervisor.blocking(), BlockerSet::EMPTY, "cause {n} has gone");
    }
}

#[test]
fn no_angle_is_no_small_angle_and_a_current_at_an_open_bridge_blocks() {
    let mut bench = Bench::new();
    bench.estimate.phi_rad = f32::NAN;
    bench.tick();
    assert!(
        bench.supervisor.blocking().contains(Blocker::ArmAngle),
        "an angle that is not a number is not small"
    );
    // A current that no open bridge carries, in whichever drive motor.
    for (motor, blocks) in [(0, true), (1, true), (2, false)] {
        let mut bench = Bench::new();
        bench.sensed.current_a[motor] = 40.0;
        for _ in 0..60 {
            bench.tick();
        }
        let blocking = bench.supervisor.blocking();
        assert_eq!(blocking.contains(Blocker::CurrentSensor), blocks, "{motor}");
        assert_eq!(blocking.contains(Blocker::Analog), blocks, "{motor}: an overcurrent");
    }
}

/// The same of the ballast motor takes the levelling as soon as the vehicle is armed, and nothing else.
#[test]
fn a_ballast_current_at_an_open_bridge_takes_the_levelling_once_armed() {
    let mut bench = Bench::new();
    bench.sensed.current_a[2] = 1.0;
    for _ in 0..60 {
        assert_eq!(bench.tick().mode, Mode::Disarmed);
    }
    assert_eq!(bench.supervisor.latched(), FaultSet::EMPTY, "disarmed it is no fault");
    bench.arm();
    bench.tick();
    assert!(bench.supervisor.latched().iter().eq([Fault::BallastCurrentSensor]));
    assert_eq!(bench.tick().mode, Mode::Armed);
}

/// The battery's and the currents' faults need a run: a glitch within it starts it anew.
#[test]
fn a_good_tick_ends_a_run_of_bad_ones() {
    type Set = fn(&mut Bench, bool);
    let causes: [(Fault, u32, Set); 4] = [
        (Fault::BatteryLow, 50, |b, bad| {
            b.sensed.battery_v = if bad { 18.0 } else { 25.0 }
        }),
        (Fault::BatteryHigh, 50, |b, bad| {
            b.sensed.battery_v = if bad { 31.0 } else { 25.0 }
        }),
        (Fault::Overcurrent, 3, |b, bad| {
            b.sensed.current_a[0] = if bad { 31.0 } else { 0.0 }
        }),
        (Fault::BallastOvercurrent, 3, |b, bad| {
            b.sensed.current_a[2] = if bad { -31.0 } else { 0.0 }
        }),
    ];
    for (fault, ticks, set) in causes {
        let mut bench = Bench::new();
        for _ in 0..3 {
            set(&mut bench, true);
            assert_eq!(bench.ticks_until(fault, ticks - 1), None, "{}", fault.name());
            set(&mut bench, false);
            assert_eq!(bench.tick().faults, FaultSet::EMPTY);
        }
        set(&mut bench, true);
        assert_eq!(bench.ticks_until(fault, 200), Some(ticks), "{}", fault.name());
    }
}

/// What a change of the parameters must not lose: mode, latched faults, counts, the last tick's time and the stop's
/// contacts. The watches and the limits are the new vehicle's.
#[test]
fn another_supervisor_takes_over_what_was_told() {
    let mut bench = Bench::new();
    bench.tick();
    bench.arm();
    bench.sensed.bridge_break = true;
    bench.tick();
    bench.sensed.bridge_break = false;
    bench.sensed.time_us += 1000;
    bench.command.request = Request::Arm;
    bench.tick();
    bench.command.request = Request::None;
    // The contacts differ for 60 ticks before the change, and for 40 after it.
    bench.sensed.break_input = true;
    assert_eq!(bench.ticks_until(Fault::StopContacts, 60), None);
    let mut parameters = *reference().parameters();
    parameters.battery.maximum_v = 40.0;
    parameters.safety.stop_timeout_s = 1.0;
    let vehicle = Vehicle::new(parameters).expect("valid");
    let renew = |bench: &mut Bench| {
        bench.supervisor = Supervisor::new(&vehicle, &BoardScales::EXAMPLE).with_record_of(&bench.supervisor, &vehicle);
    };
    renew(&mut bench);
    assert!(bench.supervisor.latched().contains(Fault::BridgeBreak));
    assert_eq!((bench.supervisor.late_ticks(), bench.supervisor.refused_arms()), (1, 1));
    assert!(bench.supervisor.blocking().contains(Blocker::FaultLatched));
    // A late tick after the change is seen.
    bench.sensed.time_us += 1000;
    bench.sensed.battery_v = 35.0;
    bench.tick();
    assert_eq!(bench.supervisor.late_ticks(), 2);
    assert_eq!(bench.ticks_until(Fault::StopContacts, 60), Some(39));
    bench.sensed.break_input = false;
    renew(&mut bench);
    assert!(bench.tick().faults.contains(Fault::StopContacts), "kept until cleared");
    bench.command.request = Request::ClearFaults;
    bench.tick();
    // 35 V is within the new range.
    bench.arm();
    bench.estimate.stopped = false;
    bench.command.age_us = 250_001;
    bench.tick();
    let ticks = (1..=5000).find(|_| bench.tick().mode == Mode::Disarmed);
    assert!(ticks.is_some_and(|ticks| (999..=1001).contains(&ticks)), "{ticks:?}");
}

#[test]
fn each_imu_is_judged_by_its_own_readings() {
    for (spar, fault) in [(true, Fault::SparImu), (false, Fault::ImuStale)] {
        let mut bench = Bench::new();
        let imu = if spar {
            &mut bench.sensed.spar_imu
        } else {
            &mut bench.sensed.arm_imu
        };
        imu.age_us = 5001;
        let mut only = FaultSet::EMPTY;
        only.insert(fault);
        assert_eq!(bench.tick().faults, only);
    }
}
