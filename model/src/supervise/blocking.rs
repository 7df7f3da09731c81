//! Maps faults to blockers. The blockers are grouped by the part that a person has to check.

use super::codes::{Blocker, BlockerSet, Fault, FaultSet};

/// Faults of the arm IMU's readings, and of the wheel encoders' readings.
pub(super) const ARM_IMU_FAULTS: FaultSet = FaultSet::EMPTY
    .with(Fault::ImuStale)
    .with(Fault::ImuImplausible)
    .with(Fault::NotFinite);
pub(super) const ENCODER_FAULTS: FaultSet = FaultSet::EMPTY
    .with(Fault::EncoderStale)
    .with(Fault::EncoderImplausible);
/// Faults of the analogue readings, and of the battery's voltage.
const ANALOG_FAULTS: FaultSet = FaultSet::EMPTY.with(Fault::AnalogStale).with(Fault::Overcurrent);
const BATTERY_FAULTS: FaultSet = FaultSet::EMPTY.with(Fault::BatteryLow).with(Fault::BatteryHigh);
/// Faults of the drive motors' heat.
const HEAT_FAULTS: FaultSet = FaultSet::EMPTY.with(Fault::DriveMotorHot).with(Fault::DriveBridgeHot);

/// The blockers that follow from these faults.
#[cold]
pub(super) fn blockers_of(faults: FaultSet) -> BlockerSet {
    let mut blockers = BlockerSet::EMPTY;
    blockers.insert_if(Blocker::EmergencyStop, faults.contains(Fault::EmergencyStop));
    blockers.insert_if(Blocker::BridgeBreak, faults.contains(Fault::BridgeBreak));
    blockers.insert_if(Blocker::Imu, faults.has_any(ARM_IMU_FAULTS));
    blockers.insert_if(Blocker::Encoder, faults.has_any(ENCODER_FAULTS));
    blockers.insert_if(Blocker::Analog, faults.has_any(ANALOG_FAULTS));
    blockers.insert_if(Blocker::Battery, faults.has_any(BATTERY_FAULTS));
    blockers.insert_if(Blocker::NoCommand, faults.contains(Fault::CommandTimeout));
    blockers.insert_if(Blocker::StopContacts, faults.contains(Fault::StopContacts));
    blockers.insert_if(Blocker::MotorHot, faults.has_any(HEAT_FAULTS));
    blockers
}
