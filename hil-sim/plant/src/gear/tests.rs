//! Compares gearboxes with closed forms: two masses on a spring, lost motion, energy.

use std::f64::consts::TAU;

use super::*;
use crate::body::{LEFT, PHI, RIGHT};
use crate::motor::BridgeState;
use crate::settings::PlantSettings;
use crate::terrain::Terrain;
use crate::tests::{SCALES, bare_vehicle};
use crate::{Motor, Plant, Truth};

const H: f64 = 5e-4;
/// Rotor and load, in kg m^2.
const ROTOR: f64 = 0.0248;
const LOAD: f64 = 0.06;

/// A rotor behind a gearbox on a free load: gearbox, and angle and rate of the load.
struct TwoMasses {
    gear: Gear,
    load: (f64, f64),
}

impl TwoMasses {
    fn new(backlash_rad: f64, stiffness: f64, damping: f64) -> Self {
        Self {
            gear: Gear::new(backlash_rad, stiffness, damping, (ROTOR, LOAD), 0.0),
            load: (0.0, 0.0),
        }
    }

    fn step(&mut self, h: f64, motor: &JointTorque) {
        for repetition in 0..REPETITIONS_MAX {
            let e = self.gear.eliminate(h, motor, self.load);
            let y = h * e.torque / (LOAD + h * e.slope);
            let mut next = self.gear;
            if next.agrees(h, motor, self.load, y) || repetition + 1 == REPETITIONS_MAX {
                self.gear.finish(h, motor, self.load, y);
                (self.gear.flank, self.gear.held) = (next.flank, next.held);
                self.load = (self.load.0 + h * (self.load.1 + 0.5 * y), self.load.1 + y);
                return;
            }
            self.gear = next;
        }
    }

    fn energy(&self) -> f64 {
        let twist = (self.gear.angle - self.load.0).abs() - self.gear.half_backlash;
        0.5 * (ROTOR * self.gear.rate * self.gear.rate
            + LOAD * self.load.1 * self.load.1
            + self.gear.stiffness * twist.max(0.0) * twist.max(0.0))
    }
}

#[test]
fn two_masses_on_the_teeth_swing_at_their_frequency_and_keep_their_energy() {
    for stiffness in [300.0, 3000.0, 8000.0] {
        let mut masses = TwoMasses::new(0.0, stiffness, 0.0);
        masses.gear.rate = 1.0;
        let start = masses.energy();
        let (mut crossings, mut last, mut first_s, mut last_s) = (0, 1.0, 0.0, 0.0);
        for k in 0..20_000 {
            masses.step(H, &JointTorque::NONE);
            let slip = masses.gear.rate - masses.load.1;
            if last < 0.0 && slip >= 0.0 {
                // Linear interpolation between the two samples.
                last_s = H * (f64::from(k) + last / (last - slip));
                if crossings == 0 {
                    first_s = last_s;
                }
                crossings += 1;
            }
            last = slip;
        }
        let found = f64::from(crossings - 1) / (last_s - first_s);
        let omega = (stiffness * (1.0 / ROTOR + 1.0 / LOAD)).sqrt();
        // The midpoint rule turns by 2 atan(w h / 2) per step.
        let expected = (0.5 * omega * H).atan() * 2.0 / (TAU * H);
        assert!(
            (found / expected - 1.0).abs() < 2e-3,
            "{stiffness}: {found} against {expected} Hz"
        );
        assert!((expected / (omega / TAU) - 1.0).abs() < 0.02, "the substep resolves it");
        let drift = masses.energy() / start - 1.0;
        assert!(drift.abs() < 0.02, "{stiffness}: {drift}");
    }
}

#[test]
fn between_the_flanks_the_rotor_flies_and_no_bounce_gains_energy() {
    for backlash_deg in [0.2_f64, 1.0, 5.0] {
        let mut masses = TwoMasses::new(backlash_deg.to_radians(), 3000.0, 0.0);
        masses.gear.rate = 0.5;
        let start = masses.energy();
        let momentum = ROTOR * 0.5;
        let (mut most, mut flew) = (start, 0);
        for _ in 0..40_000 {
            masses.step(H, &JointTorque::NONE);
            most = most.max(masses.energy());
            flew += i32::from(masses.gear.flank == Flank::Free);
            let now = ROTOR * masses.gear.rate + LOAD * masses.load.1;
            assert!(
                (now / momentum - 1.0).abs() < 1e-9,
                "the teeth's torques on the two masses differ"
            );
        }
        assert!(flew > 4000, "{flew}");
        // If a flank is met within a substep, up to a hundredth of the energy is gained or lost,
        // depending on the instant.
        assert!(most < 1.15 * start, "{backlash_deg} deg: {most} of {start} J");
    }
}

#[test]
fn damped_teeth_bring_both_to_one_rate_and_any_stiffness_is_stable() {
    for (stiffness, damping) in [(3000.0, 2.0), (1e6, 1000.0), (1e6, 0.1), (100.0, 0.5), (0.001, 1000.0)] {
        let mut masses = TwoMasses::new(0.0175, stiffness, damping);
        masses.gear.rate = 3.0;
        let start = masses.energy();
        for _ in 0..20_000 {
            masses.step(H, &JointTorque::NONE);
            assert!(masses.energy() < 1.05 * start, "{stiffness} {damping}");
        }
        let common = ROTOR * 3.0 / (ROTOR + LOAD);
        let momentum = ROTOR * masses.gear.rate + LOAD * masses.load.1;
        assert!((momentum / (ROTOR * 3.0) - 1.0).abs() < 1e-9);
        if stiffness >= 100.0 {
            assert!(
                (masses.load.1 / common - 1.0).abs() < 0.1,
                "{stiffness}: {}",
                masses.load.1
            );
        }
    }
}

