use super::*;
use crate::command::Request;
use crate::estimate::tilt::TiltReading;
use crate::sample::{ImuRaw, ImuSample};
use crate::vehicle::test_vehicle::reference;

mod blocking;
mod heat;
mod motors;

/// A supervisor with what a healthy vehicle at rest would show it.
struct Bench {
    supervisor: Supervisor,
    sensed: Sensed,
    estimate: Estimate,
    command: Command,
    applied: Actuation,
    /// The IMUs' noise goes on.
    alive: [bool; 2],
}

impl Bench {
    fn new() -> Self {
        Self {
            supervisor: Supervisor::new(&reference(), &BoardScales::EXAMPLE),
            sensed: Sensed {
                time_us: 0,
                relative_rate_rad_s: [0.0; MOTORS],
                relative_advance_rad: [0.0; MOTORS],
                ballast_turned_rad: 0.0,
                arm: TiltReading::default(),
                arm_force_y_m_s2: 0.0,
                arm_gyro_xz_rad_s: [0.0; 2],
                spar: TiltReading::default(),
                spar_force_y_m_s2: 0.0,
                spar_gyro_x_rad_s: 0.0,
                battery_v: 25.0,
                supply_v: 25.0,
                current_a: [0.0; MOTORS],
                analog: crate::analog::Analog::default(),
                encoder_counts: [0; MOTORS],
                encoder_age_us: 100,
                arm_imu: ImuSample::default(),
                spar_imu: ImuSample::default(),
                analog_age_us: 100,
                emergency_stop: false,
                break_input: false,
                bridge_break: false,
                board_blockers: 0,
            },
            estimate: Estimate {
                calibrated: true,
                at_rest: true,
                stopped: true,
                ..Estimate::default()
            },
            command: Command {
                age_us: 1000,
                ..Command::NONE
            },
            applied: Actuation::SAFE,
            alive: [true; 2],
        }
    }

    /// One tick, a millisecond after the last one; the faults and the mode.
    fn tick(&mut self) -> Findings {
        self.sensed.time_us += 1000;
        let k = (self.sensed.time_us / 1000 % 5) as i16;
        let living = |sample: &mut ImuSample| {
            sample.raw = ImuRaw {
                accel: [k, 0, 4000],
                gyro: [0, k, 0],
                temperature: 0,
            };
        };
        for (sample, alive) in [&mut self.sensed.arm_imu, &mut self.sensed.spar_imu]
            .into_iter()
            .zip(self.alive)
        {
            if alive {
                living(sample);
            }
        }
        self.supervisor
            .step(&self.sensed, &self.estimate, &self.command, self.applied)
    }

    /// Ticks until `fault` shows, at most `limit`.
    fn ticks_until(&mut self, fault: Fault, limit: u32) -> Option<u32> {
        (1..=limit).find(|_| self.tick().faults.contains(fault))
    }

    fn arm(&mut self) {
        self.command.request = Request::Arm;
        assert_eq!(self.tick().mode, Mode::Armed, "{:?}", self.supervisor.blocking());
        self.command.request = Request::None;
    }
}

#[test]
fn a_healthy_vehicle_has_no_faults_and_no_blockers() {
    let mut bench = Bench::new();
    for _ in 0..1000 {
        assert_eq!(bench.tick().faults, FaultSet::EMPTY);
    }
    assert_eq!(bench.supervisor.blocking(), BlockerSet::EMPTY);
    bench.arm();
    assert_eq!(bench.supervisor.late_ticks(), 0);
}

/// The supervisor returns in each tick which sensors the tick believed: none before the first tick, and no sensor whose
/// fault is present.
#[test]
fn a_sensor_with_a_present_fault_is_not_believed() {
    type Cause = fn(&mut Bench, bool);
    let lost = |arm_imu, spar_imu, encoders| Believed {
        arm_imu,
        spar_imu,
        encoders,
    };
    let mut bench = Bench::new();
    assert_eq!(bench.supervisor.believed(), lost(false, false, false));
    let causes: [(Cause, Believed); 5] = [
        (
            |bench, lost| bench.sensed.arm_imu.age_us = if lost { 1_000_000 } else { 100 },
            lost(false, true, true),
        ),
        (
            |bench, lost| bench.estimate.contradicted = lost,
            lost(false, true, true),
        ),
        (
            |bench, lost| bench.estimate.phi_rad = if lost { f32::NAN } else { 0.0 },
            lost(false, true, true),
        ),
        (
            |bench, lost| bench.sensed.spar_imu.age_us = if lost { 1_000_000 } else { 100 },
            lost(true, false, true),
        ),
        (
            |bench, lost| bench.sensed.encoder_age_us = if lost { 1_000_000 } else { 100 },
            lost(true, true, false),
        ),
    ];
    for (cause, believed) in causes {
        bench.tick();
        assert_eq!(bench.supervisor.believed(), Believed::ALL);
        cause(&mut bench, true);
        bench.tick();
        assert_eq!(bench.supervisor.believed(), believed);
        cause(&mut bench, false);
    }
    bench.tick();
    assert_eq!(bench.supervisor.believed(), Believed::ALL);
}

