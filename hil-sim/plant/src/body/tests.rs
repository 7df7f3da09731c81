//! Compares the bodies with the thesis's corrected models, with balances and with results computed by
//! hand.

use model::dynamics::coupled::{Bearing, Coupled, CoupledParameters};
use model::dynamics::planar::{self, Planar, PlanarParameters};
use model::integrate::rk4_step;

use super::*;
use crate::terrain::{Friction, Plane, Terrain};
use crate::tests::{bare_vehicle, reference_vehicle};

mod in_space;
mod rolling;

const NO_TORQUE: [JointTorque; MOTORS] = [JointTorque::NONE; MOTORS];

fn ground(slope_x_rad: f64, slope_y_rad: f64, friction: f64, radius: f64) -> Ground {
    let plane = Plane {
        slope_x_rad,
        slope_y_rad,
    };
    let friction = Friction {
        left: friction,
        right: friction,
    };
    Ground::new(Terrain::new(plane, friction, vec![], vec![]).unwrap(), radius).unwrap()
}

/// The drive's linear motor: `volts` behind the resistance, back-EMF as damping.
fn motor(vehicle: &Vehicle<f64>, volts: f64) -> JointTorque {
    let m = &vehicle.parameters().drive_motor;
    let torque = m.torque_constant_n_m_per_a * m.gear_ratio;
    JointTorque {
        constant_n_m: torque * volts / m.resistance_ohm,
        damping_n_m_s: torque * m.back_emf_constant_v_s_per_rad * m.gear_ratio / m.resistance_ohm,
        ..JointTorque::NONE
    }
}

/// Runs body and planar model in parallel under a voltage step. Returns the largest differences of
/// [theta, phi, theta', phi'] (nondimensional) over `seconds`.
fn planar_difference(h: f64, volts: f64, seconds: f64) -> [f64; 4] {
    let vehicle = bare_vehicle();
    let beta = 0.0873;
    let ground = ground(beta, 0.0, 5.0, vehicle.parameters().body.wheel_radius_m);
    let mut body = Body::new(&vehicle, &ground);
    let reference = Planar::new(vehicle.planar(beta));
    let scales = vehicle.scales();
    let mut x = [0.0; 4];
    let joint = motor(&vehicle, volts);
    let u = scales.voltage_from_si(volts);
    let mut worst = [0.0_f64; 4];
    for _ in 0..(seconds / h).round() as usize {
        body.step(h, &ground, &[joint, joint, NO_TORQUE[2]]);
        for _ in 0..4 {
            x = reference.rk4(&x, u, 0.25 * h / scales.time_s);
        }
        let (q, v) = (body.position(), body.speed());
        let found = [
            q[RIGHT],
            q[PHI] + beta,
            scales.rate_from_si(v[RIGHT]),
            scales.rate_from_si(v[PHI]),
        ];
        for i in 0..4 {
            worst[i] = worst[i].max((found[i] - x[i]).abs());
        }
    }
    // The vehicle has really moved: the planar response swings well beyond the tolerances.
    assert!(x[planar::THETA].abs() > 1.0 && worst[1] > 0.0);
    worst
}

#[test]
fn straight_on_a_slope_it_is_the_planar_vehicle() {
    // A step of 7 V initially needs a friction of 3 times the normal force, which is less than the
    // available friction.
    let coarse = planar_difference(5e-4, 7.0, 3.0);
    assert!(coarse.iter().all(|&e| e < 4e-5), "{coarse:?}");
    let fine = planar_difference(5e-5, 7.0, 3.0);
    // The remaining difference is the contact's creep (a share of 1e-5 m/s), which no step size removes.
    assert!(fine.iter().all(|&e| e < 5e-6), "{fine:?}");
}

