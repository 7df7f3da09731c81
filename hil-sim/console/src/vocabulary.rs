//! The firmware's vocabulary for the page: codes with meaning and remedy, modes, steps of a
//! scenario.

use firmware::drive_board::LINK_BAUD;
use firmware::protocol::message::{COMMAND_PERIOD_MS, PROTOCOL_VERSION};
use model::supervise::codes::{Blocker, Fault, FaultClass, Limit};
use plant::fault::SensorFault;
use serde::Serialize;
use virtual_board::scenario::shipped;

/// A code of the firmware.
#[derive(Debug, Serialize)]
pub struct CodeWords {
    /// Its bit in the status.
    number: u8,
    name: &'static str,
    meaning: &'static str,
    /// Effect of a fault; empty for blockers and limits.
    effect: &'static str,
    /// The operator's remedy; empty for limits.
    remedy: &'static str,
}

/// All names that the page takes from the firmware.
#[derive(Debug, Serialize)]
pub struct Vocabulary {
    protocol: u16,
    /// Bits per second of the board's serial link.
    link_baud: u32,
    /// Time between two repetitions of the operator's command, ms.
    command_period_ms: u64,
    faults: Vec<CodeWords>,
    blockers: Vec<CodeWords>,
    limits: Vec<CodeWords>,
    /// Faults of a sensor that the simulation has.
    sensor_faults: [SensorFault; SensorFault::ALL.len()],
    /// The shipped scenarios.
    scenarios: Vec<&'static str>,
}

impl Vocabulary {
    /// The vocabulary with which this module was built.
    pub fn new() -> Self {
        Self {
            protocol: PROTOCOL_VERSION,
            link_baud: LINK_BAUD,
            command_period_ms: COMMAND_PERIOD_MS,
            faults: Fault::ALL.iter().zip(Fault::DETECTION).map(fault).collect(),
            blockers: Blocker::ALL
                .iter()
                .map(|blocker| words(*blocker as u8, blocker.name(), blocker.meaning(), "", blocker.remedy()))
                .collect(),
            limits: Limit::ALL
                .iter()
                .map(|limit| words(*limit as u8, limit.name(), limit.meaning(), "", ""))
                .collect(),
            sensor_faults: SensorFault::ALL,
            scenarios: shipped::names().collect(),
        }
    }
}

impl Default for Vocabulary {
    fn default() -> Self {
        Self::new()
    }
}

fn words(
    number: u8,
    name: &'static str,
    meaning: &'static str,
    effect: &'static str,
    remedy: &'static str,
) -> CodeWords {
    CodeWords {
        number,
        name,
        meaning: meaning.trim(),
        effect,
        remedy,
    }
}

fn fault((fault, (class, _, _)): (&Fault, &(FaultClass, &'static str, &'static str))) -> CodeWords {
    let effect = match class {
        FaultClass::Opens => "the bridges open at once",
        FaultClass::Stops => "controlled stop",
        FaultClass::Spar => "only the ballast motor is off",
    };
    words(*fault as u8, fault.name(), fault.meaning(), effect, fault.remedy())
}
