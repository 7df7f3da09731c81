//! What an operator does about each blocker. What to do about a fault stands in the list of faults.

use super::codes::Blocker;

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
    use crate::supervise::codes::Fault;

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
