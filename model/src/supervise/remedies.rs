//! What an operator does about each fault and each blocker.

use super::codes::{Blocker, Fault};

impl Fault {
    /// What to do before the fault is cleared.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::EmergencyStop => "Find out why somebody pressed it, then release it.",
            Self::BridgeBreak => "Look for an overcurrent or a fault of a bridge, and for an open stop contact.",
            Self::ImuStale => "Check the arm IMU's supply and its SPI cable.",
            Self::ImuImplausible => "Check the arm IMU's mounting and its cable; the log tells when the fault began.",
            Self::EncoderStale => "Check the encoders' supply.",
            Self::EncoderImplausible => "Check the encoder's cable, its direction, and that its disc sits tight.",
            Self::Overcurrent => "Check the motor and its leads for a short, and free a blocked wheel.",
            Self::BatteryLow => "Charge or change the battery; check its contacts.",
            Self::BatteryHigh => "Use a battery within `battery.maximum_v`; brake less on long descents.",
            Self::AnalogStale => "Check the board's analogue supply.",
            Self::ArmAngle => "Accelerate less, or take a gentler slope; let the arm hang still before arming again.",
            Self::CommandTimeout => "Check the link and the operator's program; keep the page in front while driving.",
            Self::StopTimeout => "Bring the vehicle to level ground; something kept it from coming to rest.",
            Self::NotFinite => "Check the parameters that were changed last; keep the records and report them.",
            Self::DeadlineMissed => "Keep the records and report them: the board was too busy.",
            Self::SparAngle => "Lift the spar upright; drive more gently with a camera.",
            Self::SparImu => "Check the spar IMU's cable; the vehicle drives without levelling meanwhile.",
            Self::BallastEncoder => {
                "Check the ballast encoder's cable; the vehicle drives without levelling meanwhile."
            }
            Self::BallastOvercurrent => "Free the ballast; check its motor and leads for a short.",
            Self::BallastMotorOpen => "Check the ballast motor's leads and plug.",
            Self::BallastCurrentSensor => "Check the ballast motor's current sensor.",
            Self::LeftMotorOpen => "Check the left motor's leads and plug.",
            Self::RightMotorOpen => "Check the right motor's leads and plug.",
            Self::CurrentSensor => "Check the drive motors' current sensors.",
            Self::StopContacts => "Check both contacts of the emergency stop and their wires.",
            Self::SteepSlope => "Arm the vehicle on a gentler slope; keep chocks at hand when it stops.",
            Self::DriveMotorHot => "Let the drive motors cool for a minute; take a gentler slope or a lighter load.",
            Self::BallastMotorHot => "Let the ballast motor cool for a minute; check that the ballast turns freely.",
        }
    }
}

impl Blocker {
    /// What to do so that the vehicle can be armed.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::NotCalibrated => "Keep the vehicle at rest for some seconds.",
            Self::FaultLatched => "Remove the cause of each fault, then clear the faults.",
            Self::EmergencyStop => "Release the emergency stop.",
            Self::BridgeBreak => "Remove the cause of the break, then clear the faults.",
            Self::Imu => "Check the arm IMU's supply and cable.",
            Self::Encoder => "Check the encoders' supply and cables.",
            Self::Analog => "Check the board's analogue supply.",
            Self::Battery => "Charge or change the battery.",
            Self::NotAtRest => "Let the vehicle and its arm come to rest; put chocks to the wheels on a slope.",
            Self::ArmAngle => "Let the arm hang down.",
            Self::NoCommand => "Let the operator's program send a drive command.",
            Self::CommandNotNeutral => "Let go of keys, pad and gamepad.",
            Self::Parameters => "Wait until the set is stored; if the stored set was lost, store one.",
            Self::CurrentSensor => "Check the drive motors' current sensors.",
            Self::StopContacts => "Check both contacts of the emergency stop, then clear the faults.",
            Self::BreakPath => "Check the wiring of the bridges' break; boot the board again.",
            Self::BoardOptions => "Set the part's option bytes as the bring-up page says.",
            Self::PartRevision => "Use a board with a supported part.",
            Self::Image => "Flash the firmware again.",
            Self::Unsealed => "Flash the firmware by `cargo flash-board`, which writes its checksum.",
            Self::MotorHot => "Let the drive motors cool for a minute.",
            Self::Ram => "Switch the board's supply off and on; if the RAM fails again, use another board.",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each code's remedy is a sentence of its own.
    #[test]
    fn each_code_has_a_remedy_of_its_own() {
        for fault in Fault::ALL {
            assert!(
                fault.remedy().contains(' ') && fault.remedy().ends_with('.'),
                "{}",
                fault.name()
            );
            let same = Fault::ALL.iter().filter(|other| other.remedy() == fault.remedy());
            assert_eq!(same.count(), 1, "{}", fault.name());
        }
        for blocker in Blocker::ALL {
            assert!(
                blocker.remedy().contains(' ') && blocker.remedy().ends_with('.'),
                "{}",
                blocker.name()
            );
            let same = Blocker::ALL.iter().filter(|other| other.remedy() == blocker.remedy());
            assert_eq!(same.count(), 1, "{}", blocker.name());
        }
    }
}
