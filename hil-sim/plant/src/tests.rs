//! The whole plant.

use std::path::Path;

use model::board::{BoardScales, ImuScales};
use model::vehicle::Vehicle;

use super::*;
use crate::noise::Noise;
use crate::terrain::Terrain;

/// Scales of a board, as the drive board has them.
pub(super) const SCALES: BoardScales = BoardScales {
    battery_v_per_count: 66.0 / 65536.0,
    current_a_per_count: 120.0 / 65536.0,
    current_zero_count: 32768,
    duty_max: 0.94,
    imu: ImuScales {
        gyro_lsb_per_deg_s: 32.8,
        accel_lsb_per_g: 4096.0,
    },
};

/// The reference vehicle.
pub(super) fn reference_vehicle() -> Vehicle<f64> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles/reference.toml");
    vehicle_file::read_vehicle(&file).unwrap()
}

/// The reference vehicle without its camera.
pub(super) fn bare_vehicle() -> Vehicle<f64> {
    let mut parameters = *reference_vehicle().parameters();
    parameters.spar = None;
    Vehicle::new(parameters).unwrap()
}

/// The vehicle without its camera and without friction in bearings and gearboxes: it coasts for ever.
fn coasting_vehicle() -> Vehicle<f64> {
    let mut parameters = *bare_vehicle().parameters();
    parameters.body.bearing_damping_n_m_s = 0.0;
    parameters.drive_motor.coulomb_friction_n_m = 0.0;
    Vehicle::new(parameters).unwrap()
}

/// Sets the vehicle rolling.
fn roll(plant: &mut Plant, speed_m_s: f64) {
    let (_, u) = plant.body_mut().state_mut();
    u[FORWARD] = speed_m_s;
    u[RIGHT] = speed_m_s / 0.25;
    u[LEFT] = speed_m_s / 0.25;
}

const OPEN: [BridgeState; MOTORS] = [BridgeState::Open; MOTORS];

fn terrain(text: &str) -> Terrain {
    toml::from_str(text).unwrap()
}

fn incline(slope_x_rad: f64) -> Terrain {
    Terrain::incline(slope_x_rad, 0.8).unwrap()
}

fn drive(left: f64, right: f64, camera: f64) -> [BridgeState; MOTORS] {
    [left, right, camera].map(BridgeState::Duty)
}

/// Switches an IMU on as the firmware does.
fn start_imu(chip: &mut Icm42688p) {
    chip.transfer(&mut [0x4f, 0x26, 0x26]);
    chip.transfer(&mut [0x4e, 0x0f]);
}

/// Accelerometer and gyro, in LSB.
fn read_imu(chip: &mut Icm42688p) -> [i16; 6] {
    let mut bytes = [0; 13];
    bytes[0] = 0x1f | 0x80;
    chip.transfer(&mut bytes);
    core::array::from_fn(|i| i16::from_be_bytes([bytes[1 + 2 * i], bytes[2 + 2 * i]]))
}

#[test]
fn on_the_level_it_stands_and_its_sensors_say_so() {
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, incline(0.0), 3).unwrap();
    start_imu(plant.arm_imu());
    start_imu(plant.spar_imu().unwrap());
    for _ in 0..500 {
        plant.advance(1e-3, &OPEN);
    }
    let truth = plant.truth();
    assert!(truth.x_m.abs() < 1e-9 && truth.phi_rad.abs() < 1e-9);
    assert_eq!(plant.counters(), [0; 3]);
    for chip in 0..2 {
        let words = if chip == 0 {
            read_imu(plant.arm_imu())
        } else {
            read_imu(plant.spar_imu().unwrap())
        };
        // Bias of a few mg (4 LSB each) and a few tenths of a deg/s (33 LSB each): not exactly still.
        assert!((i32::from(words[2]) - 4096).abs() < 40, "{words:?}");
        assert!(
            words[..2].iter().all(|a| a.abs() < 40) && words[3..].iter().all(|w| w.abs() < 35),
            "{words:?}"
        );
        assert!(words[3..].iter().any(|w| *w != 0), "a real gyro is never quite zero");
    }
    let (battery, current) = plant.analog();
    assert!((f64::from(battery) * 66.0 / 65536.0 - 25.188).abs() < 0.015);
    assert!(current.iter().all(|c| c.abs_diff(32768) < 12));
    let weight: f64 = truth.normal_n.iter().sum();
    assert!((weight - (13.6 + 0.51 + 1.53 + 2.04) * 9.81).abs() < 1e-3, "{weight} N");
}

