//! The safety rule: no defined or undefined input moves a motor of a vehicle that is not armed, and every fault reaches the safe
//! state in bounded time.

use firmware::protocol::message::Order;
use model::command::{DriveCommand, Request};
use model::supervise::arming::Mode;
use model::supervise::codes::{Blocker, BlockerSet, Fault, FaultSet};
use plant::fault::SensorFault;
use plant::noise::Noise;
use virtual_board::board::hardware::{SecondContact, World};
use virtual_board::scenario::{Scenario, Sensor};

mod support;
use support::Bench;

/// Milliseconds until every bridge is off; fails if a bridge is still on after `limit_ms`.
fn bridges_off_within(bench: &mut Bench, limit_ms: u64) -> u64 {
    let mut off_after = None;
    let mut ms = 0;
    bench.run_watching(limit_ms, |bench| {
        ms += 1;
        if off_after.is_none() && !bench.bridges_on() {
            off_after = Some(ms);
        }
    });
    off_after.unwrap_or_else(|| {
        panic!(
            "the bridges are still on after {limit_ms} ms: {:?}",
            bench.board.status()
        )
    })
}

fn faults(bench: &Bench) -> FaultSet {
    bench.board.status().expect("runs").faults
}

fn blockers(bench: &Bench) -> BlockerSet {
    bench.board.status().expect("runs").blockers
}

#[test]
fn it_boots_disarmed_and_blocked_and_calibrates_within_two_seconds() {
    let mut bench = Bench::new(1);
    bench.run_watching(300, |bench| assert!(!bench.bridges_on()));
    assert!(blockers(&bench).contains(Blocker::NotCalibrated));
    bench.request(Request::Arm);
    bench.run_watching(50, |bench| assert!(!bench.bridges_on()));
    assert_eq!(bench.status().vehicle.refused_arms, 1);
    bench.run(1650);
    assert_eq!(blockers(&bench), BlockerSet::EMPTY, "{:b}", blockers(&bench).bits());
}

#[test]
fn drive_commands_move_nothing_unarmed() {
    let mut bench = Bench::new(2);
    bench.drive = Some([2.0, 1.0]);
    bench.run_watching(3000, |bench| assert!(!bench.bridges_on()));
    bench.request(Request::Arm);
    bench.run_watching(500, |bench| assert!(!bench.bridges_on()));
    assert!(blockers(&bench).contains(Blocker::CommandNotNeutral));
}

#[test]
fn noise_and_broken_frames_move_nothing_unarmed_and_stop_an_armed_vehicle() {
    for armed in [false, true] {
        let mut bench = if armed { Bench::armed(3) } else { Bench::new(3) };
        bench.drive = None;
        let mut noise = Noise::new(3, 7);
        bench.run(10);
        let (_, good) = bench
            .frame(Order::Drive(DriveCommand::driving(1.0, 0.0)))
            .expect("identified");
        let mut sent = 0;
        bench.run_watching(2000, |bench| {
            let mut bytes: Vec<u8> = (0..56).map(|_| noise.bits() as u8).collect();
            // Frames that are cut short and frames with wrong bytes.
            bytes.extend(&good[..good.len() / 2]);
            bytes.push(0);
            bytes.extend(good.iter().map(|byte| if *byte == 0 { 0 } else { byte ^ 0x10 }));
            sent += bytes.len();
            bench.board.send(&bytes);
            if !armed {
                assert!(!bench.bridges_on());
            }
        });
        bench.board.send(&[1; 2000]);
        bench.board.send(&[0]);
        bench.run(3000);
        assert!(sent > 100_000, "{sent} bytes");
        let status = bench.status();
        assert!(status.link.unreadable_frames() > 1000, "{:?}", status.link);
        assert!(!bench.bridges_on());
        assert_eq!(bench.mode(), Mode::Disarmed);
        if armed {
            assert!(
                faults(&bench).contains(Fault::CommandTimeout),
                "noise passes for a command"
            );
        }
    }
}

