//! Assembles a plant from a vehicle and from the settings in which the simulated vehicle differs.

use model::board::BoardScales;
use model::sample::Motor;
use model::vehicle::{MotorParameters, Vehicle};

use crate::analog::AnalogConverter;
use crate::battery::Battery;
use crate::body::Body;
use crate::bridge_heat::BridgeHeat;
use crate::encoder::Encoder;
use crate::gear::{GEARS, Gear};
use crate::icm42688p::Icm42688pModel;
use crate::imu::ImuErrors;
use crate::motor::DcMotor;
use crate::noise::Noise;
use crate::settings::{DriveSettings, PlantSettings};
use crate::supply::Supply;
use crate::terrain::{Ground, Terrain, TerrainError};
use crate::wiring::Wiring;
use crate::{IDLE_A, Plant, SUBSTEP_S};

/// A bridge's own hardware chops at this multiple of the current at which the vehicle reports a fault ...
const CHOP_FACTOR: f64 = 1.5;
/// ... but not beyond the current sensor's range.
const CHOP_MAX_A: f64 = 60.0;
/// Default stiffness of a gearbox with play, in N m/rad at its output.
const GEAR_STIFFNESS_N_M_PER_RAD: f64 = 3000.0;

/// Streams of the scenario's seed.
mod stream {
    pub const ARM_IMU: u64 = 0;
    pub const SPAR_IMU: u64 = 1;
    pub const ANALOG: u64 = 2;
    /// Three streams, one per motor.
    pub const ENCODERS: u64 = 3;
}

/// The drive motor of one side.
fn of_side(p: &MotorParameters<f64>, side: &DriveSettings) -> MotorParameters<f64> {
    let mut p = *p;
    p.torque_constant_n_m_per_a *= side.torque_constant_factor;
    p.back_emf_constant_v_s_per_rad *= side.back_emf_factor;
    p.resistance_ohm *= side.resistance_factor;
    p.coulomb_friction_n_m *= side.friction_factor;
    p
}

impl Plant {
    /// The vehicle at rest at the terrain's origin, heading along x, with arm, spar and ballast hanging
    /// vertically, open bridges and a full battery. The sensor errors are those of the data sheets.
    /// `scales` are those of the board that reads the analogue signals.
    ///
    /// # Errors
    /// A terrain that this vehicle's wheels cannot follow.
    pub fn new(
        vehicle: &Vehicle<f64>,
        scales: &BoardScales,
        terrain: Terrain,
        seed: u64,
    ) -> Result<Self, TerrainError> {
        Self::with_imu_errors(vehicle, scales, terrain, seed, ImuErrors::default())
    }

    /// As [`Plant::new`], with the given IMU errors.
    ///
    /// # Errors
    /// A terrain that this vehicle's wheels cannot follow.
    pub fn with_imu_errors(
        vehicle: &Vehicle<f64>,
        scales: &BoardScales,
        terrain: Terrain,
        seed: u64,
        errors: ImuErrors,
    ) -> Result<Self, TerrainError> {
        Self::assembled(vehicle, scales, terrain, seed, errors, &PlantSettings::default())
    }

    /// As [`Plant::new`], with the differences from the vehicle file in `settings`. `vehicle` is the
    /// simulated one ([`PlantSettings::vehicle_from`]).
    ///
    /// # Errors
    /// A terrain that this vehicle's wheels cannot follow.
    pub fn with_settings(
        vehicle: &Vehicle<f64>,
        scales: &BoardScales,
        terrain: Terrain,
        seed: u64,
        settings: &PlantSettings,
    ) -> Result<Self, TerrainError> {
        Self::assembled(vehicle, scales, terrain, seed, ImuErrors::default(), settings)
    }