/// 30 V turn the drive motor 158.5 times per second without load: 162.3 counts of a tick, twice that, and 16.
#[test]
fn an_encoder_jumps_beyond_twice_what_the_supply_can_turn_it() {
    let motor = reference().parameters().drive_motor;
    assert_eq!(jump_counts(&motor, 30.0), 324 + 16);
    assert_eq!(jump_counts(&motor, 15.0), 162 + 16);
    let finer = MotorParameters {
        encoder_counts_per_rev: 4096.0,
        ..motor
    };
    assert_eq!(jump_counts(&finer, 30.0), 1298 + 16);
}

/// Every fault that a sensor or a limit shows: what causes it, and after how many ticks it is called one.
#[test]
fn each_cause_shows_its_fault_in_time_and_not_before() {
    type Cause = fn(&mut Bench);
    let causes: [(Fault, u32, Cause); 21] = [
        (Fault::EmergencyStop, 1, |b| b.sensed.emergency_stop = true),
        (Fault::BridgeBreak, 1, |b| b.sensed.bridge_break = true),
        (Fault::StopContacts, 100, |b| b.sensed.emergency_stop = true),
        (Fault::StopContacts, 100, |b| b.sensed.break_input = true),
        (Fault::ImuStale, 1, |b| b.sensed.arm_imu.age_us = 5001),
        (Fault::ImuImplausible, 20, |b| b.alive[0] = false),
        (Fault::ImuImplausible, 1, |b| b.estimate.contradicted = true),
        (Fault::SparImu, 20, |b| b.alive[1] = false),
        (Fault::SparImu, 1, |b| b.estimate.spar_contradicted = true),
        (Fault::SparAngle, 1, |b| b.estimate.spar_rad = -1.4),
        (Fault::EncoderStale, 1, |b| b.sensed.encoder_age_us = 5001),
        (Fault::AnalogStale, 1, |b| b.sensed.analog_age_us = 5001),
        (Fault::EncoderImplausible, 1, |b| b.sensed.encoder_counts[1] += 10_000),
        (Fault::BallastEncoder, 1, |b| b.sensed.encoder_counts[2] += 10_000),
        (Fault::Overcurrent, 3, |b| b.sensed.current_a[1] = -31.0),
        (Fault::BallastOvercurrent, 3, |b| b.sensed.current_a[2] = 31.0),
        (Fault::BatteryLow, 50, |b| b.sensed.battery_v = 18.9),
        (Fault::BatteryHigh, 50, |b| b.sensed.battery_v = 30.1),
        (Fault::ArmAngle, 1, |b| b.estimate.phi_rad = 1.5),
        (Fault::NotFinite, 1, |b| b.estimate.phi_rate_rad_s = f32::NAN),
        (Fault::CommandTimeout, 1, |b| b.command.age_us = 250_001),
    ];
    for (fault, ticks, cause) in causes {
        let mut bench = Bench::new();
        bench.tick();
        cause(&mut bench);
        assert_eq!(bench.ticks_until(fault, 200), Some(ticks), "{}", fault.name());
    }
}

/// Exactly at its limit nothing is a fault: the limits of the vehicle file, and the largest advance of an encoder in a
/// tick, twice that of the no-load speed at the highest supply: 324 counts of the reference vehicle.
#[test]
fn what_a_limit_just_allows_is_no_fault() {
    let causes: [fn(&mut Bench); 11] = [
        |b| b.sensed.arm_imu.age_us = 5000,
        |b| b.sensed.spar_imu.age_us = 5000,
        |b| b.sensed.encoder_age_us = 5000,
        |b| b.sensed.analog_age_us = 5000,
        |b| b.sensed.battery_v = 19.0,
        |b| b.sensed.battery_v = 30.0,
        |b| b.sensed.current_a[1] = -30.0,
        |b| b.estimate.phi_rad = -1.4,
        |b| b.estimate.spar_rad = reference().parameters().safety.spar_max_rad,
        |b| b.command.age_us = 250_000,
        |b| b.sensed.encoder_counts[0] -= 324,
    ];
    for (n, cause) in causes.iter().enumerate() {
        let mut bench = Bench::new();
        bench.tick();
        cause(&mut bench);
        for _ in 0..100 {
            assert_eq!(bench.tick().faults, FaultSet::EMPTY, "cause {n}");
        }
    }
    let mut bench = Bench::new();
    bench.tick();
    bench.sensed.encoder_counts[0] -= 350;
    assert!(bench.tick().faults.contains(Fault::EncoderImplausible));
}

/// `stop_timeout_s` is 4 s.
#[test]
fn a_controlled_stop_has_its_time_and_no_more() {
    let mut bench = Bench::new();
    bench.tick();
    bench.arm();
    bench.estimate.stopped = false;
    bench.command.age_us = 250_001;
    assert_eq!(bench.tick().mode, Mode::Stopping);
    let ticks = (1..=5000).find(|_| bench.tick().mode == Mode::Disarmed);
    assert!(ticks.is_some_and(|ticks| (3999..=4001).contains(&ticks)), "{ticks:?}");
    assert!(bench.supervisor.latched().contains(Fault::StopTimeout));
}