#[test]
fn a_limited_motor_turns_the_rotor_with_its_limit_and_no_more() {
    let mut masses = TwoMasses::new(0.1, 3000.0, 1.0);
    let motor = JointTorque {
        constant_n_m: 1e4,
        damping_n_m_s: 1e5,
        limit_n_m: 0.5,
        coulomb_n_m: 0.0,
    };
    // To the law's rest of 0.1 rad/s at 0.5 N m: 5 ms, still within the play.
    for _ in 0..8 {
        masses.step(H, &motor);
    }
    assert!((masses.gear.rate - 8.0 * H * 0.5 / ROTOR).abs() < 1e-12);
    for _ in 0..8 {
        masses.step(H, &motor);
    }
    assert!((masses.gear.rate - 0.1).abs() < 1e-4, "{}", masses.gear.rate);
}

fn settings(backlash_deg: f64, stiffness: f64) -> PlantSettings {
    let mut settings = PlantSettings::default();
    for side in [&mut settings.left, &mut settings.right] {
        side.backlash_deg = backlash_deg;
        side.gear_stiffness_n_m_per_rad = stiffness;
        side.gear_damping_n_m_s_per_rad = 5.0;
    }
    settings
}

#[test]
fn stiff_teeth_without_play_are_the_rigid_gearbox() {
    let run = |settings: &PlantSettings| -> Vec<Truth> {
        let terrain = Terrain::slope(0.03, 0.8).expect("a slope");
        let mut plant = Plant::with_settings(&bare_vehicle(), &SCALES, terrain, 1, settings).expect("a plant");
        (0..3000)
            .map(|k| {
                let duty = if k % 1000 < 500 { 0.22 } else { 0.14 };
                plant.advance(1e-3, &[duty, 0.95 * duty, 0.0].map(BridgeState::Duty));
                plant.truth()
            })
            .collect()
    };
    let rigid = run(&PlantSettings::default());
    let stiff = run(&settings(0.0, 100_000.0));
    let worst = |of: fn(&Truth) -> f64| {
        let pairs = rigid.iter().zip(&stiff);
        pairs.map(|(a, b)| (of(a) - of(b)).abs()).fold(0.0, f64::max)
    };
    let (place, phi, heading) = (worst(|t| t.x_m), worst(|t| t.phi_rad), worst(|t| t.heading_rad));
    // 20 N m over 1e5 N m/rad give 0.2 mrad of twist.
    assert!(place < 2e-3 && phi < 3e-3 && heading < 3e-3, "{place} {phi} {heading}");
    assert!(place > 1e-9 && rigid.last().expect("rows").x_m > 1.0);
}

#[test]
fn the_encoder_shows_the_lost_motion_and_the_wheel_does_not_move() {
    let backlash_deg = 1.0;
    let stiffness = 3000.0;
    let terrain = Terrain::slope(0.0, 0.8).expect("level");
    let mut plant = Plant::with_settings(&bare_vehicle(), &SCALES, terrain, 1, &settings(backlash_deg, stiffness))
        .expect("a plant");
    plant.set_jammed(0, true);
    plant.set_jammed(1, true);
    let mut settle = |duty: f64| {
        for _ in 0..1500 {
            plant.advance(1e-3, &[duty, duty, 0.0].map(BridgeState::Duty));
        }
        let torque = plant.truth().torque_n_m[0];
        let joint = plant.body().joint_angle(0);
        assert!(joint.abs() < 1e-6, "the wheel is seized: {joint}");
        (plant.encoder(Motor::Left).counted() as f64, torque)
    };
    let (forward, pull) = settle(0.04);
    let (backward, push) = settle(-0.04);
    assert!(pull > 2.0 && (pull + push).abs() < 0.1, "{pull} {push} N m");
    let counts_per_rad = 1024.0 * 43.0 / TAU;
    let expected = (backlash_deg.to_radians() + (pull - push) / stiffness) * counts_per_rad;
    let found = forward - backward;
    assert!((found - expected).abs() < 2.0, "{found} against {expected} counts");
}

#[test]
fn with_play_the_vehicle_keeps_its_energy_but_for_what_friction_takes() {
    // With open bridges and without friction, the teeth must not drive a swinging arm.
    let mut parameters = *bare_vehicle().parameters();
    parameters.body.bearing_damping_n_m_s = 0.0;
    parameters.drive_motor.coulomb_friction_n_m = 0.0;
    let vehicle = model::vehicle::Vehicle::new(parameters).expect("a vehicle");
    let terrain = Terrain::slope(0.0, 0.8).expect("level");
    let mut plant = Plant::with_settings(&vehicle, &SCALES, terrain, 1, &settings(1.0, 3000.0)).expect("a plant");
    // The wheels are turned back by the same angle, so joints and teeth keep their positions.
    let (q, _) = plant.body_mut().state_mut();
    (q[PHI], q[LEFT], q[RIGHT]) = (0.4, -0.4, -0.4);
    let start = plant.body().energy(plant.ground());
    let mut most = start;
    for _ in 0..5000 {
        plant.advance(1e-3, &[BridgeState::Open; MOTORS]);
        most = most.max(plant.body().energy(plant.ground()));
    }
    let end = plant.body().energy(plant.ground());
    let scale = 12.24 * 9.81 * 0.2 * (1.0 - 0.4_f64.cos());
    assert!(most - start < 0.01 * scale, "{most} from {start} J");
    assert!(end > start - scale && plant.body().speed()[LEFT].abs() < 10.0);
}