#[test]
fn commands_that_are_not_numbers_are_no_commands() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut bench = Bench::driving(4, 0.8);
        bench.drive = None;
        bench.run_watching(800, |bench| {
            bench.order(Order::Drive(DriveCommand::driving(bad, 0.0)));
        });
        assert!(faults(&bench).contains(Fault::CommandTimeout), "{bad}");
        bench.run(6000);
        assert_eq!(bench.mode(), Mode::Disarmed);
    }
}

#[test]
fn absurd_commands_stay_within_the_vehicles_limits() {
    let mut bench = Bench::armed(5);
    bench.drive = Some([1e30, -1e30]);
    let (mut speed, mut yaw) = (0.0_f64, 0.0_f64);
    bench.run_watching(6000, |bench| {
        let truth = bench.board.world(|world| world.plant.truth());
        speed = speed.max(truth.speed_m_s.abs());
        yaw = yaw.max(truth.yaw_rate_rad_s.abs());
    });
    // The file's limits, with the overshoot that docs/control.md gives for steps: 5 % of the speed, 2 % of the yaw rate.
    let control = support::reference().parameters().control;
    assert!((0.95..=1.05).contains(&(speed / control.speed_max_m_s)), "{speed}");
    assert!((0.95..=1.02).contains(&(yaw / control.yaw_rate_max_rad_s)), "{yaw}");
    assert_eq!((bench.mode(), faults(&bench)), (Mode::Armed, FaultSet::EMPTY));
}

#[test]
fn the_emergency_stop_opens_the_bridges_at_once_and_holds_until_cleared() {
    let mut bench = Bench::driving(6, 1.0);
    bench.press_emergency_stop();
    assert!(!bench.bridges_on(), "the hardware break waits for the firmware");
    bench.run(2);
    assert_eq!(bench.mode(), Mode::Disarmed);
    assert!(faults(&bench).contains(Fault::EmergencyStop));
    bench.board.world(|world| world.emergency_stop = false);
    bench.drive = Some([0.0, 0.0]);
    bench.run(8000);
    bench.request(Request::Arm);
    bench.run_watching(200, |bench| assert!(!bench.bridges_on()));
    assert!(blockers(&bench).contains(Blocker::FaultLatched));
    bench.request(Request::ClearFaults);
    bench.run(2500);
    assert_eq!(blockers(&bench), BlockerSet::EMPTY, "{:b}", blockers(&bench).bits());
    bench.request(Request::Arm);
    bench.run(20);
    assert_eq!(bench.mode(), Mode::Armed);
}

/// The emergency stop's second contact is welded shut: the first contact opens the bridges, and the status reports the
/// disagreement until it is cleared.
#[test]
fn a_welded_second_contact_is_found_at_the_first_press() {
    let mut bench = Bench::driving(6, 1.0);
    bench.board.world(|world| {
        world.second_contact = SecondContact::Welded;
        world.emergency_stop = true;
    });
    let opened = bridges_off_within(&mut bench, 2);
    assert!(opened <= 2, "{opened}");
    bench.run(90);
    bench.board.world(|world| world.emergency_stop = false);
    assert!(!blockers(&bench).contains(Blocker::StopContacts));
    bench.board.world(|world| world.emergency_stop = true);
    bench.run(105);
    bench.board.world(|world| world.emergency_stop = false);
    bench.run(500);
    assert!(blockers(&bench).contains(Blocker::StopContacts));
    bench.request(Request::ClearFaults);
    bench.run(20);
    assert!(!blockers(&bench).contains(Blocker::StopContacts));
}

#[test]
fn a_break_in_the_tick_of_a_clear_request_is_not_cleared_unseen() {
    let mut bench = Bench::driving(6, 1.0);
    bench.request(Request::ClearFaults);
    bench.board.world(World::trip);
    bench.run_watching(500, |bench| assert!(!bench.bridges_on()));
    assert_eq!(bench.mode(), Mode::Disarmed);
    assert!(faults(&bench).contains(Fault::BridgeBreak));
}

