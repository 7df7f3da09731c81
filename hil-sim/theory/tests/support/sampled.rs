//! What the tests and searches of the speed laws on the sampled planar vehicle share.
#![allow(dead_code)] // Each uses its part.

use model::vehicle::{GRAVITY_M_S2, Vehicle, VehicleParameters};
use plant::noise::Noise;
use theory::analysis::cma_es::minimise;
use theory::analysis::sampled::{Factors, SampledDrive, SampledPlant, SampledRow, SampledSensing};

/// The reference vehicle, changed.
pub fn vehicle(change: impl FnOnce(&mut VehicleParameters<f64>)) -> Vehicle<f64> {
    let mut parameters = *vehicle_file::reference().expect("the reference vehicle").parameters();
    change(&mut parameters);
    Vehicle::new(parameters).expect("a vehicle")
}

/// The reference vehicle under Eq. 3.25 alone, for speeds without bound.
pub fn eq_3_25_vehicle() -> Vehicle<f64> {
    vehicle(|p| {
        p.control.speed_max_m_s = 20.0;
        p.control.law = 0.0;
        p.control.swing_gain = 0.0;
        p.control.ki = 0.0;
        p.control.acceleration_max_m_s2 = 20.0;
    })
}

/// The vehicle of the thesis, (3.26): no spar, no rotors, no smoothing, 0.42 g.
pub fn thesis_vehicle() -> Vehicle<f64> {
    vehicle(|p| {
        p.spar = None;
        p.drive_motor.rotor_inertia_kg_m2 = 0.0;
        p.drive_motor.current_limit_a = 90.0;
        p.safety.overcurrent_a = 100.0;
        p.control.acceleration_max_m_s2 = 0.42 * GRAVITY_M_S2;
        p.control.comfort_s = 0.0;
        p.control.speed_max_m_s = 20.0;
    })
}

/// What a step of the speed shows.
#[derive(Debug, Clone, Copy, Default)]
pub struct Step {
    /// Time until the speed stays within 2 % of the step; infinite if it does not.
    pub settling: f64,
    pub overshoot: f64,
    pub undershoot: f64,
    pub phi_max_deg: f64,
    /// Largest |F| / N.
    pub grip: f64,
    /// Largest speed less the target in the last tenth of the drive.
    pub ripple: f64,
    pub whirled: bool,
}

/// Measures a drive from 0 to `target` at the time `at`.
pub fn step(drive: &SampledDrive<'_>, seed: u64, at: f64, target: f64) -> Step {
    let mut noise = Noise::new(seed, 0);
    let mut rows: Vec<SampledRow> = Vec::new();
    drive.run(
        || noise.normal(),
        |row| {
            rows.push(*row);
            row.phi.abs() < 3.2
        },
    );
    let mut out = Step::default();
    let after: Vec<&SampledRow> = rows.iter().filter(|row| row.time >= at).collect();
    let error = |row: &SampledRow| (row.theta_rate - target) / target;
    out.settling = match after.iter().rposition(|row| error(row).abs() > 0.02) {
        Some(last) => after.get(last + 1).map_or(f64::INFINITY, |row| row.time - at),
        None => 0.0,
    };
    let late = drive.duration - 0.1 * (drive.duration - at);
    for row in &after {
        out.overshoot = out.overshoot.max(error(row));
        out.undershoot = out.undershoot.max(-1.0 - error(row));
        out.phi_max_deg = out.phi_max_deg.max(row.phi.abs().to_degrees());
        out.grip = out.grip.max(row.friction.abs() / row.normal.max(1e-3));
        if row.time > late {
            out.ripple = out.ripple.max((row.theta_rate - target).abs());
        }
    }
    out.whirled = rows.last().is_some_and(|row| row.phi.abs() > 3.1);
    out
}

/// Factors of the nine parameters within `spread`: corners, or anywhere.
pub fn factors(noise: &mut Noise, spread: f64, corner: bool) -> Factors {
    Factors::from_array(std::array::from_fn(|_| {
        let x = if corner {
            if noise.bits() & 1 == 0 { -1.0 } else { 1.0 }
        } else {
            uniform(noise, -1.0, 1.0)
        };
        1.0 + spread * x
    }))
}

/// A number between two bounds.
pub fn uniform(noise: &mut Noise, least: f64, most: f64) -> f64 {
    least + (most - least) * (noise.bits() >> 11) as f64 / (1_u64 << 53) as f64
}

/// The noise of the reference vehicle's sensors.
pub const NOISY: SampledSensing = SampledSensing {
    delay: 1,
    noise: [2e-4, 5e-4, 2e-3],
};

