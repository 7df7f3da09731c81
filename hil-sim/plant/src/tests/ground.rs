//! The plant on its ground: friction, edges, kerbs, joints, slopes.

use super::*;

#[test]
fn a_wheel_that_spins_pulls_with_its_friction_and_no_more() {
    let terrain = Terrain::slope(0.0, 0.05).unwrap();
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
    // Over a second the mean normal force is the weight, except for the remaining effect of the arm's
    // swing.
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

/// Lets the vehicle roll against a kerb. Returns its state just after the impact, its state at the
/// end, and the energy lost by then.
fn roll_at_kerb(height: f64, speed: f64) -> (Truth, Truth, f64) {
    let mut parameters = *coasting_vehicle().parameters();
    parameters.drive_motor.rotor_inertia_kg_m2 = 0.0;
    let vehicle = Vehicle::new(parameters).unwrap();
    let text =
        format!("[friction]\nleft = 5.0\nright = 5.0\n[[profile]]\nkind = \"step\"\nat_m = 0.4\nheight_m = {height}\n");
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
    // Impulsive motion: the wheels roll about the edge, and the arm, a point mass on a rod that hangs
    // straight down, takes part only vertically. The momentum along the new direction is kept: v (M_w
    // cos a + I/r^2) = s (M_w + I/r^2 + m sin^2 a).
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
    let text = format!("[plane]\nslope_y_rad = {slope}\n[friction]\nleft = {mu}\nright = {mu}\n");
    let mut plant = Plant::new(&coasting_vehicle(), &SCALES, terrain(&text), 1).unwrap();
    for _ in 0..1000 {
        plant.advance(1e-3, &OPEN);
    }
    let truth = plant.truth();
    // Downhill is to the left (6.5); nothing turns the vehicle, because both wheels hold equally
    // along the axle.
    let expected = 9.81 * (slope.sin() - mu * slope.cos());
    assert!((truth.side_speed_m_s / expected - 1.0).abs() < 2e-3, "{truth:?}");
    assert!(truth.sliding == [true; 2] && truth.x_m.abs() < 1e-6);
    // A vehicle that rolls on a slope less steep than the friction angle keeps its track.
    let text = format!("[plane]\nslope_y_rad = 0.1\n[friction]\nleft = {mu}\nright = {mu}\n");
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
    let text = "[friction]\nleft = 0.8\nright = 0.02\n";
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, terrain(text), 1).unwrap();
    let mut spun = false;
    for _ in 0..400 {
        plant.advance(1e-3, &drive(0.25, 0.25, 0.0));
        let [left, right] = plant.truth().sliding;
        spun |= right && !left;
    }
    let truth = plant.truth();
    assert!(spun && truth.heading_rad < -0.05, "{truth:?}");
    // With the same duties on dry ground the vehicle drives straight.
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, slope(0.0), 1).unwrap();
    for _ in 0..400 {
        plant.advance(1e-3, &drive(0.25, 0.25, 0.0));
    }
    assert!(plant.truth().heading_rad.abs() < 1e-9);
}