#[test]
fn with_the_spar_it_is_the_coupled_vehicle_pivoted_on_the_arm() {
    let vehicle = {
        let mut p = *reference_vehicle().parameters();
        // The coupled model has no reflected inertia of the ballast motor.
        if let Some((_, motor)) = p.spar.as_mut() {
            motor.rotor_inertia_kg_m2 = 0.0;
        }
        Vehicle::new(p).unwrap()
    };
    let p = vehicle.parameters();
    let (camera, _) = p.spar.unwrap();
    let (r, mass) = (p.body.wheel_radius_m, p.body.total_mass_kg);
    let scales = vehicle.scales();
    let beta = 0.0873;
    let torque = scales.torque_n_m;
    let camera_damping = 0.06;
    let reference = Coupled::new(CoupledParameters {
        planar: vehicle.planar(beta),
        lp: camera.spar_length_m / r,
        lm: camera.motor_distance_m / r,
        lr: camera.ballast_distance_m / r,
        kc: camera.camera_mass_kg / mass,
        km: camera.motor_mass_kg / mass,
        kr: camera.ballast_mass_kg / mass,
        zeta_c: camera.spar_damping_n_m_s / (torque * scales.time_s),
        xi_c: camera_damping / (torque * scales.time_s),
        bearing: Bearing::Arm,
    });
    let ground = ground(beta, 0.0, 5.0, r);
    let mut body = Body::new(&vehicle, &ground);
    // Gentle enough for the wheels to stay on the ground.
    let volts = 5.0;
    let camera_torque = 0.1;
    let joint = motor(&vehicle, volts);
    let camera_joint = JointTorque {
        constant_n_m: camera_torque,
        damping_n_m_s: camera_damping,
        ..NO_TORQUE[2]
    };
    let mut x = [0.0; 8];
    let h = 1e-4;
    for _ in 0..20_000 {
        body.step(h, &ground, &[joint, joint, camera_joint]);
        let (drive, ballast) = (scales.voltage_from_si(volts), camera_torque / torque);
        x = rk4_step(&x, h / scales.time_s, |x| reference.rate(x, drive, ballast));
    }
    let q = body.position();
    let found = [q[RIGHT], q[PHI] + beta, q[SPAR] + beta, q[BALLAST] - q[SPAR]];
    for (i, (found, expected)) in found.iter().zip(&x).enumerate() {
        assert!((found - expected).abs() < 5e-4, "state {i}: {found} against {expected}");
    }
    assert!(
        x[2].abs() > 0.02 && x[3].abs() > 0.02,
        "spar and ballast hardly move: {x:?}"
    );
}

/// A turning, slipping vehicle with a swinging spar on a slope in both directions, for balances and
/// symmetry.
fn lively(vehicle: &Vehicle<f64>, ground: &Ground, mirror: f64) -> Body {
    let mut body = Body::new(vehicle, ground);
    let (q, u) = body.state_mut();
    q[YAW] = 0.3 * mirror;
    q[PHI] = 0.5;
    q[SPAR] = -0.2;
    q[BALLAST] = 0.4;
    u[FORWARD] = 0.9;
    u[SIDE] = 0.1 * mirror;
    u[YAW] = 0.8 * mirror;
    let d = 0.25;
    let r = 0.25;
    u[RIGHT] = (0.9 + 0.8 * mirror * d) / r;
    u[LEFT] = (0.9 - 0.8 * mirror * d) / r;
    u[PHI] = 1.0;
    u[SPAR] = -1.0;
    u[BALLAST] = 2.0;
    body
}

#[test]
fn energy_is_kept_without_friction_and_lost_to_exactly_the_work_of_friction() {
    let vehicle = {
        let mut p = *reference_vehicle().parameters();
        p.body.bearing_damping_n_m_s = 0.0;
        p.spar.as_mut().unwrap().0.spar_damping_n_m_s = 0.0;
        Vehicle::new(p).unwrap()
    };
    // On ice nothing takes energy away.
    let ice = ground(0.06, 0.04, 0.0, 0.25);
    let mut body = lively(&vehicle, &ice, 1.0);
    let start = body.energy(&ice);
    let kinetic_scale = 20.0;
    for _ in 0..20_000 {
        body.step(1e-4, &ice, &NO_TORQUE);
    }
    let drift = (body.energy(&ice) - start).abs();
    assert!(drift < 2e-4 * kinetic_scale, "drift {drift} J");

    // With dry friction under the wheels and in the gears, the loss is the work of those forces.
    let road = ground(0.06, 0.04, 0.3, 0.25);
    let mut body = lively(&vehicle, &road, 1.0);
    let joints = [0.5, 0.5, 0.02].map(|coulomb_n_m| JointTorque {
        coulomb_n_m,
        ..NO_TORQUE[0]
    });
    let start = body.energy(&road);
    let mut work = 0.0;
    let h = 2e-5;
    let mut slid = false;
    for _ in 0..25_000 {
        let before = *body.speed();
        body.step(h, &road, &joints);
        let after = *body.speed();
        let mean: Speeds = core::array::from_fn(|i| 0.5 * (before[i] + after[i]));
        let d = 0.25;
        for (i, (wheel, sign)) in [(LEFT, -1.0), (RIGHT, 1.0)].into_iter().enumerate() {
            let contact = body.wheels()[i];
            slid |= contact.sliding;
            let slip = mean[FORWARD] + sign * d * mean[YAW] - 0.25 * mean[wheel];
            work += h * (contact.longitudinal_n * slip + contact.lateral_n * mean[SIDE]);
        }
        for (joint, row) in joints.iter().zip(&JOINTS) {
            let rate = dot(row, &mean);
            work -= h * joint.coulomb_n_m * rate.abs();
        }
    }
    let lost = start - body.energy(&road);
    assert!(slid && lost > 1.0, "{lost} J lost");
    assert!(
        (lost + work).abs() < 0.01 * lost,
        "{lost} J lost against {work} J of work"
    );
}