#[test]
fn the_dead_man_time_brings_it_to_a_controlled_stop() {
    let mut bench = Bench::driving(7, 1.0);
    bench.drive = None;
    let mut timeline = Vec::new();
    let mut ms = 0;
    bench.run_watching(6000, |bench| {
        ms += 1;
        let mode = bench.mode();
        if timeline.last().is_none_or(|(_, last)| *last != mode) {
            timeline.push((ms, mode));
        }
    });
    let [(_, Mode::Armed), (stopping, Mode::Stopping), (disarmed, Mode::Disarmed)] = timeline[..] else {
        panic!("{timeline:?}")
    };
    // The time-out is 250 ms from the last command, which was up to 20 ms old; stopping takes 4 s at most.
    assert!((228..=252).contains(&stopping), "{timeline:?}");
    assert!(disarmed - stopping > 500 && disarmed - stopping <= 4001, "{timeline:?}");
    let speed = bench.board.world(|world| world.plant.truth().speed_m_s);
    assert!(speed.abs() < 0.3, "{speed}");
}

/// What must happen after a sensor's failure.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Expect {
    /// The bridges open within this time, ms, with this fault.
    Open(u64, Fault),
    /// The vehicle drives on under control.
    Drives,
    /// Either the bridges open with a fault, or the failure does no harm and raises none.
    OpenOrHarmless,
}

fn fail_while_driving(sensor: Sensor, fault: SensorFault, expect: Expect) {
    let mut bench = Bench::driving(8, 1.0);
    bench.set_fault(sensor, fault);
    let (mut off_after, mut phi, mut speed, mut ms) = (None, 0.0_f64, 0.0_f64, 0);
    bench.run_watching(3000, |bench| {
        ms += 1;
        let on = bench.bridges_on();
        let truth = bench.board.world(|world| world.plant.truth());
        if off_after.is_none() {
            phi = phi.max(truth.phi_rad.abs());
            speed = speed.max(truth.speed_m_s.abs());
            if !on {
                off_after = Some(ms);
            }
        } else {
            assert!(!on, "{sensor:?} {fault:?}: bridges on again");
        }
    });
    let names: Vec<_> = faults(&bench).iter().map(Fault::name).collect();
    let story = format!("{sensor:?} {fault:?}: off after {off_after:?} ms, phi {phi}, speed {speed}, faults {names:?}");
    match expect {
        Expect::Open(limit_ms, cause) => {
            assert!(off_after.is_some_and(|ms| ms <= limit_ms), "{story}");
            assert!(names.contains(&cause.name()), "{story}");
        }
        Expect::Drives => assert!(off_after.is_none(), "{story}"),
        Expect::OpenOrHarmless => assert_eq!(off_after.is_some(), !names.is_empty(), "{story}"),
    }
    // Whatever happened: while a bridge was on, the vehicle neither whirled nor ran away.
    assert!(phi < 1.45, "{story}");
    assert!(speed < 3.5, "{story}");
}

#[test]
fn a_failed_arm_imu_opens_the_bridges() {
    for (fault, expect) in [
        (SensorFault::Off, Expect::Open(15, Fault::ImuStale)),
        (SensorFault::Stuck, Expect::Open(40, Fault::ImuImplausible)),
        (SensorFault::Garbage, Expect::Open(150, Fault::ImuImplausible)),
        (SensorFault::WrongSign, Expect::Open(50, Fault::ImuImplausible)),
        (SensorFault::Slow, Expect::OpenOrHarmless),
        (SensorFault::Delayed, Expect::OpenOrHarmless),
        (SensorFault::Intermittent, Expect::Open(60, Fault::ImuStale)),
        (SensorFault::NoForce, Expect::Open(320, Fault::ImuImplausible)),
    ] {
        fail_while_driving(Sensor::ArmImu, fault, expect);
    }
}

#[test]
fn a_failed_wheel_encoder_opens_the_bridges() {
    for sensor in [Sensor::LeftEncoder, Sensor::RightEncoder] {
        for (fault, expect) in [
            (SensorFault::Off, Expect::Open(600, Fault::EncoderImplausible)),
            (SensorFault::Stuck, Expect::Open(600, Fault::EncoderImplausible)),
            (SensorFault::Garbage, Expect::Open(100, Fault::EncoderImplausible)),
            (SensorFault::WrongSign, Expect::Open(600, Fault::EncoderImplausible)),
            (SensorFault::Slow, Expect::OpenOrHarmless),
            (SensorFault::Delayed, Expect::OpenOrHarmless),
            (SensorFault::Intermittent, Expect::OpenOrHarmless),
        ] {
            fail_while_driving(sensor, fault, expect);
        }
    }
}

