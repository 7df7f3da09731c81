//! A step of the speed under a law, on the sampled planar vehicle: for the vehicle of the file, and for vehicles that
//! differ from the file.

use model::vehicle::Vehicle;
use plant::noise::Noise;
use serde::{Deserialize, Serialize};

use super::sampled::{Factors, SampledDrive, SampledPlant, SampledRow, SampledSensing, WHIRL_RAD};

/// The result of a step of the speed: nondimensional numbers, shares of the step, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LawStep {
    /// Seed of the plant and its noise.
    pub seed: u64,
    /// Time until the speed stays within 2 % of the step; `None` if it does not within the drive.
    pub settling: Option<f64>,
    /// Largest overshoot beyond the step.
    pub overshoot: f64,
    /// Largest excursion to the other side of rest.
    pub undershoot: f64,
    /// Largest absolute arm angle.
    pub phi_max_deg: f64,
    /// Largest |F| / N.
    pub grip: f64,
    /// Largest distance from the target speed in the last tenth of the drive.
    pub ripple: f64,
    /// Whether the arm turned over.
    pub whirled: bool,
}

/// Share of the step within which the speed counts as settled.
const SETTLED_SHARE: f64 = 0.02;

/// Drives from 0 to `target`, which `drive` commands at the time `at`, with sensor noise from `seed`.
pub fn step(drive: &SampledDrive<'_>, seed: u64, at: f64, target: f64) -> LawStep {
    let mut noise = Noise::new(seed, 0);
    let mut rows: Vec<SampledRow> = Vec::new();
    drive.run(
        || noise.normal(),
        |row| {
            rows.push(*row);
            row.phi.abs() <= WHIRL_RAD
        },
    );
    let after: Vec<&SampledRow> = rows.iter().filter(|row| row.time >= at).collect();
    let error = |row: &SampledRow| (row.theta_rate - target) / target;
    let settling = match after.iter().rposition(|row| error(row).abs() > SETTLED_SHARE) {
        Some(last) => after.get(last + 1).map(|row| row.time - at),
        None => Some(0.0),
    };
    let late = drive.duration - 0.1 * (drive.duration - at);
    let most = |of: &dyn Fn(&SampledRow) -> f64| after.iter().map(|row| of(row)).fold(0.0, f64::max);
    LawStep {
        seed,
        settling,
        overshoot: most(&error),
        undershoot: most(&|row| -1.0 - error(row)),
        phi_max_deg: most(&|row| row.phi.abs().to_degrees()),
        grip: most(&|row| row.friction.abs() / row.normal.max(1e-3)),
        ripple: most(&|row| {
            if row.time > late {
                (row.theta_rate - target).abs()
            } else {
                0.0
            }
        }),
        whirled: rows.last().is_some_and(|row| row.phi.abs() > WHIRL_RAD),
    }
}

/// The noise of the reference vehicle's sensors.
const NOISY: SampledSensing = SampledSensing {
    delay: 1,
    noise: [2e-4, 5e-4, 2e-3],
};

/// Standing time before the step, in time units.
const STANDS: f64 = 40.0;

/// The step from 0 to 1 of a plant whose nine parameters are off by up to 20 %, on one of five slopes. Three vehicles
/// of five stand at the corners of that range.
pub fn perturbed_step(vehicle: &Vehicle<f64>, seed: u64) -> LawStep {
    let mut noise = Noise::new(seed, 1);
    let slopes = [-0.2, -0.0873, 0.0, 0.0873, 0.2];
    let beta = slopes[(noise.bits() % 5) as usize];
    let corner = noise.bits() % 5 < 3;
    let plant = SampledPlant::new(vehicle, &random_factors(&mut noise, corner), beta);
    let drive = SampledDrive {
        vehicle,
        plant,
        sensing: NOISY,
        targets: &[(0.0, 0.0), (STANDS, 1.0)],
        duration: 120.0,
    };
    step(&drive, seed, STANDS, 1.0)
}

/// Largest relative error of each parameter.
const SPREAD: f64 = 0.2;

/// Factors of the nine parameters, each within 20 %: at the ends of that range, or anywhere in it.
pub fn random_factors(noise: &mut Noise, corner: bool) -> Factors {
    Factors::from_array(std::array::from_fn(|_| {
        let x = if corner {
            if noise.bits() & 1 == 0 { -1.0 } else { 1.0 }
        } else {
            uniform(noise, -1.0, 1.0)
        };
        1.0 + SPREAD * x
    }))
}

/// A number between two bounds.
pub fn uniform(noise: &mut Noise, least: f64, most: f64) -> f64 {
    least + (most - least) * (noise.bits() >> 11) as f64 / (1_u64 << 53) as f64
}
