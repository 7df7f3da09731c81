//! What host and board say to each other.

use model::sample::MOTORS;
use model::supervise::arming::{Mode, Request};
use model::tick::Telemetry;
use serde::{Deserialize, Serialize};

/// Version of the messages: host and board must agree.
pub const PROTOCOL_VERSION: u16 = 1;

/// From the host to the board.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum HostMessage {
    /// Who are you? Answered by [`BoardMessage::Identity`].
    Identify,
    /// Drive so; repeated before the dead-man time is over.
    Drive {
        /// Speed, m/s, forward positive.
        speed_m_s: f32,
        /// Yaw rate, rad/s, anticlockwise positive; exactly 0 holds the heading.
        yaw_rate_rad_s: f32,
    },
    /// Ask the arming state machine.
    Request(Request),
    /// Read, change or store parameters.
    Parameters(ParameterRequest),
}

/// What the host asks of the parameters. Numbers are in the order of
/// [`model::vehicle::VehicleParameters::for_each`]; [`ParameterAnswer::Value`] tells each one's place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ParameterRequest {
    /// Tell one value of the set in force.
    Read {
        /// Its number.
        number: u16,
    },
    /// Stage a change of one value, not in force before [`ParameterRequest::Store`]. A refused change drops every
    /// staged one.
    Write {
        /// Its number.
        number: u16,
        /// Its new value.
        value: f32,
    },
    /// Check the staged set (the set in force, where nothing is staged), keep it in flash, and put it in force. Only
    /// while disarmed. A refused store drops every staged change.
    Store,
    /// Stage the built-in set, not in force before [`ParameterRequest::Store`].
    Defaults,
    /// Tell one value of the staged set, which is the set in force where nothing is staged.
    ReadStaged {
        /// Its number.
        number: u16,
    },
    /// Drop every staged change.
    Discard,
}

/// What the board answers to a [`ParameterRequest`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ParameterAnswer {
    /// One value of the set that was asked for, or as it has just been staged.
    Value {
        /// Its number.
        number: u16,
        /// How many there are.
        count: u16,
        /// Its value.
        value: f32,
        /// Hash of every name and range: host and board mean the same by a number.
        schema: u32,
    },
    /// There is no such number.
    NoSuchNumber,
    /// The value is out of its range.
    OutOfRange {
        /// Least allowed.
        min: f32,
        /// Most allowed.
        max: f32,
    },
    /// The set contradicts itself; number of the value to change.
    Inconsistent {
        /// Its number.
        number: u16,
    },
    /// The vehicle is armed.
    Armed,
    /// The flash failed; the set in force stays.
    FlashFailed,
    /// The set is stored and in force.
    Stored,
    /// The built-in set is ready to be stored.
    DefaultsReady,
    /// No change is staged any more.
    Discarded,
}

/// From the board to the host.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum BoardMessage {
    /// Answer to [`HostMessage::Identify`].
    Identity {
        /// [`PROTOCOL_VERSION`] of the board.
        protocol: u16,
    },
    /// The state of the vehicle.
    Status(Status),
    /// Answer to [`HostMessage::Parameters`].
    Parameters(ParameterAnswer),
}

/// The state of the vehicle as it is sent, [`Telemetry`] in the form of the wire.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Ticks since boot.
    pub tick: u32,
    /// Time of the tick's sample, us since boot.
    pub time_us: u64,
    /// Arming state.
    pub mode: Mode,
    /// Latched faults, bit n is fault n.
    pub faults: u32,
    /// Arming blockers, bit n is blocker n.
    pub blockers: u32,
    /// Limits, bit n is limit n.
    pub limits: u32,
    /// Arm angle from the vertical, rad.
    pub phi_rad: f32,
    /// Its rate, rad/s.
    pub phi_rate_rad_s: f32,
    /// Speed, m/s.
    pub speed_m_s: f32,
    /// Governed speed reference, m/s.
    pub speed_reference_m_s: f32,
    /// Slope, rad.
    pub slope_rad: f32,
    /// Heading, rad.
    pub heading_rad: f32,
    /// Yaw rate, rad/s.
    pub yaw_rate_rad_s: f32,
    /// Dead-reckoned position, m.
    pub x_m: f32,
    /// Dead-reckoned position, m.
    pub y_m: f32,
    /// Spar angle from the vertical, rad.
    pub spar_rad: f32,
    /// Ballast angle relative to the spar, rad.
    pub ballast_rad: f32,
    /// Motor voltages, V.
    pub voltage_v: [f32; MOTORS],
    /// Motor currents, A.
    pub current_a: [f32; MOTORS],
    /// Supply voltage, V.
    pub battery_v: f32,
    /// Late ticks since boot.
    pub late_ticks: u32,
    /// Refused requests to arm.
    pub refused_arms: u32,
    /// Frames the board could not read.
    pub bad_frames: u32,
    /// CPU cycles of the last tick and of the worst.
    pub tick_cycles: [u32; 2],
}

impl Status {
    /// The state for the wire.
    pub fn new(telemetry: &Telemetry, bad_frames: u32, tick_cycles: [u32; 2]) -> Self {
        let estimate = &telemetry.estimate;
        Self {
            tick: telemetry.tick,
            time_us: telemetry.time_us,
            mode: telemetry.mode,
            faults: telemetry.faults.bits(),
            blockers: telemetry.blockers.bits(),
            limits: telemetry.limits.bits(),
            phi_rad: estimate.phi_rad,
            phi_rate_rad_s: estimate.phi_rate_rad_s,
            speed_m_s: estimate.speed_m_s,
            speed_reference_m_s: telemetry.speed_reference_m_s,
            slope_rad: estimate.slope_rad,
            heading_rad: estimate.heading_rad,
            yaw_rate_rad_s: estimate.yaw_rate_rad_s,
            x_m: estimate.x_m,
            y_m: estimate.y_m,
            spar_rad: estimate.spar_rad,
            ballast_rad: estimate.ballast_rad,
            voltage_v: telemetry.voltage_v,
            current_a: telemetry.current_a,
            battery_v: telemetry.battery_v,
            late_ticks: telemetry.late_ticks,
            refused_arms: telemetry.refused_arms,
            bad_frames,
            tick_cycles,
        }
    }
}
