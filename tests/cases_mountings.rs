//! IMUs that are mounted the wrong way round, IMUs that are only shaken, and IMUs whose clock drifts: scenarios on the virtual
//! board, each kind at several values and seeds.

use model::command::Request;
use model::supervise::arming::Mode;
use model::supervise::codes::{Blocker, Fault, FaultSet, Limit};
use plant::settings::PlantSettings;
use rayon::prelude::*;
use virtual_board::board::flash::VirtualFlash;
use virtual_board::scenario::DriveOutcome;

mod support;
use support::flights::{at_speed, first, fly, last, only};
use support::slopes::{drive as slope_drive, small};
use support::{Bench, reference};

/// Half of the angle at which fault ArmAngle opens the bridges, rad. An arm that stays below has not been thrown.
const NOT_THROWN_RAD: f64 = 0.7;

/// The arm's largest angle while a bridge was on, rad.
fn thrown_rad(outcome: &DriveOutcome) -> f64 {
    let rows = outcome.trace.rows.iter().filter(|row| row.bridges_on);
    rows.map(|row| row.truth.phi_rad.abs()).fold(0.0, f64::max)
}

/// Asserts that fault ImuImplausible, and no other, opens the bridges within `limit_s` of `from_s`, before the arm is thrown.
fn judged_by_its_imu(outcome: &DriveOutcome, from_s: f64, limit_s: f64, story: &str) {
    let opened = first(outcome, from_s, |row| !row.bridges_on);
    println!("{story}: {opened:?} s");
    assert!(opened.is_some_and(|s| s <= limit_s), "{story}: {opened:?} s");
    let phi_rad = thrown_rad(outcome);
    assert!(phi_rad < NOT_THROWN_RAD, "{story}: {phi_rad} rad");
    assert_eq!(
        last(outcome).status.faults,
        only(&[Fault::ImuImplausible]),
        "{story}: {:?}",
        outcome.log
    );
}

/// Every axis of the arm IMU changes its sign while the vehicle drives: 40 ticks upside down.
#[test]
fn an_imu_that_turns_over_is_found_in_50_ms_whatever_the_vehicle_does() {
    for (seed, slope_rad) in [(1, 0.0), (2, 0.1745), (3, -0.1745)] {
        for speed_m_s in [0.0, 0.3, 1.0, 2.0, 2.5, -0.3, -1.0, -2.5] {
            let outcome = fly(
                8.2,
                seed,
                &format!("chocked_until_armed = true\nterrain.plane.slope_x_rad = {slope_rad:?}"),
                &format!(
                    "{}, {{ at_s = 8.0, action = \"sensor-fault\", sensor = \"arm-imu\", fault = \"wrong-sign\" }}",
                    at_speed(speed_m_s)
                ),
            );
            let story = format!("{speed_m_s} m/s on {slope_rad}, seed {seed}");
            judged_by_its_imu(&outcome, 8.0, 0.05, &story);
        }
    }
}

/// An IMU that is mounted half a turn about its z axis is consistent in itself from the boot on, and nothing blocks arming. On a
/// slope the arm must move as soon as the vehicle is armed; on the level it moves when the vehicle is commanded to drive. A
/// vehicle that stands on the level does not move its arm, and then a mirrored IMU does no harm.
#[test]
fn a_mirrored_imu_is_found_in_300_ms_of_the_first_motion() {
    const MIRRORED: &str = "chocked_until_armed = true\nplant.arm_imu.misalignment_z_deg = 180.0";
    for seed in [1, 2, 3] {
        for speed_m_s in [0.3, 1.0, 2.0, 2.5, -0.3, -1.0, -2.5] {
            for (slope_rad, moves_s) in [(0.0, 2.1), (0.1745, 2.0), (-0.1745, 2.0)] {
                let plane = format!("{MIRRORED}\nterrain.plane.slope_x_rad = {slope_rad:?}");
                let step = format!("{{ at_s = 2.1, action = \"drive\", speed_m_s = {speed_m_s:?} }}");
                let outcome = fly(6.0, seed, &plane, &step);
                let story = format!("{speed_m_s} m/s on {slope_rad}, seed {seed}");
                let armed = first(&outcome, 0.0, |row| row.status.mode == Mode::Armed);
                assert!(armed.is_some(), "{story}: not armed");
                judged_by_its_imu(&outcome, moves_s + 0.02, 0.28, &story);
            }
        }
        let outcome = fly(12.0, seed, MIRRORED, &at_speed(0.0));
        let phi_rad = thrown_rad(&outcome);
        assert!(phi_rad < NOT_THROWN_RAD, "standing, seed {seed}: {phi_rad} rad");
    }
}