#[test]
fn late_ticks_are_counted_and_a_missed_one_is_a_fault() {
    let mut bench = Bench::new();
    for (gap_us, late, missed) in [
        (1000, 0, false),
        (1501, 1, false),
        (5000, 2, false),
        (5001, 3, true),
        (1000, 3, false),
    ] {
        bench.tick();
        bench.sensed.time_us += gap_us - 1000;
        let verdict = bench.tick();
        assert_eq!(bench.supervisor.late_ticks(), late, "{gap_us}");
        assert_eq!(verdict.faults.contains(Fault::DeadlineMissed), missed, "{gap_us}");
    }
}

#[test]
fn what_is_no_fault_may_still_block_arming() {
    type Cause = fn(&mut Bench);
    let causes: [(Blocker, Cause); 7] = [
        (Blocker::NotCalibrated, |b| b.estimate.calibrated = false),
        (Blocker::NotAtRest, |b| b.estimate.at_rest = false),
        (Blocker::ArmAngle, |b| b.estimate.phi_rad = 0.71),
        (Blocker::CommandNotNeutral, |b| b.command.drive.yaw_rate_rad_s = -0.01),
        (Blocker::NoCommand, |b| b.command.drive.speed_m_s = f32::NAN),
        (Blocker::Parameters, |b| b.command.parameters_pending = true),
        (Blocker::CurrentSensor, |b| b.sensed.current_a[0] = 1.0),
    ];
    for (blocker, cause) in causes {
        let mut bench = Bench::new();
        cause(&mut bench);
        for _ in 0..60 {
            bench.tick();
        }
        bench.command.request = Request::Arm;
        assert_eq!(bench.tick().mode, Mode::Disarmed);
        assert!(bench.supervisor.blocking().contains(blocker), "{}", blocker.name());
        assert_eq!(bench.supervisor.refused_arms(), 1);
    }
}

#[test]
fn what_the_boards_self_test_found_blocks_arming() {
    for blocker in [
        Blocker::BreakPath,
        Blocker::BoardOptions,
        Blocker::PartRevision,
        Blocker::Image,
        Blocker::Unsealed,
        Blocker::Ram,
    ] {
        let mut bench = Bench::new();
        let mut found = BlockerSet::EMPTY;
        found.insert(blocker);
        bench.sensed.board_blockers = found.bits();
        bench.command.request = Request::Arm;
        assert_eq!(bench.tick().mode, Mode::Disarmed);
        // Clearing faults mends no board.
        bench.command.request = Request::ClearFaults;
        bench.tick();
        assert_eq!(bench.supervisor.blocking(), found);
    }
}

#[test]
fn contacts_that_disagreed_are_told_until_faults_are_cleared() {
    let mut bench = Bench::new();
    bench.sensed.emergency_stop = true;
    assert_eq!(bench.ticks_until(Fault::StopContacts, 200), Some(100));
    bench.sensed.emergency_stop = false;
    assert!(bench.tick().faults.contains(Fault::StopContacts));
    assert!(bench.supervisor.blocking().contains(Blocker::StopContacts));
    bench.command.request = Request::ClearFaults;
    assert_eq!(bench.tick().faults, FaultSet::EMPTY);
    bench.command.request = Request::None;
    bench.arm();
    // A contact that follows the other one within 99 ms agrees with it, at the press and at the release.
    bench.command.request = Request::Disarm;
    for pressed in [true, false] {
        bench.sensed.emergency_stop = pressed;
        assert_eq!(bench.ticks_until(Fault::StopContacts, 99), None);
        bench.sensed.break_input = pressed;
        assert_eq!(bench.ticks_until(Fault::StopContacts, 200), None);
    }
}

#[test]
fn arming_is_told_once_and_a_fault_found_later_disarms() {
    let mut bench = Bench::new();
    bench.command.request = Request::Arm;
    assert!(bench.tick().newly_armed);
    bench.command.request = Request::None;
    assert!(!bench.tick().newly_armed);
    bench.supervisor.trip(Fault::NotFinite);
    assert_eq!(bench.supervisor.mode(), Mode::Disarmed);
    assert!(bench.supervisor.latched().contains(Fault::NotFinite));
    assert_eq!(bench.tick().mode, Mode::Disarmed);
}

#[test]
fn a_vehicle_without_a_spar_has_no_spar_faults() {
    let mut parameters = *reference().parameters();
    parameters.spar = None;
    let vehicle = Vehicle::new(parameters).expect("valid");
    let mut bench = Bench::new();
    bench.supervisor = Supervisor::new(&vehicle, &BoardScales::EXAMPLE);
    bench.alive[1] = false;
    bench.estimate.spar_rad = 2.0;
    bench.sensed.encoder_counts[2] += 10_000;
    bench.sensed.current_a[2] = 55.0;
    for _ in 0..100 {
        assert_eq!(bench.tick().faults, FaultSet::EMPTY);
    }
}