    fn assembled(
        vehicle: &Vehicle<f64>,
        scales: &BoardScales,
        terrain: Terrain,
        seed: u64,
        errors: ImuErrors,
        settings: &PlantSettings,
    ) -> Result<Self, TerrainError> {
        let p = vehicle.parameters();
        let ground = Ground::new(terrain, p.body.wheel_radius_m)?;
        let chop = (CHOP_FACTOR * p.safety.overcurrent_a).min(CHOP_MAX_A);
        let drives = [&settings.left, &settings.right];
        let [left, right] = drives.map(|settings| DcMotor::new(&of_side(&p.drive_motor, settings), chop));
        // Without a spar the third bridge has no motor. The plant simulates a motor that never draws a
        // current.
        let ballast = p
            .spar
            .as_ref()
            .map_or_else(|| left.clone(), |(_, m)| DcMotor::new(m, chop));
        let (ballast_counts, ballast_ratio) = p
            .spar
            .as_ref()
            .map_or((4.0, 1.0), |(_, m)| (m.encoder_counts_per_rev, m.gear_ratio));
        let drive_encoder = |motor: Motor| {
            let noise = Noise::new(seed, stream::ENCODERS + motor as u64);
            Encoder::new(p.drive_motor.encoder_counts_per_rev, p.drive_motor.gear_ratio, noise)
        };
        let ballast_noise = Noise::new(seed, stream::ENCODERS + Motor::Ballast as u64);
        let battery = Battery {
            open_circuit_v: p.battery.nominal_v,
            resistance_ohm: p.battery.resistance_ohm,
            idle_a: IDLE_A,
        };
        let mut plant = Self {
            body: Body::new(vehicle, &ground),
            ground,
            motors: [left, right, ballast],
            battery,
            encoders: [
                drive_encoder(Motor::Left),
                drive_encoder(Motor::Right),
                Encoder::new(ballast_counts, ballast_ratio, ballast_noise),
            ],
            arm_imu: Icm42688pModel::new(errors, Noise::new(seed, stream::ARM_IMU)),
            spar_imu: Icm42688pModel::new(errors, Noise::new(seed, stream::SPAR_IMU)),
            arm_radius_m: p.imu.arm_radius_m,
            spar_radius_m: p.imu.spar_radius_m,
            has_spar: p.spar.is_some(),
            analog: AnalogConverter::new(scales, Noise::new(seed, stream::ANALOG)),
            gears: None,
            wiring: Wiring::default(),
            wiring_is_faulty: false,
            bridge_heat: BridgeHeat::new(p.motors()),
            supply: Supply::new(settings.battery.as_ref(), settings.board.brown_out_v),
            push_until_s: f64::INFINITY,
            time_s: 0.0,
            battery_v: battery.open_circuit_v - battery.resistance_ohm * IDLE_A,
            battery_a: IDLE_A,
            substep_s: SUBSTEP_S,
            invalid: None,
        };
        plant.arm_imu.mount(&settings.arm_imu);
        plant.spar_imu.mount(&settings.spar_imu);
        let radii = drives.map(|side| p.body.wheel_radius_m * side.wheel_radius_factor);
        let inertia = plant.body.inertia_mut();
        inertia.radius = 0.5 * (radii[0] + radii[1]);
        inertia.radius_difference = radii[0] - radii[1];
        plant.supply.follow(0.0, 0.0, &mut plant.battery);
        plant.battery_v = plant.battery.open_circuit_v - plant.battery.resistance_ohm * IDLE_A;
        plant.rest_encoders();
        plant.fit_gears(drives);
        Ok(plant)
    }

    /// Gives each drive whose gearbox has play a separate rotor.
    fn fit_gears(&mut self, drives: [&DriveSettings; GEARS]) {
        let mut gears = [None; GEARS];
        for (i, (gear, settings)) in gears.iter_mut().zip(drives).enumerate() {
            let (backlash_deg, stiffness) = (settings.backlash_deg, settings.gear_stiffness_n_m_per_rad);
            if backlash_deg == 0.0 && stiffness == 0.0 {
                continue;
            }
            let angle = self.body.joint_angle(i);
            let inertia = self.body.inertia_mut();
            let rotor = std::mem::take(&mut inertia.rotor[i]);
            let stiffness = if stiffness == 0.0 {
                GEAR_STIFFNESS_N_M_PER_RAD
            } else {
                stiffness
            };
            *gear = Some(Gear::new(
                backlash_deg.to_radians(),
                stiffness,
                settings.gear_damping_n_m_s_per_rad,
                (rotor, inertia.wheel),
                angle,
            ));
        }
        self.gears = gears.iter().any(Option::is_some).then(|| Box::new(gears));
    }
}