#[test]
fn a_disarmed_vehicle_rolls_away_and_is_not_righted() {
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, incline(0.0873), 3).unwrap();
    for _ in 0..3000 {
        plant.advance(1e-3, &OPEN);
    }
    let truth = plant.truth();
    // Freely it would be at 0.5 g sin(5 deg) t^2 = 3.8 m; damping and wheels take some of it.
    assert!((-3.8..-0.5).contains(&truth.x_m), "{} m", truth.x_m);
    assert!(truth.speed_m_s < -0.5, "and is still rolling: {} m/s", truth.speed_m_s);
    assert!(
        truth.current_a.iter().all(|i| *i == 0.0),
        "no current flows through open bridges"
    );
    // Only a gearbox friction that can carry the slope's torque may hold it: 8.7 N m here takes 4.4 a side.
    let mut parameters = *reference_vehicle().parameters();
    parameters.drive_motor.coulomb_friction_n_m = 5.0;
    let mut held = Plant::new(&Vehicle::new(parameters).unwrap(), &SCALES, incline(0.0873), 3).unwrap();
    for _ in 0..10_000 {
        held.advance(1e-3, &OPEN);
        // Arm and wheels rock as one body.
        let truth = held.truth();
        assert!(truth.x_m.abs() < 0.15, "{truth:?}");
        assert!(
            (truth.wheel_rate_rad_s[0] + truth.phi_rate_rad_s).abs() < 2e-6,
            "{truth:?}"
        );
    }
    // With chocks it stands, and with them gone it rolls.
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, incline(0.0873), 3).unwrap();
    plant.set_chocked(true);
    for _ in 0..1000 {
        plant.advance(1e-3, &OPEN);
    }
    assert!(plant.truth().x_m.abs() < 2e-5, "{}", plant.truth().x_m);
    plant.set_chocked(false);
    for _ in 0..1000 {
        plant.advance(1e-3, &OPEN);
    }
    assert!(plant.truth().x_m < -0.1);
}

#[test]
fn one_seed_one_run() {
    let run = |seed| {
        let mut plant = Plant::new(&reference_vehicle(), &SCALES, incline(0.05), seed).unwrap();
        start_imu(plant.arm_imu());
        let mut log = Vec::new();
        for k in 0..300 {
            let duty = 0.2 * f64::from(k) / 300.0;
            plant.advance(1e-3, &drive(duty, 0.9 * duty, 0.01));
            log.push((plant.counters(), plant.analog(), read_imu(plant.arm_imu())));
        }
        (log, plant.truth().x_m.to_bits())
    };
    let (a, b, c) = (run(1), run(1), run(2));
    assert_eq!(a, b);
    assert_eq!(a.1, c.1, "the world does not depend on the sensors' noise");
    assert_ne!(a.0, c.0);
}

#[test]
fn steps_ten_times_shorter_change_little() {
    // Everything at once: spar, turning, a ramp, patches that make it slip, duties that jump.
    let text = r#"
        [friction]
        right = 0.8
        left = 0.8
        [[patch]]
        from_m = 1.0
        to_m = 1.6
        right = 0.05
        left = 0.3
        [[profile]]
        kind = "ramp"
        from_m = 0.4
        length_m = 4.0
        slope_rad = 0.06
        transition_m = 0.5
    "#;
    let run = |substep: f64| {
        let mut plant = Plant::new(&reference_vehicle(), &SCALES, terrain(text), 1).unwrap();
        plant.set_substep_s(substep);
        let mut log = Vec::new();
        let mut slid = false;
        for k in 0..4000 {
            let duty = if k % 1000 < 500 { 0.22 } else { 0.16 };
            plant.advance(1e-3, &drive(duty, duty * 1.02, 0.02));
            let truth = plant.truth();
            slid |= truth.sliding.iter().any(|s| *s);
            log.push(truth);
        }
        assert!(slid);
        log
    };
    let (coarse, fine) = (run(SUBSTEP_S), run(SUBSTEP_S / 10.0));
    let worst = |of: fn(&Truth) -> f64| {
        let difference = |(a, b): (&Truth, &Truth)| (of(a) - of(b)).abs();
        coarse.iter().zip(&fine).map(difference).fold(0.0, f64::max)
    };
    let errors = [
        worst(|t| t.x_m),
        worst(|t| t.heading_rad),
        worst(|t| t.phi_rad),
        worst(|t| t.spar_rad),
        worst(|t| t.speed_m_s),
    ];
    let bounds = [2e-3, 4e-3, 2e-3, 2e-3, 1e-2];
    for (error, bound) in errors.iter().zip(bounds) {
        assert!(*error < bound, "{errors:?}");
        assert!(*error > 1e-9, "a difference there must be: {errors:?}");
    }
    assert!(fine.last().unwrap().x_m > 2.0, "{:?}", fine.last());
}