/// One of the plants of the +-20 % test: the vehicle stands on a slope for 40 time units, then steps to 1.
pub fn perturbed_step(vehicle: &Vehicle<f64>, seed: u64) -> Step {
    let mut noise = Noise::new(seed, 1);
    let slopes = [-0.2, -0.0873, 0.0, 0.0873, 0.2];
    let beta = slopes[(noise.bits() % 5) as usize];
    let corner = noise.bits() % 5 < 3;
    let plant = SampledPlant::new(vehicle, &factors(&mut noise, 0.2, corner), beta);
    let drive = SampledDrive {
        vehicle,
        plant,
        sensing: NOISY,
        targets: &[(0.0, 0.0), (40.0, 1.0)],
        duration: 120.0,
    };
    step(&drive, seed, 40.0, 1.0)
}

/// What a random drive shows.
#[derive(Debug, Clone, Copy, Default)]
pub struct Wild {
    pub phi_max: f64,
    /// The arm swings beyond the angle at which it stands on the slope: the commands matter.
    pub swings: bool,
    /// Share of the time in which |F| exceeds 0.6 N.
    pub slipping: f64,
}

/// Length of a random drive, in time units.
const WILD_DURATION: f64 = 36.0;

/// A drive of random steps on a random slope with a random plant and supply.
pub fn wild_drive(vehicle: &Vehicle<f64>, seed: u64) -> Wild {
    let (plant, targets) = wild_start(vehicle, seed);
    wild(vehicle, plant, &targets)
}

/// The plant and the commands of a random drive.
fn wild_start(vehicle: &Vehicle<f64>, seed: u64) -> (SampledPlant, Vec<(f64, f64)>) {
    let mut noise = Noise::new(seed, 2);
    let steepest = {
        let level = SampledPlant::new(vehicle, &Factors::NONE, 0.0);
        let carried = (level.balance.alpha_l / level.balance.mass).asin();
        0.9 * carried.min(0.6_f64.atan())
    };
    let beta = uniform(&mut noise, -steepest, steepest);
    let corner = noise.bits() & 1 == 0;
    let mut plant = SampledPlant::new(vehicle, &factors(&mut noise, 0.2, corner), beta);
    if plant.standing_sin_phi().abs() > 0.9 {
        // This plant cannot stand here with a margin.
        plant = SampledPlant::new(vehicle, &Factors::NONE, beta);
    }
    plant.voltage_max = uniform(&mut noise, 3.0, 12.0);
    if uniform(&mut noise, 0.0, 1.0) > 0.7 {
        plant.torque_max = 9.0;
    }
    let steps = 2 + (noise.bits() % 7) as usize;
    let hard = noise.bits() & 1 == 0;
    let mut targets = vec![(0.0, 0.0); steps];
    for target in &mut targets {
        target.1 = if hard {
            if noise.bits() & 1 == 0 { -6.0 } else { 6.0 }
        } else {
            uniform(&mut noise, -6.0, 6.0)
        };
    }
    for target in targets.iter_mut().skip(1) {
        target.0 = uniform(&mut noise, 5.0, 30.0);
    }
    targets.sort_by(|a, b| a.0.total_cmp(&b.0));
    (plant, targets)
}

/// The random drive of `seed`, whose commands a search moves, times and speeds, to where the arm swings furthest.
pub fn worst_commands(vehicle: &Vehicle<f64>, seed: u64, generations: usize) -> Wild {
    let (plant, targets) = wild_start(vehicle, seed);
    let with = |commands: &[f64]| {
        let clamp = |pair: &[f64]| (pair[0].clamp(0.0, WILD_DURATION), pair[1].clamp(-6.0, 6.0));
        let mut moved: Vec<(f64, f64)> = commands.chunks_exact(2).map(clamp).collect();
        moved.sort_by(|a, b| a.0.total_cmp(&b.0));
        wild(vehicle, plant, &moved)
    };
    let commands: Vec<f64> = targets.iter().flat_map(|(time, speed)| [*time, *speed]).collect();
    let mut noise = Noise::new(seed, 3);
    let found = minimise(
        &commands,
        2.0,
        generations,
        || noise.normal(),
        |commands| -with(commands).phi_max,
    );
    with(&found.at)
}

/// A drive through `targets`.
fn wild(vehicle: &Vehicle<f64>, plant: SampledPlant, targets: &[(f64, f64)]) -> Wild {
    let drive = SampledDrive {
        vehicle,
        plant,
        sensing: SampledSensing {
            delay: 1,
            noise: [0.0; 3],
        },
        targets,
        duration: WILD_DURATION,
    };
    let (mut out, mut ticks, mut slipping) = (Wild::default(), 0_u32, 0_u32);
    drive.run(
        || 0.0,
        |row| {
            out.phi_max = out.phi_max.max(row.phi.abs());
            ticks += 1;
            slipping += u32::from(row.friction.abs() > 0.6 * row.normal);
            row.phi.abs() < 3.2
        },
    );
    out.swings = out.phi_max > plant.standing_sin_phi().clamp(-1.0, 1.0).asin().abs() + 0.02;
    out.slipping = f64::from(slipping) / f64::from(ticks.max(1));
    out
}
