//! What the tasks tell each other: one latest value a topic, stamped, and the age judged where it is used.

use core::cell::Cell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_time::Instant;
use model::command::Request;
use model::sample::{ImuRaw, MOTORS};
use model::status::Status;
use model::vehicle::Vehicle;

use crate::hardware::AnalogReading;
use crate::link::message::{LinkCounters, ParameterAnswer, ParameterRequest, TickCycles};
use crate::watchdog::Checkins;

/// A value with the time it was taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stamped<T> {
    /// When.
    pub at: Instant,
    /// What.
    pub value: T,
}

/// The latest value of one kind, for any number of readers.
#[derive(Debug)]
pub struct Topic<M: RawMutex, T: Copy> {
    latest: Mutex<M, Cell<Option<Stamped<T>>>>,
}

impl<M: RawMutex, T: Copy> Topic<M, T> {
    /// Nothing yet.
    pub const fn new() -> Self {
        Self {
            latest: Mutex::new(Cell::new(None)),
        }
    }

    /// Replaces the value, stamped `at`.
    pub fn publish(&self, at: Instant, value: T) {
        self.latest.lock(|cell| cell.set(Some(Stamped { at, value })));
    }

    /// The latest value.
    pub fn latest(&self) -> Option<Stamped<T>> {
        self.latest.lock(Cell::get)
    }

    /// The latest value and its age at `now` in us; `u32::MAX` where there is none (or it is older).
    pub fn with_age(&self, now: Instant) -> (Option<T>, u32) {
        match self.latest() {
            None => (None, u32::MAX),
            Some(Stamped { at, value }) => {
                let age = now.saturating_duration_since(at).as_micros();
                (Some(value), u32::try_from(age).unwrap_or(u32::MAX))
            }
        }
    }
}

impl<M: RawMutex, T: Copy> Default for Topic<M, T> {
    fn default() -> Self {
        Self::new()
    }
}

/// A drive command as the operator sent it; finite by construction (the link refuses others).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DriveCommand {
    /// Speed, m/s.
    pub speed_m_s: f32,
    /// Yaw rate, rad/s, anticlockwise positive.
    pub yaw_rate_rad_s: f32,
}

/// Everything the tasks share. One for each vehicle.
#[allow(missing_debug_implementations)] // Its parts have none.
pub struct Topics<M: RawMutex> {
    /// Readings of the arm IMU.
    pub arm_imu: Topic<M, ImuRaw>,
    /// Raised with each reading of the arm IMU: the control task waits for it.
    pub arm_imu_ready: Signal<M, ()>,
    /// Spar IMU readings.
    pub spar_imu: Topic<M, ImuRaw>,
    /// Encoder counts, extended.
    pub encoders: Topic<M, [i64; MOTORS]>,
    /// Analogue readings.
    pub analog: Topic<M, AnalogReading>,
    /// The latest drive command.
    pub command: Topic<M, DriveCommand>,
    /// Requests to the arming state machine, each to be taken once.
    pub requests: Channel<M, Request, 4>,
    /// What the host asks of the parameters.
    pub parameter_requests: Channel<M, ParameterRequest, 4>,
    /// Answers to it.
    pub parameter_answers: Channel<M, ParameterAnswer, 4>,
    /// Parameters are being changed: the vehicle must not arm.
    pub parameters_pending: Topic<M, bool>,
    /// A new set to drive by from the next disarmed tick on.
    pub new_vehicle: Signal<M, Vehicle<f32>>,
    /// The host asked who we are.
    pub identify: Signal<M, ()>,
    /// The vehicle's status after the last tick.
    pub status: Topic<M, Status>,
    /// Cost of the last tick.
    pub cycles: Topic<M, TickCycles>,
    /// Link counters.
    pub link: Topic<M, LinkCounters>,
    /// Who is alive.
    pub checkins: Checkins<M>,
}

impl<M: RawMutex> Topics<M> {
    /// All empty.
    pub const fn new() -> Self {
        Self {
            arm_imu: Topic::new(),
            arm_imu_ready: Signal::new(),
            spar_imu: Topic::new(),
            encoders: Topic::new(),
            analog: Topic::new(),
            command: Topic::new(),
            requests: Channel::new(),
            parameter_requests: Channel::new(),
            parameter_answers: Channel::new(),
            parameters_pending: Topic::new(),
            new_vehicle: Signal::new(),
            identify: Signal::new(),
            status: Topic::new(),
            cycles: Topic::new(),
            link: Topic::new(),
            checkins: Checkins::new(),
        }
    }
}

impl<M: RawMutex> Default for Topics<M> {
    fn default() -> Self {
        Self::new()
    }
}