#[test]
fn a_wheel_that_spins_pulls_with_its_friction_and_no_more() {
    let terrain = Terrain::incline(0.0, 0.05).unwrap();
    let mut plant = Plant::new(&bare_vehicle(), &SCALES, terrain, 1).unwrap();
    let mass = 13.6;
    let (mut normal, mut pull, mut spun) = (0.0, 0.0, 0);
    for _ in 0..4000 {
        plant.advance(2.5e-4, &drive(0.6, 0.6, 0.0));
        let t = plant.truth();
        normal += 2.5e-4 * t.normal_n.iter().sum::<f64>();
        pull += 2.5e-4 * t.longitudinal_n.iter().sum::<f64>();
        spun += usize::from(t.sliding[0] && t.slip_m_s[0] < -0.1);
    }
    assert!(spun > 3000, "spun in {spun} of 4000 quarters of a ms");
    assert!(
        (pull / (0.05 * normal) - 1.0).abs() < 0.02,
        "{pull} of {} N s",
        0.05 * normal
    );
    // Over a second the mean normal force is the weight, within what the arm's swing leaves.
    assert!((normal / (mass * 9.81) - 1.0).abs() < 0.2, "{normal} N s");
    let t = plant.truth();
    let momentum = mass * t.speed_m_s + 12.24 * 0.2 * t.phi_rad.cos() * t.phi_rate_rad_s;
    assert!((momentum / pull - 1.0).abs() < 0.01, "{momentum} against {pull} N s");
}

#[test]
fn off_a_high_edge_at_speed_it_flies_as_a_stone_does_and_lands() {
    // v^2 > g r: the wheel leaves the edge at once instead of turning about it.
    let text = "[[profile]]\nkind = \"step\"\nat_m = 0.1\nheight_m = -0.07\n";
    let mut plant = Plant::new(&coasting_vehicle(), &SCALES, terrain(text), 1).unwrap();
    let v = 4.0;
    roll(&mut plant, v);
    let (mut left_at, mut landed_at, mut deepest) = (None, None, 0.0_f64);
    for _ in 0..2000 {
        plant.advance(1e-4, &OPEN);
        let t = plant.truth();
        if t.lifted == [true; 2] {
            left_at.get_or_insert(t.time_s);
            deepest = deepest.min(t.height_m);
        } else if left_at.is_some() {
            landed_at.get_or_insert(t.time_s);
        }
    }
    let flight = landed_at.unwrap() - left_at.unwrap();
    let stone = (2.0_f64 * 0.07 / 9.81).sqrt();
    assert!((flight / stone - 1.0).abs() < 0.01, "{flight} s, a stone {stone} s");
    assert!((plant.truth().height_m + 0.07).abs() < 1e-12);
    assert!(deepest < -0.06 && plant.truth().normal_n.iter().all(|n| *n > 0.0));
}

/// Rolls at a kerb; the vehicle just after the impact, at the end, and the energy lost by then.
fn roll_at_kerb(height: f64, speed: f64) -> (Truth, Truth, f64) {
    let mut parameters = *coasting_vehicle().parameters();
    parameters.drive_motor.rotor_inertia_kg_m2 = 0.0;
    let vehicle = Vehicle::new(parameters).unwrap();
    let text =
        format!("[friction]\nright = 5.0\nleft = 5.0\n[[profile]]\nkind = \"step\"\nat_m = 0.4\nheight_m = {height}\n");
    let mut plant = Plant::new(&vehicle, &SCALES, terrain(&text), 1).unwrap();
    roll(&mut plant, speed);
    let start = plant.body().energy(plant.ground());
    let mut struck = None;
    for _ in 0..10_000 {
        plant.advance(5e-5, &OPEN);
        let truth = plant.truth();
        if truth.normal_n[0] > 1000.0 {
            struck.get_or_insert(truth);
        }
    }
    let end = plant.truth();
    (struck.unwrap_or(end), end, start - plant.body().energy(plant.ground()))
}