#[test]
fn a_failed_spar_imu_switches_the_ballast_motor_off_and_leaves_the_vehicle_driving() {
    for fault in [
        SensorFault::Off,
        SensorFault::Stuck,
        SensorFault::NoForce,
        SensorFault::Garbage,
        SensorFault::WrongSign,
        SensorFault::Slow,
        SensorFault::Delayed,
    ] {
        fail_while_driving(Sensor::SparImu, fault, Expect::Drives);
    }
    let mut bench = Bench::driving(9, 0.5);
    bench.set_fault(Sensor::SparImu, SensorFault::Off);
    bench.run(1000);
    assert!(faults(&bench).contains(Fault::SparImu));
    assert_eq!(bench.status().vehicle.voltage_v[2], 0.0);
    assert_eq!(bench.mode(), Mode::Armed);
}

#[test]
fn sensors_that_fail_before_arming_block_it() {
    for (sensor, fault, blocker) in [
        (Sensor::ArmImu, SensorFault::Off, Blocker::Imu),
        (Sensor::ArmImu, SensorFault::Stuck, Blocker::Imu),
        (Sensor::ArmImu, SensorFault::Garbage, Blocker::Imu),
    ] {
        let mut bench = Bench::new(10);
        bench.run(1000);
        bench.set_fault(sensor, fault);
        bench.run(200);
        bench.request(Request::Arm);
        bench.run_watching(200, |bench| assert!(!bench.bridges_on()));
        assert!(blockers(&bench).contains(blocker), "{sensor:?} {fault:?}");
    }
}

#[test]
fn a_weak_battery_stops_the_vehicle_and_blocks_arming() {
    let mut bench = Bench::driving(11, 0.8);
    bench
        .board
        .world(|world| world.plant.battery_mut().open_circuit_v = 18.0);
    bench.run(300);
    assert_eq!(bench.mode(), Mode::Stopping);
    assert!(faults(&bench).contains(Fault::BatteryLow));
    assert!(bridges_off_within(&mut bench, 4500) > 500);
    let speed_m_s = bench.board.world(|world| world.plant.truth().speed_m_s);
    assert!(speed_m_s.abs() < 0.05, "the bridges open at {speed_m_s} m/s");
    assert!(!faults(&bench).contains(Fault::StopTimeout));
    bench.drive = Some([0.0, 0.0]);
    bench.request(Request::ClearFaults);
    bench.run(500);
    bench.request(Request::Arm);
    bench.run_watching(300, |bench| assert!(!bench.bridges_on()));
    assert!(blockers(&bench).contains(Blocker::Battery));
}

#[test]
fn an_overcharged_battery_opens_the_bridges() {
    let mut bench = Bench::driving(12, 0.8);
    bench
        .board
        .world(|world| world.plant.battery_mut().open_circuit_v = 33.0);
    assert!(bridges_off_within(&mut bench, 200) < 150);
    assert!(faults(&bench).contains(Fault::BatteryHigh));
}

#[test]
fn a_disarmed_vehicle_on_a_slope_gets_no_help() {
    let vehicle = support::reference();
    let slope = "title = 'slope'\nduration_s = 3.0\nseed = 13\n[terrain.plane]\nslope_x_rad = 0.0873\n";
    let scenario = Scenario::parse("slope.toml", slope).expect("valid");
    let plant = scenario.plant(&vehicle).expect("drivable");
    let mut board = virtual_board::board::VirtualBoard::boot(&vehicle, plant).expect("boots");
    board.run_until(3_000_000);
    let truth = board.world(|world| world.plant.truth());
    assert!(
        truth.speed_m_s < -0.5,
        "the vehicle does not roll away: {} m/s",
        truth.speed_m_s
    );
}

#[test]
fn the_operators_disarm_opens_the_bridges_within_two_ticks() {
    let mut bench = Bench::driving(14, 1.0);
    bench.request(Request::Disarm);
    assert!(bridges_off_within(&mut bench, 10) <= 2);
    assert!(faults(&bench).is_empty(), "a request is no fault");
}