/// Gravity shows an IMU that is upside down, on its side or on an end before the vehicle arms. With such an arm IMU the vehicle
/// does not arm; with such a spar IMU the levelling ends in the first tick, while the ballast still hangs.
#[test]
fn an_imu_that_gravity_shows_to_be_mounted_wrong_is_told_before_a_motor_turns() {
    for (axis, angles_deg) in [("x", [90.0, -90.0, 180.0]), ("y", [90.0, -90.0, 180.0])] {
        for (angle_deg, seed) in angles_deg.into_iter().zip([1, 2, 3]) {
            let tables = |imu: &str| format!("plant.{imu}.misalignment_{axis}_deg = {angle_deg:?}");
            let outcome = fly(4.0, seed, &tables("arm_imu"), &at_speed(0.5));
            let story = format!("{axis} {angle_deg} deg, seed {seed}");
            let told = outcome
                .trace
                .rows
                .iter()
                .filter(|row| row.time_s() > 1.0 && row.time_s() < 2.0);
            for row in told {
                let blockers = row.status.blockers;
                assert!(
                    blockers.contains(Blocker::Imu) || blockers.contains(Blocker::ArmAngle),
                    "arm, {story}: {blockers}"
                );
            }
            assert!(outcome.trace.rows.iter().all(|row| !row.bridges_on), "arm, {story}");

            let outcome = fly(4.0, seed, &tables("spar_imu"), &at_speed(0.0));
            let spar = [Fault::SparImu, Fault::SparAngle];
            let found = first(&outcome, 2.0, |row| {
                spar.iter().any(|fault| row.status.faults.contains(*fault))
            });
            assert!(found.is_some_and(|s| s <= 0.02), "spar, {story}: {found:?}");
            let ballast_rad = outcome.trace.rows.iter().map(|row| row.truth.ballast_rad.abs());
            assert!(ballast_rad.fold(0.0, f64::max) < 0.02, "spar, {story}");
        }
    }
}

/// An arm IMU that is mounted a quarter of a turn about its z axis shows an arm that stands still. The vehicle reports this
/// before the arm has swung out: on the level once the vehicle drives off, on a slope once the wheels are released.
#[test]
fn an_arm_imu_a_quarter_of_a_turn_aside_is_found_in_300_ms_of_the_first_motion() {
    for (angle_deg, seed) in [(90.0, 1), (-90.0, 2)] {
        let aside = format!("chocked_until_armed = true\nplant.arm_imu.misalignment_z_deg = {angle_deg:?}");
        for (slope_rad, moves_s) in [(0.0, 4.0), (0.05, 2.0), (0.1745, 2.0), (-0.1745, 2.0), (-0.35, 2.0)] {
            for speed_m_s in [0.3, 1.0, -2.0] {
                let tables = format!("{aside}\nterrain.plane.slope_x_rad = {slope_rad:?}");
                let outcome = fly(6.0, seed, &tables, &at_speed(speed_m_s));
                let story = format!("{angle_deg} deg, {speed_m_s} m/s on {slope_rad}, seed {seed}");
                judged_by_its_imu(&outcome, moves_s + 0.02, 0.28, &story);
            }
        }
        let outcome = fly(12.0, seed, &aside, &at_speed(0.0));
        assert!(thrown_rad(&outcome) < NOT_THROWN_RAD, "standing, {angle_deg} deg");
    }
}