#[test]
fn a_kerb_takes_the_speed_that_a_rigid_wheel_loses_at_its_edge() {
    // Impulsive motion with the wheels rolling about the edge and the arm, a point on a rod that hangs
    // straight down, taking part only vertically. The momentum along the new direction is kept:
    // v (M_w cos a + I/r^2) = s (M_w + I/r^2 + m sin^2 a).
    let (height, v) = (0.02, 2.0);
    let (struck, over, lost) = roll_at_kerb(height, v);
    let cos = 1.0 - height / 0.25;
    let (wheels, spin, arm) = (1.36, 0.0561 / 0.0625, 12.24);
    let expected = v * (wheels * cos + spin) / (wheels + spin + arm * (1.0 - cos * cos));
    // The path's slope turns the speed along the plane into speed along the path.
    let found = struck.wheel_rate_rad_s[0] * 0.25;
    assert!((found / expected - 1.0).abs() < 0.02, "{found} against {expected} m/s");
    let mass = wheels + arm;
    let before = 0.5 * (mass + spin) * v * v;
    let after = 0.5 * (wheels + spin + arm * (1.0 - cos * cos)) * expected * expected + 0.5 * arm * v * v;
    assert!(
        (lost / (before - after) - 1.0).abs() < 0.05,
        "lost {lost} of {} J",
        before - after
    );
    assert!(over.x_m > 0.5 && over.height_m >= height - 1e-9, "{over:?}");

    let (_, stopped, lost) = roll_at_kerb(0.07, 0.6);
    assert!(
        stopped.x_m < 0.4 && stopped.height_m < 0.05 && lost > 0.0,
        "{stopped:?}"
    );
    let (_, free, lost) = roll_at_kerb(0.0, 2.0);
    assert!(
        (free.speed_m_s - 2.0).abs() < 1e-5 && lost.abs() < 1e-4,
        "{lost} J, {free:?}"
    );
}

#[test]
fn joints_shake_the_accelerometer_at_every_rail_length() {
    let text = "[[profile]]\nkind = \"joints\"\nfrom_m = 0.2\nrail_length_m = 0.5\ngap_m = 0.01\ncount = 3\n";
    let run = |text: &str| {
        let mut plant =
            Plant::with_imu_errors(&coasting_vehicle(), &SCALES, terrain(text), 1, imu::ImuErrors::NONE).unwrap();
        start_imu(plant.arm_imu());
        roll(&mut plant, 1.0);
        let mut jolts = Vec::new();
        for ms in 0..1500 {
            plant.advance(1e-3, &OPEN);
            let z = f64::from(read_imu(plant.arm_imu())[2]) / 4096.0;
            if ms > 40 && (z - 1.0).abs() > 0.5 && jolts.last().is_none_or(|x: &f64| plant.truth().x_m - x > 0.1) {
                jolts.push(plant.truth().x_m);
            }
        }
        jolts
    };
    let jolts = run(text);
    assert_eq!(jolts.len(), 3, "{jolts:?}");
    for (found, expected) in jolts.iter().zip([0.2, 0.7, 1.2]) {
        assert!((found - expected).abs() < 0.03, "{jolts:?}");
    }
    assert!(run("").is_empty());
}

#[test]
fn across_a_slippery_side_slope_it_slides_sideways() {
    let (slope, mu) = (0.3_f64, 0.2_f64);
    let text = format!("[plane]\nslope_y_rad = {slope}\n[friction]\nright = {mu}\nleft = {mu}\n");
    let mut plant = Plant::new(&coasting_vehicle(), &SCALES, terrain(&text), 1).unwrap();
    for _ in 0..1000 {
        plant.advance(1e-3, &OPEN);
    }
    let truth = plant.truth();
    // Downhill is to the left (6.5); nothing turns it, for both wheels hold alike along the axle.
    let expected = 9.81 * (slope.sin() - mu * slope.cos());
    assert!((truth.side_speed_m_s / expected - 1.0).abs() < 2e-3, "{truth:?}");
    assert!(truth.sliding == [true; 2] && truth.x_m.abs() < 1e-6);
    // Rolling on a slope less steep than its friction it keeps its track.
    let text = format!("[plane]\nslope_y_rad = 0.1\n[friction]\nright = {mu}\nleft = {mu}\n");
    let mut plant = Plant::new(&coasting_vehicle(), &SCALES, terrain(&text), 1).unwrap();
    roll(&mut plant, 1.0);
    for _ in 0..1000 {
        plant.advance(1e-3, &OPEN);
    }
    let truth = plant.truth();
    assert!(
        truth.side_speed_m_s.abs() < 1e-5 && (truth.x_m - 1.0).abs() < 1e-3,
        "{truth:?}"
    );
}

