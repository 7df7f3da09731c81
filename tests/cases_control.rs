//! Standing, driving and turning with wear and assembly errors: play in the gears, and an arm IMU that is mounted askew.

use model::supervise::arming::Mode;
use model::supervise::codes::FaultSet;
use virtual_board::scenario::DriveOutcome;
use virtual_board::scenario::trace::TraceRow;

mod support;
use support::flights::{fly, last};
use support::generated::shown;
use support::slopes::{from, most};

/// Root mean square, over the rows, of the larger of the two drive motors' currents, A.
fn current_rms_a(rows: &[TraceRow]) -> f64 {
    let larger = |row: &TraceRow| row.truth.current_a[0].abs().max(row.truth.current_a[1].abs());
    (rows.iter().map(|row| larger(row).powi(2)).sum::<f64>() / rows.len() as f64).sqrt()
}

/// Half of the difference between the arm's largest and smallest angle, deg.
fn swing_deg(rows: &[TraceRow]) -> f64 {
    let (highest, lowest) = (
        most(rows, |row| row.truth.phi_rad),
        -most(rows, |row| -row.truth.phi_rad),
    );
    0.5 * (highest - lowest).to_degrees()
}

/// Each flight is flown with these two seeds.
const SEEDS: [u64; 2] = [1, 11];

/// Every value with each seed.
fn seeded<T: Copy>(values: impl IntoIterator<Item = T>) -> impl Iterator<Item = (T, u64)> {
    values.into_iter().flat_map(|value| SEEDS.map(|seed| (value, seed)))
}

fn assert_armed(outcome: &DriveOutcome, story: &str) {
    let status = last(outcome).status;
    assert_eq!((status.mode, status.faults), (Mode::Armed, FaultSet::EMPTY), "{story}");
}

/// Gears with 0.3 to 1.5 deg of play at the output and 3000 N m/rad, on level ground and on 2 deg, where the weight barely holds
/// the gears' flanks together. The vehicle comes to rest after its release and after a drive. On level ground its motors take
/// 0.3 A rms at most, and on both the arm swings by no more than 0.05 deg.
#[test]
fn play_of_the_gears_keeps_no_swing_going() {
    // Largest rms current on level ground after the release and after a drive, A, and largest swing of the arm in any case, deg.
    let [mut rest_a, mut after_a, mut worst_deg] = [0.0_f64; 3];
    let drive = "{ at_s = 4.0, action = 'drive', speed_m_s = 0.5 }, { at_s = 8.0, action = 'drive' }";
    for ((play_deg, slope_rad, steps), seed) in seeded([
        (0.3, 0.0, ""),
        (0.6, 0.0, ""),
        (1.0, 0.0, ""),
        (1.5, 0.0, ""),
        (0.6, 0.0, drive),
        (1.0, 0.0, drive),
        (0.3, 0.035, ""),
        (1.0, 0.035, ""),
    ]) {
        let gear = format!("{{ backlash_deg = {play_deg:?}, gear_stiffness_n_m_per_rad = 3000.0 }}");
        let tables = format!(
            "chocked_until_armed = true\nterrain.plane.slope_x_rad = {slope_rad:?}\nplant.left = {gear}\nplant.right = {gear}"
        );
        let outcome = fly(24.0, seed, &tables, steps);
        let rows = from(&outcome, 14.0);
        let (current_a, swing_deg) = (current_rms_a(rows), swing_deg(rows));
        let story = format!("{play_deg} deg of play on {slope_rad} rad, steps {steps:?}, seed {seed}");
        println!("{story}: {current_a:.3} A rms, arm swings by {swing_deg:.3} deg");
        assert_armed(&outcome, &story);
        // The weight on 2 deg takes 0.6 A of each motor.
        let allowed_a = if slope_rad == 0.0 { 0.3 } else { 0.9 };
        assert!(current_a <= allowed_a, "{story}: {current_a} A");
        assert!(swing_deg <= 0.05, "{story}: {swing_deg} deg");
        worst_deg = worst_deg.max(swing_deg);
        if slope_rad == 0.0 {
            let worst_a = if steps.is_empty() { &mut rest_a } else { &mut after_a };
            *worst_a = worst_a.max(current_a);
        }
    }
    shown(
        "gears with 0.3, 0.6, 1, 1.5 deg of play",
        &format!(
            "on the level {rest_a:.2} A rms at most, {after_a:.2} A after a drive; there and on 2 deg the arm swings by at most {worst_deg:.3} deg"
        ),
    );
}