/// A spar IMU that faces backward reverses the levelling; a spar IMU that is mounted a quarter of a turn aside blinds
/// it. The board switches the ballast off before the ballast has swung over, and the vehicle drives on. The same
/// happens with an IMU whose every sign is wrong.
#[test]
fn a_spar_imu_that_is_mounted_wrong_is_found_before_the_ballast_swings_over() {
    let judge = |outcome: &DriveOutcome, from_s: f64, limit_s: f64, story: &str| {
        let found = first(outcome, from_s, |row| row.status.faults.contains(Fault::SparImu));
        let ballast_rad = outcome.trace.rows.iter().map(|row| row.truth.ballast_rad.abs());
        let ballast_rad = ballast_rad.fold(0.0, f64::max);
        println!("{story}: {found:?} s, ballast {ballast_rad:.2} rad");
        assert!(found.is_some_and(|s| s <= limit_s), "{story}: {found:?}");
        // Beyond a quarter turn the ballast would not return by itself.
        assert!(ballast_rad < 1.5, "{story}: {ballast_rad} rad");
        assert_eq!(last(outcome).status.mode, Mode::Armed, "{story}: {:?}", outcome.log);
    };
    for angle_deg in [180.0, 90.0, -90.0] {
        for (slope_rad, speed_m_s, seed) in [
            (0.0, 0.0, 1),
            (0.0, 1.0, 2),
            (0.1745, 0.3, 3),
            (-0.1745, -2.0, 4),
            (0.1, 1.0, 5),
            (-0.05, 0.3, 6),
        ] {
            let tables = format!(
                "chocked_until_armed = true\nplant.spar_imu.misalignment_z_deg = {angle_deg:?}\n\
                 terrain.plane.slope_x_rad = {slope_rad:?}"
            );
            let outcome = fly(5.0, seed, &tables, &at_speed(speed_m_s));
            let story = format!("{angle_deg} deg, {speed_m_s} m/s on {slope_rad}, seed {seed}");
            judge(&outcome, 2.0, 0.12, &story);
        }
    }
    for (speed_m_s, seed) in [(0.0, 1), (1.0, 2), (-2.0, 3)] {
        let turns_over = "{ at_s = 8.0, action = \"sensor-fault\", sensor = \"spar-imu\", fault = \"wrong-sign\" }";
        let outcome = fly(9.0, seed, "", &format!("{}, {turns_over}", at_speed(speed_m_s)));
        judge(
            &outcome,
            8.0,
            0.05,
            &format!("every sign wrong at {speed_m_s} m/s, seed {seed}"),
        );
    }
}

/// Vibration is neither a slide nor a wrong mounting: up to 10 m/s^2 at 5 Hz and more, and up to 0.05 rad/s in the gyros.
#[test]
fn a_vibration_is_no_fault_and_no_slide() {
    for (frequency_hz, slope_rad) in [
        (5.0, 0.0),
        (7.0, 0.0),
        (7.0, 0.1745),
        (10.0, 0.1),
        (20.0, -0.1),
        (50.0, 0.1),
        (199.0, 0.0),
        (200.0, -0.1),
    ] {
        for amplitude_m_s2 in [5.0, 10.0] {
            for (speed_m_s, amplitude_rad_s, seed) in [(0.0, 0.0, 1), (1.0, 0.0, 2), (-1.0, 0.05, 1)] {
                let shaken = format!(
                    "{{ at_s = 6.0, action = \"vibration\", amplitude_m_s2 = {amplitude_m_s2:?}, \
                     amplitude_rad_s = {amplitude_rad_s:?}, frequency_hz = {frequency_hz:?} }}"
                );
                let tables = format!("chocked_until_armed = true\nterrain.plane.slope_x_rad = {slope_rad:?}");
                let outcome = fly(12.0, seed, &tables, &format!("{}, {shaken}", at_speed(speed_m_s)));
                let story = format!(
                    "{amplitude_m_s2} m/s^2, {amplitude_rad_s} rad/s, {frequency_hz} Hz at {speed_m_s} m/s on {slope_rad}, seed {seed}"
                );
                let row = last(&outcome);
                assert_eq!(
                    (row.status.mode, row.status.faults),
                    (Mode::Armed, FaultSet::EMPTY),
                    "{story}"
                );
                let slides = outcome.trace.rows.iter().any(|row| row.status.estimate.sliding);
                assert!(!slides, "{story}");
                let error_m_s = row.truth.speed_m_s - speed_m_s;
                // A vibration as strong as gravity makes the accelerometer's direction useless half of the time. The speed of a
                // vehicle at a walking pace may then be wrong by a quarter, and by half of that at half the amplitude.
                let most_m_s = 0.25 * amplitude_m_s2 / 10.0;
                assert!(error_m_s.abs() < most_m_s, "{story}: {error_m_s} m/s");
            }
        }
    }
}