#[test]
fn one_wheel_on_ice_turns_it_towards_that_wheel() {
    let text = "[friction]\nright = 0.02\nleft = 0.8\n";
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, terrain(text), 1).unwrap();
    let mut spun = false;
    for _ in 0..400 {
        plant.advance(1e-3, &drive(0.25, 0.25, 0.0));
        let [left, right] = plant.truth().sliding;
        spun |= right && !left;
    }
    let truth = plant.truth();
    assert!(spun && truth.heading_rad < -0.05, "{truth:?}");
    // And the same duties on dry ground go straight.
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, incline(0.0), 1).unwrap();
    for _ in 0..400 {
        plant.advance(1e-3, &drive(0.25, 0.25, 0.0));
    }
    assert!(plant.truth().heading_rad.abs() < 1e-9);
}

#[test]
fn any_vehicle_on_any_ground_stays_finite_and_within_its_means() {
    let mut dice = Noise::new(99, 0);
    let mut uniform = |low: f64, high: f64| low + (high - low) * (dice.bits() >> 11) as f64 / (1_u64 << 53) as f64;
    let mut ran = 0;
    for round in 0..400 {
        let mut parameters = *reference_vehicle().parameters();
        for number in 0..parameters.count() {
            let (table, field) = parameters.field(number).unwrap();
            let value = parameters.value(number).unwrap();
            if table == "control" || table == "safety" || table == "battery" {
                continue;
            }
            // Nothing is controlled here: no levelling, which any spar may have.
            if field.name.ends_with("_gain") {
                parameters.set(number, 0.0).unwrap();
                continue;
            }
            let value = (value * 5.0_f64.powf(uniform(-1.0, 1.0))).clamp(field.min, field.max);
            parameters.set(number, value).unwrap();
        }
        parameters.control.kp = -10.0;
        if uniform(0.0, 1.0) < 0.2 {
            parameters.spar = None;
        }
        if uniform(0.0, 1.0) < 0.2 {
            parameters.drive_motor.inductance_h = 0.0;
            parameters.body.wheels_inertia_kg_m2 = 0.0;
            parameters.drive_motor.rotor_inertia_kg_m2 = 0.0;
        }
        // A few draws contradict themselves: arm heavier than the whole, current limit over the fault's.
        let Ok(vehicle) = Vehicle::new(parameters) else {
            continue;
        };
        let step = 0.2 * parameters.body.wheel_radius_m;
        let text = format!(
            "[plane]\nslope_x_rad = {}\nslope_y_rad = {}\n[friction]\nright = {}\nleft = {}\n\
             [[profile]]\nkind = \"step\"\nat_m = 0.3\nheight_m = {step}\n\
             [[profile]]\nkind = \"step\"\nat_m = -0.6\nheight_m = {step}\n",
            uniform(-0.5, 0.5),
            uniform(-0.5, 0.5),
            uniform(0.0, 1.5),
            uniform(0.0, 1.5),
        );
        let mut plant = Plant::new(&vehicle, &SCALES, terrain(&text), round).unwrap();
        ran += 1;
        let mut top = 0.0_f64;
        for _ in 0..20 {
            let bridges = [(); MOTORS].map(|()| match uniform(-1.2, 1.0) {
                duty if duty < -1.0 => BridgeState::Open,
                duty => BridgeState::Duty(duty),
            });
            for _ in 0..25 {
                plant.advance(1e-3, &bridges);
            }
            let t = plant.truth();
            let finite = [
                t.x_m,
                t.y_m,
                t.heading_rad,
                t.phi_rad,
                t.spar_rad,
                t.ballast_rate_rad_s,
                t.battery_v,
            ];
            assert!(
                finite.iter().all(|v| v.is_finite()),
                "round {round}: {t:?} {parameters:?}"
            );
            assert!(t.battery_v > 0.0 && t.battery_v < 60.0, "round {round}: {t:?}");
            assert!(t.normal_n.iter().all(|n| *n >= 0.0), "round {round}: {t:?}");
            top = top.max(plant.body().energy(plant.ground()));
        }
        // The motors cannot have put in more than the battery's power at its chopping limit over half a
        // second, and gravity what the slopes give over what it moved.
        let t = plant.truth();
        let mass = plant.body().inertia().total_mass;
        let electric = 3.0 * 60.0 * 30.0 * 0.5;
        let fall = mass * 9.81 * 0.8 * (t.x_m.abs() + t.y_m.abs() + 1.0);
        assert!(
            top < electric + fall,
            "round {round}: {top} J of {electric} + {fall} {t:?}"
        );
    }
    assert!(ran > 100, "{ran} of 400 draws were vehicles");
}
