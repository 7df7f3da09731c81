//! The simulated vehicle around the emulated board: hil-sim's plant at the board's pins.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use firmware::{built_in, imu};
use model::sample::Motor;
use plant::icm42688p::{Icm42688pModel, registers as register};
use plant::{self, Plant};

use super::closed_plant::{ClosedPlant, millivolts, slopes_uv_per_us};
use crate::board::{BridgeOutput, ImuSensed, MOTORS, SensedAtPins};

/// Register values that turn both sensors on, with the firmware's ranges, rates and filters.
const SETTINGS: [(u8, u8); 4] = [
    (register::GYRO_ACCEL_CONFIG0, 0x33),
    (register::GYRO_CONFIG0, 0x25),
    (register::ACCEL_CONFIG0, 0x25),
    (register::PWR_MGMT0, 0x0F),
];

/// Inductances of the built-in vehicle's armatures, in H.
fn inductances_h() -> [f64; MOTORS] {
    let vehicle = &built_in::PARAMETERS;
    let drive = f64::from(vehicle.drive_motor.inductance_h);
    let ballast = vehicle
        .ballast_motor()
        .map_or(0.0, |motor| f64::from(motor.inductance_h));
    [drive, drive, ballast]
}

/// The plant at the board's pins. Clones share the plant.
///
/// The plant's IMUs have their own register model, which the virtual board's driver uses. On the emulated board
/// the firmware uses the emulator's independent model of the IMU. There the plant's model is the sensor behind
/// that model and contributes noise and faults.
#[derive(Debug, Clone)]
pub struct VehicleAtPins(Arc<Mutex<Plant>>);

impl VehicleAtPins {
    /// Switches the plant's IMUs on.
    pub fn new(mut plant: Plant) -> Self {
        for (register, value) in SETTINGS {
            plant.arm_imu().transfer(&mut [register, value]);
            if let Some(imu) = plant.spar_imu() {
                imu.transfer(&mut [register, value]);
            }
        }
        Self(Arc::new(Mutex::new(plant)))
    }

    /// The plant as its last step left it.
    pub fn plant(&self) -> MutexGuard<'_, Plant> {
        // A panic while another thread held the lock leaves the plant as consistent as any step does.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ClosedPlant for VehicleAtPins {
    fn step(&mut self, seconds: f64, bridges: &[BridgeOutput; MOTORS]) -> SensedAtPins {
        let mut plant = self.plant();
        let bridges = bridges.map(|bridge| match bridge {
            // A bridge that conducts without switching connects its motor to one of the supply's poles. The plant
            // does not know which pole and assumes the full duty.
            BridgeOutput::Held => plant::BridgeState::Duty(1.0),
            _ => bridge.duty().map_or(plant::BridgeState::Open, plant::BridgeState::Duty),
        });
        plant.advance(seconds, &bridges);
        let analog_mv = plant.analog().map(|count| millivolts(f64::from(count)));
        let counted = |motor| plant.encoder(motor).counted();
        let encoder_counts = [counted(Motor::Left), counted(Motor::Right), counted(Motor::Ballast)];
        let arm = sensed(plant.arm_imu());
        let spar = plant.spar_imu().map_or(ImuSensed::SILENT, |imu| sensed(imu));
        SensedAtPins {
            encoder_counts,
            imus: [arm, spar],
            analog_mv,
            current_slope_uv_per_us: slopes_uv_per_us(plant.truth().battery_v, inductances_h()),
            unpowered: !plant.powers_board(),
            bridge_shut_down: plant.bridge_shut_down(),
        }
    }

    fn configure_imus(&mut self, intf_config1: [u8; 2]) {
        let mut plant = self.plant();
        let [arm, spar] = intf_config1;
        plant.arm_imu().transfer(&mut [register::INTF_CONFIG1, arm]);
        if let Some(imu) = plant.spar_imu() {
            imu.transfer(&mut [register::INTF_CONFIG1, spar]);
        }
    }

    fn fork(&self) -> Box<dyn ClosedPlant> {
        Box::new(Self(Arc::new(Mutex::new(self.plant().clone()))))
    }
}

/// Reads the plant's IMU, in the units of the emulator's IMU.
fn sensed(imu: &Icm42688pModel) -> ImuSensed {
    let Some([_, accel @ .., gx, gy, gz]) = imu.data() else {
        return ImuSensed::SILENT;
    };
    let scaled = |words: [i16; 3], unit: f64| words.map(|word| (f64::from(word) * unit).round() as i32);
    let g = 1e6 / f64::from(imu::driver::IMU_SCALES.accel_lsb_per_g);
    let rate = 1e3 / f64::from(imu::driver::IMU_SCALES.gyro_lsb_per_deg_s);
    ImuSensed {
        silent: false,
        specific_force_ug: scaled(accel, g),
        rate_mdeg_s: scaled([gx, gy, gz], rate),
    }
}