/// The ground changes under a vibration: the vehicle turns on a plane, or comes onto a ramp. It keeps its speed, and it stops when
/// told: the slope is learnt however the IMU shakes.
#[test]
fn a_vibration_hides_no_change_of_the_slope() {
    let turns = |slope_rad: f64| {
        let on_plane = format!("chocked_until_armed = true\nterrain.plane.slope_x_rad = {slope_rad:?}");
        (on_plane, 0.4, 1.2, format!("turns on {slope_rad}"))
    };
    let climbs = |slope_rad: f64, speed_m_s: f64| {
        let ramp = format!(
            "terrain.profile = [{{ kind = 'ramp', from_m = 2.0, length_m = 8.0, slope_rad = {slope_rad:?}, transition_m = 0.6 }}]"
        );
        (ramp, speed_m_s, 0.0, format!("onto a ramp of {slope_rad}"))
    };
    let ways = [
        turns(-0.14),
        turns(0.14),
        turns(0.2),
        climbs(-0.14, 0.5),
        climbs(0.14, 1.0),
        climbs(0.24, 1.0),
    ];
    for (tables, speed_m_s, yaw_rate_rad_s, way) in ways {
        for (amplitude_m_s2, frequency_hz, seed) in [(5.0, 60.0, 1), (10.0, 60.0, 2), (10.0, 25.0, 1), (10.0, 150.0, 3)]
        {
            let steps = format!(
                "{{ at_s = 3.5, action = 'vibration', amplitude_m_s2 = {amplitude_m_s2:?}, amplitude_rad_s = 0.05, \
                 frequency_hz = {frequency_hz:?} }},
                 {{ at_s = 4.5, action = 'drive', speed_m_s = {speed_m_s:?}, yaw_rate_rad_s = {yaw_rate_rad_s:?} }},
                 {{ at_s = 12.0, action = 'drive' }}"
            );
            let outcome = fly(16.0, seed, &tables, &steps);
            let story = format!("{way}, {amplitude_m_s2} m/s^2 at {frequency_hz} Hz, seed {seed}");
            let row = last(&outcome);
            let status = row.status;
            assert_eq!((status.mode, status.faults), (Mode::Armed, FaultSet::EMPTY), "{story}");
            let rows = outcome.trace.rows.iter().filter(|row| row.time_s() > 4.5);
            let fastest_m_s = rows.map(|row| row.truth.speed_m_s.abs()).fold(0.0, f64::max);
            // Behind the foot of a ramp a vehicle is too fast or too slow until its arm has swung: half a metre per second is the
            // bound for a kerb.
            assert!(fastest_m_s < speed_m_s + 0.5, "{story}: {fastest_m_s} m/s");
            let slope_error_rad = status.estimate.slope_rad - row.truth.slope_rad as f32;
            assert!(slope_error_rad.abs() < 0.035, "{story}: {slope_error_rad} rad");
            assert!(
                row.truth.speed_m_s.abs() < 0.05,
                "{story}: ends at {} m/s",
                row.truth.speed_m_s
            );
        }
    }
}

/// Each IMU has its own clock. However the clocks drift, the registers that a tick reads hold a sample of the last half
/// millisecond: a period of 2 kHz by a clock that may be slow by one per cent.
#[test]
fn no_tick_reads_an_imu_sample_older_than_half_a_millisecond() {
    const PERIOD_S: f64 = 0.5e-3;
    for clock_error in [[0.01, -0.01], [-0.01, 0.01]] {
        let mut settings = PlantSettings::default();
        [settings.arm_imu.clock_error, settings.spar_imu.clock_error] = clock_error;
        let erased = VirtualFlash::erased;
        let mut bench = Bench::with_settings(31, erased(), erased(), &settings);
        bench.run(1000);
        bench.request(Request::Arm);
        bench.run(20);
        bench.drive = Some([1.0, 0.5]);
        let mut oldest_s = [0.0_f64; 2];
        bench.run_watching(5000, |bench| {
            let ages_s = bench.board.world(|world| {
                let arm = world.plant.arm_imu().sample_age_s();
                [arm, world.plant.spar_imu().expect("has a spar").sample_age_s()]
            });
            for (oldest, age) in oldest_s.iter_mut().zip(ages_s) {
                *oldest = oldest.max(age);
            }
        });
        assert_eq!(bench.mode(), Mode::Armed);
        let expected = clock_error.map(|error| PERIOD_S / (1.0 + error));
        for (oldest, most) in oldest_s.into_iter().zip(expected) {
            // The clocks drift through every age.
            assert!(oldest <= most + 1e-9 && oldest > 0.9 * most, "{oldest} s of {most}");
        }
    }
}

