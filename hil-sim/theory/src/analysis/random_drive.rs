//! Random drives of the sampled planar vehicle, and the commands that swing its arm furthest.

use model::vehicle::{SpeedLawChoice, Vehicle, VehicleParameters};
use plant::noise::Noise;
use serde::{Deserialize, Serialize};

use super::cma_es::minimise;
use super::law_step::{random_factors, uniform};
use super::sampled::{Factors, SampledDrive, SampledPlant, SampledSensing, WHIRL_RAD};

/// A law under test in a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum SearchedLaw {
    /// The landing law.
    #[serde(rename = "landing")]
    Landing,
    /// Eq. 3.25 alone: without swing damping, integral and ramp.
    #[serde(rename = "eq-3.25")]
    Eq325,
}

/// Largest speed and acceleration that a vehicle file takes: no bound for a search.
const UNBOUNDED: f64 = 20.0;

impl SearchedLaw {
    /// The parameters of a vehicle with this law whose operator may command any speed.
    pub fn flown(self, parameters: &VehicleParameters<f64>) -> VehicleParameters<f64> {
        let mut flown = *parameters;
        flown.control.speed_max_m_s = UNBOUNDED;
        match self {
            Self::Landing => flown.control.law = f64::from(SpeedLawChoice::Landing as u8),
            Self::Eq325 => {
                flown.control.law = f64::from(SpeedLawChoice::SwingDamped as u8);
                flown.control.swing_gain = 0.0;
                flown.control.ki = 0.0;
                flown.control.acceleration_max_m_s2 = UNBOUNDED;
            }
        }
        flown
    }
}

/// A drive of random steps on a random slope with a random plant and supply.
#[derive(Debug, Clone, PartialEq)]
pub struct RandomDrive {
    seed: u64,
    plant: SampledPlant,
    /// Times and speeds, in order of time.
    commands: Vec<(f64, f64)>,
    /// Friction coefficient of the vehicle file.
    grip_mu: f64,
}

/// The result of a drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmSwing {
    /// Largest absolute arm angle, rad; the drive ends beyond [`WHIRL_RAD`].
    pub phi_max_rad: f64,
    /// Whether the arm swings beyond its standing angle on the slope, so that the commands matter.
    pub swings: bool,
    /// Share of the time in which |F| exceeds the file's `grip_mu` times N.
    pub sliding: f64,
}

/// Length of a random drive, in time units.
const DURATION: f64 = 36.0;
/// Largest commanded speed, in speed units.
const SPEED_MOST: f64 = 6.0;
/// Largest slope of a drive as a share of the steepest slope.
const RANDOM_SLOPE_SHARE: f64 = 0.9;
/// Largest sine of the standing angle of a plant: a steeper one cannot stand with a margin.
const STANDING_SIN: f64 = 0.9;
/// The range of the supply, nondimensional.
const VOLTAGE: (f64, f64) = (3.0, 12.0);
/// Torque of motors without a current limit, and the share of drives with such motors.
const TORQUE_FREE: f64 = 9.0;
const TORQUE_FREE_SHARE: f64 = 0.3;

impl RandomDrive {
    /// The drive of `seed` for the vehicle of a file: the plant's nine parameters are off by up to 20 %, the slope is up to 0.9
    /// of the steepest that the arm's weight and the grip hold, and 2 to 8 steps go to speeds within 6 units, in half of the
    /// drives to plus or minus 6.
    pub fn new(vehicle: &Vehicle<f64>, seed: u64) -> Self {
        let mut noise = Noise::new(seed, 2);
        let grip_mu = vehicle.parameters().control.grip_mu;
        let steepest = {
            let level = SampledPlant::new(vehicle, &Factors::NONE, 0.0);
            let carried = libm::asin((level.balance.alpha_l / level.balance.mass).min(1.0));
            RANDOM_SLOPE_SHARE * carried.min(libm::atan(grip_mu))
        };
        let beta = uniform(&mut noise, -steepest, steepest);
        let corner = noise.bits() & 1 == 0;
        let mut plant = SampledPlant::new(vehicle, &random_factors(&mut noise, corner), beta);
        if plant.standing_sin_phi().abs() > STANDING_SIN {
            plant = SampledPlant::new(vehicle, &Factors::NONE, beta);
        }
        plant.voltage_max = uniform(&mut noise, VOLTAGE.0, VOLTAGE.1);
        if uniform(&mut noise, 0.0, 1.0) > 1.0 - TORQUE_FREE_SHARE {
            plant.torque_max = TORQUE_FREE;
        }
        let steps = 2 + (noise.bits() % 7) as usize;
        let hard = noise.bits() & 1 == 0;
        let mut commands = vec![(0.0, 0.0); steps];
        for command in &mut commands {
            command.1 = if hard {
                if noise.bits() & 1 == 0 { -SPEED_MOST } else { SPEED_MOST }
            } else {
                uniform(&mut noise, -SPEED_MOST, SPEED_MOST)
            };
        }
        for command in commands.iter_mut().skip(1) {
            command.0 = uniform(&mut noise, 5.0, 30.0);
        }
        commands.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self {
            seed,
            plant,
            commands,
            grip_mu,
        }
    }

    /// Simulates the drive.
    pub fn drive(&self, vehicle: &Vehicle<f64>) -> ArmSwing {
        self.drive_through(vehicle, &self.commands)
    }

    /// Moves the times and speeds of the commands so that the arm swings furthest, with an
    /// optimiser that tries `generations` generations of some ten drives each, and simulates the
    /// result.
    pub fn climb(&self, vehicle: &Vehicle<f64>, generations: usize) -> ArmSwing {
        let with = |commands: &[f64]| {
            let clamp = |pair: &[f64]| (pair[0].clamp(0.0, DURATION), pair[1].clamp(-SPEED_MOST, SPEED_MOST));
            let mut moved: Vec<(f64, f64)> = commands.chunks_exact(2).map(clamp).collect();
            moved.sort_by(|a, b| a.0.total_cmp(&b.0));
            self.drive_through(vehicle, &moved)
        };
        let start: Vec<f64> = self.commands.iter().flat_map(|(time, speed)| [*time, *speed]).collect();
        let mut noise = Noise::new(self.seed, 3);
        let found = minimise(
            &start,
            2.0,
            generations,
            || noise.normal(),
            |commands| -with(commands).phi_max_rad,
        );
        with(&found.at)
    }

    fn drive_through(&self, vehicle: &Vehicle<f64>, commands: &[(f64, f64)]) -> ArmSwing {
        let drive = SampledDrive {
            vehicle,
            plant: self.plant,
            sensing: SampledSensing {
                delay: 1,
                noise: [0.0; 3],
            },
            targets: commands,
            duration: DURATION,
        };
        let (mut phi_max_rad, mut ticks, mut sliding) = (0.0_f64, 0_u32, 0_u32);
        drive.run(
            || 0.0,
            |row| {
                phi_max_rad = phi_max_rad.max(row.phi.abs());
                ticks += 1;
                sliding += u32::from(row.friction.abs() > self.grip_mu * row.normal);
                row.phi.abs() <= WHIRL_RAD
            },
        );
        let stands_rad = libm::asin(self.plant.standing_sin_phi().clamp(-1.0, 1.0)).abs();
        ArmSwing {
            phi_max_rad,
            swings: phi_max_rad > stands_rad + 0.02,
            sliding: f64::from(sliding) / f64::from(ticks.max(1)),
        }
    }
}