/// Gears with 0.6 to 1.5 deg of play, which carry little torque while the vehicle drives slowly, on the level and down a gentle
/// slope, straight and in turns. The vehicle is never more than 0.2 m/s too fast, the excess that the reverse from a wall is
/// allowed, and the board reports no fault of an encoder.
#[test]
fn play_of_the_gears_lets_no_drive_run_away() {
    let mut worst_m_s = 0.0_f64;
    for play_deg in [0.6, 1.0, 1.5] {
        let gear = format!("{{ backlash_deg = {play_deg:?}, gear_stiffness_n_m_per_rad = 3000.0 }}");
        for slope_rad in [0.0, -0.03] {
            let tables = format!(
                "chocked_until_armed = true\nterrain.plane.slope_x_rad = {slope_rad:?}\nplant.left = {gear}\nplant.right = {gear}"
            );
            for ((speed_m_s, yaw_rad_s), seed) in seeded([(0.05, 0.0), (0.2, 0.6), (0.5, 1.0), (1.0, 0.0)]) {
                let steps = format!(
                    "{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?}, yaw_rate_rad_s = {yaw_rad_s:?} }}"
                );
                let outcome = fly(14.0, seed, &tables, &steps);
                let fast_m_s = most(from(&outcome, 5.0), |row| row.truth.speed_m_s.abs() - speed_m_s);
                let story = format!(
                    "{play_deg} deg of play on {slope_rad} rad, {speed_m_s} m/s, {yaw_rad_s} rad/s, seed {seed}"
                );
                assert_armed(&outcome, &story);
                assert!(fast_m_s <= 0.2, "{story}: {fast_m_s} m/s too fast");
                worst_m_s = worst_m_s.max(fast_m_s);
            }
        }
    }
    shown(
        "gears with 0.6, 1, 1.5 deg of play, driving",
        &format!("at most {worst_m_s:.2} m/s too fast, no fault"),
    );
}

/// The arm IMU is turned by 2 deg about each of its axes, both ways. Turning on the spot at 1 rad/s, the vehicle creeps by less
/// than 5 cm per turn, from the first turn on. Once it has turned, its wheels roll by less than that, too: a false swing rate of a
/// share of the yaw rate would roll them along a circle, which ends where it began.
#[test]
fn a_mounting_error_does_not_make_a_turn_creep() {
    let turn_s = 2.0 * std::f64::consts::PI;
    let turn = "{ at_s = 6.0, action = 'drive', yaw_rate_rad_s = 1.0 }";
    let mut worst_m = 0.0_f64;
    for axis in ["x", "y", "z"] {
        for (degrees, seed) in seeded([-2.0, 2.0]) {
            let tables = format!("plant.arm_imu.misalignment_{axis}_deg = {degrees:?}");
            let outcome = fly(7.0 + 3.0 * turn_s, seed, &tables, turn);
            let place = |time_s: f64| {
                let truth = &from(&outcome, time_s)[0].truth;
                (truth.x_m, truth.y_m, truth.heading_rad)
            };
            // The yaw rate takes 0.25 s to reach its command, which delays every turn by half of that.
            let places: Vec<_> = (0..4).map(|k| place(6.0 + f64::from(k) * turn_s)).collect();
            let creeps_m: Vec<f64> = places
                .windows(2)
                .map(|pair| (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1))
                .collect();
            let rolled_m: f64 = from(&outcome, 6.0 + 2.0 * turn_s)
                .windows(2)
                .take_while(|pair| pair[1].time_s() < 6.0 + 3.0 * turn_s)
                .map(|pair| pair[0].truth.speed_m_s * (pair[1].time_s() - pair[0].time_s()))
                .sum();
            let story = format!("{axis} {degrees} deg, seed {seed}");
            println!("{story}: {creeps_m:.3?} m a turn, {rolled_m:.3} m rolled in the third");
            assert_armed(&outcome, &story);
            assert!(
                places[3].2 - places[0].2 > 5.5 * std::f64::consts::PI,
                "{story}: the vehicle does not turn"
            );
            assert!(creeps_m.iter().all(|creep_m| *creep_m < 0.05), "{story}: {creeps_m:?}");
            assert!(rolled_m.abs() < 0.05, "{story}: {rolled_m} m rolled");
            worst_m = creeps_m.iter().copied().fold(worst_m, f64::max);
        }
    }
    shown(
        "arm IMU turned by +-2 deg",
        &format!(
            "creeps by at most {:.1} cm per turn, from the first turn on",
            100.0 * worst_m
        ),
    );
}

