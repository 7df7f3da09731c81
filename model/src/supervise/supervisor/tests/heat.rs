use super::*;

/// 29 A through a drive motor, below the overcurrent: its winding is too hot within 2 s. The vehicle stops, and cools before
/// it may be armed again. A ballast motor that is too hot ends the levelling alone.
#[test]
fn a_motor_that_no_limit_holds_becomes_too_hot() {
    for (motor, fault, bound_s) in [
        (0, Fault::DriveMotorHot, 2.1_f32),
        (1, Fault::DriveMotorHot, 2.1),
        (2, Fault::BallastMotorHot, 0.3),
    ] {
        let mut bench = Bench::new();
        bench.tick();
        bench.sensed.current_a[motor] = 29.0;
        let ticks = bench.ticks_until(fault, 10_000).expect("too hot");
        assert!(ticks as f32 * TICK_S < bound_s, "{motor}: {ticks}");
        let blocked = motor < 2;
        assert_eq!(
            bench.supervisor.blocking().contains(Blocker::MotorHot),
            blocked,
            "{motor}"
        );
        let shares = bench.supervisor.motor_shares();
        for (n, share) in shares.into_iter().enumerate() {
            // Beyond heat 1 the limit lies below the continuous current.
            assert_eq!(share < 0.5, n == motor, "{motor}: {shares:?}");
        }
        bench.sensed.current_a[motor] = 0.0;
        for _ in 0..60_000 {
            bench.tick();
        }
        assert!(!bench.supervisor.blocking().contains(Blocker::MotorHot), "{motor}");
        assert_eq!(bench.supervisor.motor_shares(), [1.0; MOTORS]);
    }
}

#[test]
fn a_motor_too_hot_while_armed_stops_the_vehicle() {
    let mut bench = Bench::new();
    bench.tick();
    bench.arm();
    bench.estimate.stopped = false;
    // As driven, so that the current sensor is no fault of its own.
    bench.sensed.current_a[0] = 29.0;
    let found = (0..3000).map(|_| bench.tick()).find(|found| found.mode != Mode::Armed);
    let found = found.expect("it stops");
    assert!(found.faults.contains(Fault::DriveMotorHot), "{}", found.faults);
    assert_eq!(found.mode, Mode::Stopping);
}

/// A bench whose bridges bear 8 A (drive) and 1 A (ballast) for ever: less than their windings, within a few seconds.
fn weak_bridges() -> Bench {
    let mut bench = Bench::new();
    let mut parameters = *reference().parameters();
    parameters.drive_motor.bridge_continuous_a = 8.0;
    if let Some((_, motor)) = &mut parameters.spar {
        motor.bridge_continuous_a = 1.0;
    }
    let vehicle = Vehicle::new(parameters).expect("a vehicle");
    bench.supervisor = Supervisor::new(&vehicle, &BoardScales::EXAMPLE);
    bench
}

/// A current that heats the bridge alone. It is told by its own fault, bounds its own motor, blocks arming if it is a drive
/// motor's, and cools in ten seconds.
#[test]
fn a_bridge_that_no_limit_holds_becomes_too_hot() {
    for (motor, current_a, fault, continuous_a) in [
        (0, 13.0_f32, Fault::DriveBridgeHot, 8.0_f32),
        (1, -13.0, Fault::DriveBridgeHot, 8.0),
        (2, 1.9, Fault::BallastBridgeHot, 1.0),
    ] {
        let mut bench = weak_bridges();
        bench.tick();
        bench.sensed.current_a[motor] = current_a;
        let ticks = bench.ticks_until(fault, 10_000).expect("too hot");
        let expected_s = -3.0 * libm::logf(1.0 - 1.2 * (continuous_a / current_a) * (continuous_a / current_a));
        let found_s = ticks as f32 * TICK_S;
        assert!((found_s - expected_s).abs() < 0.01, "{motor}: {found_s} {expected_s}");
        let found = bench.tick();
        let windings = FaultSet::EMPTY.with(Fault::DriveMotorHot).with(Fault::BallastMotorHot);
        assert!(!found.faults.has_any(windings), "{motor}: {}", found.faults);
        let blocked = bench.supervisor.blocking().contains(Blocker::MotorHot);
        assert_eq!(blocked, motor < 2, "{motor}");
        let shares = bench.supervisor.motor_shares();
        for (n, share) in shares.into_iter().enumerate() {
            assert_eq!(share < 1.0, n == motor, "{motor}: {shares:?}");
        }
        bench.sensed.current_a[motor] = 0.0;
        for _ in 0..10_000 {
            bench.tick();
        }
        assert!(!bench.supervisor.blocking().contains(Blocker::MotorHot), "{motor}");
        assert_eq!(bench.supervisor.motor_shares(), [1.0; MOTORS]);
    }
}

/// New parameters do not cool a motor.
#[test]
fn a_change_of_the_parameters_leaves_the_motors_as_warm_as_they_are() {
    let mut bench = Bench::new();
    bench.sensed.current_a[1] = 17.0;
    for _ in 0..5000 {
        bench.tick();
    }
    assert!(bench.supervisor.motor_shares()[1] < 0.6);
    let vehicle = reference();
    bench.supervisor = Supervisor::new(&vehicle, &BoardScales::EXAMPLE).with_record_of(&bench.supervisor, &vehicle);
    bench.sensed.current_a[1] = 0.0;
    bench.tick();
    let after = bench.supervisor.motor_shares();
    assert!(after[1] < 0.6, "{after:?}");
    assert_eq!((after[0], after[2]), (1.0, 1.0));
}

/// What the converter has not measured yet warms no motor, whatever its counts stand for; nor does what it measured long ago.
#[test]
fn a_current_that_nobody_measured_warms_no_motor() {
    for age_us in [u32::MAX, 50_000] {
        let mut bench = Bench::new();
        bench.sensed.analog_age_us = age_us;
        bench.sensed.current_a = [-60.0; MOTORS];
        let found = (0..5000).map(|_| bench.tick()).last().expect("ticks");
        assert!(found.faults.contains(Fault::AnalogStale), "{}", found.faults);
        assert!(!found.faults.contains(Fault::DriveMotorHot), "{}", found.faults);
        assert_eq!(bench.supervisor.motor_shares(), [1.0; MOTORS]);
        bench.sensed.analog_age_us = 100;
        bench
            .ticks_until(Fault::DriveMotorHot, 5000)
            .expect("once it is measured, it does");
    }
}
