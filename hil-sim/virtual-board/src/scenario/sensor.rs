//! The vehicle's sensors and their faults.

use model::sample::Motor;
use plant::Plant;
use plant::fault::SensorFault;
use serde::Deserialize;

/// Names of sensors in files of version 0.1, which are still read and no longer offered.
pub(super) const FORMER_NAMES: [&str; 2] = ["chassis-imu", "camera-encoder"];

/// A sensor that can fail.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sensor {
    /// IMU on the arm.
    #[serde(alias = "chassis-imu")]
    ArmImu,
    /// IMU on the spar.
    SparImu,
    /// Left wheel's encoder.
    LeftEncoder,
    /// Right wheel's encoder.
    RightEncoder,
    /// The ballast motor's encoder.
    #[serde(alias = "camera-encoder")]
    BallastEncoder,
}

impl Sensor {
    /// Whether the sensor is an IMU.
    pub(super) fn is_imu(self) -> bool {
        matches!(self, Self::ArmImu | Self::SparImu)
    }

    /// Makes the vehicle's sensor fail, or repairs it. A vehicle without a spar has no spar IMU.
    pub fn set_fault(self, plant: &mut Plant, fault: SensorFault) {
        match self {
            Self::ArmImu => plant.arm_imu().set_fault(fault),
            Self::SparImu => {
                if let Some(imu) = plant.spar_imu() {
                    imu.set_fault(fault);
                }
            }
            Self::LeftEncoder => plant.encoder_mut(Motor::Left).set_fault(fault),
            Self::RightEncoder => plant.encoder_mut(Motor::Right).set_fault(fault),
            Self::BallastEncoder => plant.encoder_mut(Motor::Ballast).set_fault(fault),
        }
    }
}