/// A standard gravity's thousandth, m/s^2.
const MG_M_S2: f64 = 9.80665e-3;

/// The data sheet of the ICM-42688-P allows an accelerometer's offset of 20 mg along each axis. In spins and turns, on the level and
/// on a slope, it is no slide: speed, path and heading are those of the drive without the offset.
#[test]
fn an_offset_of_the_accelerometer_is_no_slide_in_spins_and_turns() {
    let drives = [
        (0.0, 0.5, 0.0, false),
        (0.0, -2.0, 7.0, false),
        (0.0, -2.0, 7.0, true),
        (0.3, 1.0, 0.0, false),
        (0.8, 2.0, 7.0, false),
        (-0.8, 1.0, 0.0, false),
        (1.2, -1.0, 0.0, false),
        (1.2, 1.0, 7.0, true),
        (2.0, 1.0, 0.0, false),
        (2.0, -2.0, 0.0, false),
    ];
    let fly_with = |(speed_m_s, yaw_rad_s, slope_deg, is_small): (f64, f64, f64, bool),
                    offset_mg: [f64; 3],
                    seed: u64| {
        let vehicle = if is_small { small() } else { reference() };
        let starts_s = [3.0, 4.0, 7.0][(seed % 3) as usize];
        let [x, y, z] = offset_mg.map(|mg| mg * MG_M_S2);
        let tables = format!(
            "seed = {seed}\nplant.arm_imu = {{ accel_bias_x_m_s2 = {x:?}, accel_bias_y_m_s2 = {y:?}, accel_bias_z_m_s2 = {z:?} }}"
        );
        let steps = [
            (0.0, speed_m_s, yaw_rad_s),
            (7.0, speed_m_s, -yaw_rad_s),
            (12.0, 0.0, 0.0),
            (14.0, -speed_m_s, yaw_rad_s),
            (17.0, 0.0, 0.0),
        ];
        let steps: Vec<String> = steps
            .iter()
            .map(|(after_s, speed_m_s, yaw_rad_s)| {
                format!(
                    "{{ at_s = {:?}, action = 'drive', speed_m_s = {speed_m_s:?}, yaw_rate_rad_s = {yaw_rad_s:?} }}",
                    starts_s + after_s
                )
            })
            .collect();
        slope_drive(&vehicle, starts_s + 21.0, slope_deg, &tables, &steps.join(", "))
    };
    let offsets_mg = [
        [20.0, 0.0, 0.0],
        [0.0, -20.0, 0.0],
        [20.0, 20.0, 0.0],
        [20.0, -20.0, 0.0],
        [-20.0, -20.0, -20.0],
    ];
    drives.into_par_iter().enumerate().for_each(|(nth, told)| {
        let seed = nth as u64 + 1;
        let without = fly_with(told, [0.0; 3], seed);
        for offset_mg in offsets_mg {
            let with = fly_with(told, offset_mg, seed);
            let story = format!("{told:?}, {offset_mg:?} mg, seed {seed}");
            assert_eq!(last(&with).status.faults, FaultSet::EMPTY, "{story}");
            for (row, other) in with.trace.rows.iter().zip(&without.trace.rows) {
                let story = format!("{story}, at {} s", row.time_s());
                assert!(!row.status.limits.contains(Limit::Slip), "{story}: told as a slide");
                let speed_m_s = row.truth.speed_m_s - other.truth.speed_m_s;
                assert!(speed_m_s.abs() < 0.1, "{story}: {speed_m_s} m/s faster");
                let aside_m = f64::hypot(row.truth.x_m - other.truth.x_m, row.truth.y_m - other.truth.y_m);
                assert!(aside_m < 0.1, "{story}: {aside_m} m off the path");
                let turned_deg = (row.truth.heading_rad - other.truth.heading_rad).to_degrees();
                assert!(turned_deg.abs() < 1.0, "{story}: {turned_deg} deg");
            }
        }
    });
}
