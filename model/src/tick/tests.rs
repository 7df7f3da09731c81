//! The tick and its stages against what is known exactly: raw counts, motions and verdicts that a test makes up.

mod actuate;
mod bounds;
mod laws;
mod lost;
mod motion;
mod rest;
mod sense;

use super::VehicleCore;
use crate::analog::Analog;
use crate::board::BoardScales;
use crate::command::{Command, Request};
use crate::estimate::tilt::TiltReading;
use crate::sample::{ImuRaw, ImuSample, MOTORS, Sample};
use crate::sensed::Sensed;
use crate::status::Status;
use crate::supervise::arming::Mode;
use crate::supervise::codes::BlockerSet;
use crate::vehicle::test_vehicle::reference;
use crate::vehicle::{G, Vehicle};

/// A sample of a vehicle that stands still on the level with a battery of 25 V.
fn resting() -> Sample {
    let imu = ImuSample {
        raw: ImuRaw {
            accel: [0, 0, 4000],
            gyro: [0; 3],
            temperature: 0,
        },
        age_us: 300,
    };
    let scales = BoardScales::EXAMPLE.analog;
    let mut analog = Analog::all(scales.left_current.zero_count);
    analog.battery_voltage = (25.0 / scales.battery_voltage.per_count) as u16;
    Sample {
        time_us: 0,
        encoder_counts: [0; MOTORS],
        encoder_age_us: 100,
        arm_imu: imu,
        spar_imu: imu,
        analog,
        analog_age_us: 100,
        emergency_stop: false,
        break_input: false,
        bridge_break: false,
        board_blockers: 0,
    }
}

/// What stage 1 makes of [`resting`].
fn sensed_at_rest() -> Sensed {
    VehicleCore::new(&reference(), &BoardScales::EXAMPLE).sense(&resting())
}

/// The reference vehicle without its camera spar.
fn without_spar() -> Vehicle<f32> {
    let mut parameters = *reference().parameters();
    parameters.spar = None;
    Vehicle::new(parameters).expect("valid")
}

/// The whole core with the sample and the command of a vehicle that stands still.
struct Bench {
    core: VehicleCore,
    sample: Sample,
    command: Command,
}

impl Bench {
    fn new() -> Self {
        Self {
            core: VehicleCore::new(&reference(), &BoardScales::EXAMPLE),
            sample: resting(),
            command: Command {
                age_us: 1000,
                ..Command::NONE
            },
        }
    }

    /// One tick, a millisecond after the last one; the IMUs' noise goes on.
    fn tick(&mut self) -> Status {
        self.sample.time_us += 1000;
        let noise = (self.sample.time_us / 1000 % 2) as i16;
        for imu in [&mut self.sample.arm_imu, &mut self.sample.spar_imu] {
            imu.raw.accel[0] = noise;
        }
        self.core.step(&self.sample, &self.command).status
    }

    fn request(&mut self, request: Request) -> Status {
        self.command.request = request;
        let status = self.tick();
        self.command.request = Request::None;
        status
    }

    /// Waits until nothing blocks arming, and arms.
    fn armed() -> Self {
        let mut bench = Self::new();
        let ready = (0..1000).find(|_| bench.tick().blockers == BlockerSet::EMPTY);
        assert!(ready.is_some());
        assert_eq!(bench.request(Request::Arm).mode, Mode::Armed);
        bench
    }
}

/// The reading of an IMU that feels `force_g` along its x and z axes.
fn feels(force_g: [f32; 2]) -> TiltReading {
    TiltReading {
        rate_rad_s: 0.0,
        force_x_m_s2: force_g[0] * G,
        force_z_m_s2: force_g[1] * G,
    }
}