/// While the vehicle turns on the spot on a slope, uphill and downhill change places. The vehicle creeps by less than 5 cm per
/// turn, and its estimate of the slope stays right.
#[test]
fn turning_on_a_slope_does_not_make_the_vehicle_creep() {
    let mut worst_m = [0.0_f64; 2];
    for ((slope_deg, yaw_rad_s), seed) in seeded([(5.0_f64, 1.0_f64), (5.0, -1.9), (10.0, 0.5), (-10.0, 1.5)]) {
        let turn_s = 2.0 * std::f64::consts::PI / yaw_rad_s.abs();
        let steps = format!("{{ at_s = 6.0, action = 'drive', yaw_rate_rad_s = {yaw_rad_s:?} }}");
        let tables = format!(
            "chocked_until_armed = true\nterrain.plane.slope_x_rad = {:?}",
            slope_deg.to_radians()
        );
        let outcome = fly(7.0 + 3.0 * turn_s, seed, &tables, &steps);
        let story = format!("{slope_deg} deg, {yaw_rad_s} rad/s, seed {seed}");
        assert_armed(&outcome, &story);
        let place = |turns: f64| {
            let truth = &from(&outcome, 6.5 + turns * turn_s)[0].truth;
            (truth.x_m, truth.y_m)
        };
        let creeps_m = [0.0, 1.0, 2.0].map(|turn| {
            let (before, after) = (place(turn), place(turn + 1.0));
            (after.0 - before.0).hypot(after.1 - before.1)
        });
        let error_deg = most(from(&outcome, 8.0), |row| {
            (f64::from(row.status.estimate.slope_rad) - row.truth.slope_rad)
                .abs()
                .to_degrees()
        });
        println!("{story}: {creeps_m:.3?} m a turn, slope within {error_deg:.2} deg");
        assert!(creeps_m.iter().all(|m| *m < 0.05), "{story}: {creeps_m:?} m");
        // The accelerometer's bias alone makes 0.27 deg of tilt, and by alpha L / (1 + S) 0.15 deg of slope.
        assert!(error_deg < 0.5, "{story}: {error_deg} deg");
        let worst_m = &mut worst_m[usize::from(slope_deg.abs() > 7.5)];
        *worst_m = creeps_m.into_iter().fold(*worst_m, f64::max);
    }
    let [on_5_cm, on_10_cm] = worst_m.map(|creep_m| 100.0 * creep_m);
    shown(
        "turning on the spot on slopes",
        &format!("creeps by at most {on_5_cm:.1} cm per turn on 5 deg, {on_10_cm:.1} cm on 10"),
    );
}
