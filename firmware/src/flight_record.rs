//! The inputs and outputs of one tick.

use model::analog::Analog;
use model::command::Command;
use model::sample::{Actuation, ImuRaw, ImuSample, MOTORS, Sample};

/// All inputs and outputs of one tick, for a debugger and for replays on the host.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct FlightRecord {
    /// Number of the tick; 0 before the first.
    pub tick: u32,
    /// The sample.
    pub sample: Sample,
    /// The operator's command.
    pub command: Command,
    /// The actuation that the bridges received.
    pub actuation: Actuation,
}

impl FlightRecord {
    /// The record before the first tick: no sample, no command, no actuation.
    pub const NONE: Self = Self {
        tick: 0,
        sample: Sample {
            time_us: 0,
            encoder_counts: [0; MOTORS],
            encoder_age_us: 0,
            arm_imu: IMU_NONE,
            spar_imu: IMU_NONE,
            analog: Analog::all(0),
            analog_age_us: 0,
            emergency_stop: false,
            break_input: false,
            bridge_break: false,
            board_blockers: 0,
        },
        command: Command {
            age_us: 0,
            ..Command::NONE
        },
        actuation: Actuation::SAFE,
    };
}

const IMU_NONE: ImuSample = ImuSample {
    raw: ImuRaw {
        accel: [0; 3],
        gyro: [0; 3],
        temperature: 0,
    },
    age_us: 0,
};

/// A receiver of flight records.
pub trait Recorder {
    /// Takes the record of one tick.
    fn record(&mut self, record: &FlightRecord);

    /// Whether the control task also encodes the records for the host, as stream and look-back. Only a simulation whose
    /// host reads neither returns false, to save the cost.
    fn for_host(&self) -> bool {
        true
    }
}