#[test]
fn mirrored_starts_give_mirrored_runs() {
    let vehicle = reference_vehicle();
    let run = |mirror: f64| {
        let ground = ground(0.06, 0.04 * mirror, 0.25, 0.25);
        let mut body = lively(&vehicle, &ground, mirror);
        let (a, b) = (1.5, -0.5);
        let [left, right] = if mirror > 0.0 { [a, b] } else { [b, a] };
        let joints = [left, right, 0.05].map(|constant_n_m| JointTorque {
            constant_n_m,
            damping_n_m_s: 0.1,
            coulomb_n_m: 0.02,
            ..JointTorque::NONE
        });
        for _ in 0..2000 {
            body.step(5e-4, &ground, &joints);
        }
        body
    };
    let (a, b) = (run(1.0), run(-1.0));
    let close = |x: f64, y: f64| (x - y).abs() < 1e-7 * (1.0 + x.abs());
    for i in [FORWARD, PHI, SPAR, BALLAST] {
        assert!(
            close(a.position()[i], b.position()[i]) && close(a.speed()[i], b.speed()[i]),
            "state {i}"
        );
    }
    for i in [SIDE, YAW] {
        assert!(
            close(a.position()[i], -b.position()[i]) && close(a.speed()[i], -b.speed()[i]),
            "state {i}"
        );
    }
    assert!(close(a.position()[RIGHT], b.position()[LEFT]));
    assert!(close(a.wheels()[0].normal_n, b.wheels()[1].normal_n));
    assert!(a.position()[SIDE].abs() > 0.02 && a.position()[YAW].abs() > 0.02);
}

#[test]
fn a_blocked_vehicle_slides_down_a_slope_steeper_than_its_friction() {
    // The hanging masses rest relative to the axle only if the test releases them at the angle at which
    // gravity and inertia balance, tan = (g sin - a) / (g cos).
    let vehicle = bare_vehicle();
    let (slope, mu) = (0.3_f64, 0.2_f64);
    let g = model::vehicle::GRAVITY_M_S2;
    let expected = -g * (slope.sin() - mu * slope.cos());
    let ground = ground(slope, 0.0, mu, 0.25);
    let mut body = Body::new(&vehicle, &ground);
    body.set_chocked(true);
    let angle = (-(g * slope.sin() + expected)).atan2(g * slope.cos());
    body.state_mut().0[PHI] = angle;
    let steps = 1000;
    let h = 5e-4;
    for _ in 0..steps {
        body.step(h, &ground, &NO_TORQUE);
    }
    let speed = body.speed()[FORWARD];
    let reached = expected * h * f64::from(steps);
    assert!((speed / reached - 1.0).abs() < 2e-3, "{speed} against {reached} m/s");
    assert!(body.speed()[RIGHT].abs() < 1e-6, "the wheels turn");
    let [_, right] = *body.wheels();
    assert!(right.sliding);
    assert!((right.longitudinal_n / (mu * right.normal_n) - 1.0).abs() < 1e-3);
    // On a slope less steep than the friction angle the vehicle stays, except for the regularisation's
    // creep.
    let flat = self::ground(0.15, 0.0, mu, 0.25);
    let mut body = Body::new(&vehicle, &flat);
    body.set_chocked(true);
    for _ in 0..2000 {
        body.step(h, &flat, &NO_TORQUE);
    }
    let crept = body.position()[FORWARD].abs();
    assert!(crept < 1.1e-5, "crept {crept} m in 1 s");
    assert!(crept > 1e-7, "the regularised law does not creep at all");
}

#[test]
fn left_and_right_share_the_weight_by_the_roll_balance() {
    // Standing across a side slope: lateral gravity acts at the centre of mass, whose height over the
    // ground is the radius less its distance below the axle.
    let vehicle = bare_vehicle();
    let p = vehicle.parameters().body;
    let slope_y = 0.1;
    let ground = ground(0.0, slope_y, 0.8, 0.25);
    let mut body = Body::new(&vehicle, &ground);
    body.set_chocked(true);
    for _ in 0..4000 {
        body.step(5e-4, &ground, &NO_TORQUE);
    }
    let [left, right] = *body.wheels();
    // Downhill is to the left (6.5): height of the centre of mass over the ground times the lateral pull.
    let height = p.wheel_radius_m - p.arm_mass_kg * p.arm_length_m / p.total_mass_kg;
    let g = model::vehicle::GRAVITY_M_S2;
    let expected = p.total_mass_kg * g * slope_y.sin() * height / p.half_track_m;
    let found = left.normal_n - right.normal_n;
    assert!((found / expected - 1.0).abs() < 1e-3, "{found} against {expected} N");
    // The contacts hold the vehicle uphill, to the right.
    let hold = left.lateral_n + right.lateral_n;
    assert!(
        (hold / (-p.total_mass_kg * g * slope_y.sin()) - 1.0).abs() < 1e-3,
        "{hold} N"
    );
}
