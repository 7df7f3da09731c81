//! Driving over the link: arms, drives, stops, and always disarms.

use std::io::Write;

use firmware::protocol::message::{Answer, BoardStatus, COMMAND_PERIOD_MS, Order, ParameterAnswer, ParameterRequest};
use model::command::{DriveCommand, Request};
use model::supervise::arming::Mode;
use report::error::CommandError;

use super::console::Console;
use super::session::{Link, refused};
use super::status::line;
use super::wire::Wire;

/// Largest speed and yaw rate of any vehicle, m/s and rad/s: the ends of the ranges of `speed_max_m_s` and
/// `yaw_rate_max_rad_s`.
const SPEED_MAX_M_S: f32 = 20.0;
const YAW_RATE_MAX_RAD_S: f32 = 20.0;
/// Longest drive and longest look, s.
pub const SECONDS_MAX: f64 = 3600.0;

/// How long the tool commands standstill before it arms, us: the vehicle arms only under a fresh command of 0.
const NEUTRAL_US: u64 = 100_000;
/// Longest time that a stop at the end of a drive may take, us.
const STOP_US: u64 = 4_000_000;
/// Speed below which the vehicle counts as stopped, m/s, and for how long it must be below it, us.
const STOPPED_M_S: f32 = 0.05;
const STOPPED_US: u64 = 500_000;

/// What to drive, checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveJob {
    speed_m_s: f32,
    yaw_rate_rad_s: f32,
    seconds: f64,
}

/// Checks a time in s.
///
/// # Errors
/// [`CommandError::Input`]: not a number, not positive, or too long.
pub fn check_seconds(seconds: f64) -> Result<f64, CommandError> {
    if seconds > 0.0 && seconds <= SECONDS_MAX {
        Ok(seconds)
    } else {
        Err(CommandError::Input(format!(
            "--seconds {seconds}: allowed is more than 0, up to {SECONDS_MAX}"
        )))
    }
}

impl DriveJob {
    /// Checks the numbers before anything else happens.
    ///
    /// # Errors
    /// [`CommandError::Input`] names the number and what is allowed.
    pub fn new(speed_m_s: f32, yaw_rate_rad_s: f32, seconds: f64) -> Result<Self, CommandError> {
        within("--speed-m-s", speed_m_s, SPEED_MAX_M_S)?;
        within("--yaw-rate-rad-s", yaw_rate_rad_s, YAW_RATE_MAX_RAD_S)?;
        let seconds = check_seconds(seconds)?;
        Ok(Self {
            speed_m_s,
            yaw_rate_rad_s,
            seconds,
        })
    }
}

/// Checks that `value` is a number within `max` either way.
fn within(flag: &str, value: f32, max: f32) -> Result<(), CommandError> {
    if value.abs() <= max {
        Ok(())
    } else {
        Err(CommandError::Input(format!(
            "{flag} {value}: allowed is {} to {max}",
            -max
        )))
    }
}

impl<W: Wire> Link<W> {
    /// Arms, drives, stops. Whatever happens, a Disarm is the last thing sent, and the board must confirm it.
    ///
    /// # Errors
    /// A speed beyond the vehicle's largest; the board refuses to arm, falls silent, or leaves the armed state; the
    /// output is closed; the user asks to stop twice.
    pub fn drive<O: Write>(&mut self, drive: &DriveJob, console: &mut Console<O>) -> Result<(), CommandError> {
        let status = self.drive_watching(drive, |_| {})?;
        console.coloured_line(&line(&status))
    }

    /// As [`Link::drive`]; `watch` sees the newest status all the while that the vehicle is armed. Returns the last
    /// status before the Disarm.
    ///
    /// # Errors
    /// As [`Link::drive`].
    pub fn drive_watching(
        &mut self,
        drive: &DriveJob,
        watch: impl FnMut(&BoardStatus),
    ) -> Result<BoardStatus, CommandError> {
        let driven = self.armed_drive(drive, watch);
        let disarmed = self.disarm();
        let status = driven?;
        disarmed?;
        Ok(status)
    }

    /// Everything but the Disarm; returns the last status before it.
    fn armed_drive(
        &mut self,
        drive: &DriveJob,
        mut watch: impl FnMut(&BoardStatus),
    ) -> Result<BoardStatus, CommandError> {
        self.check_limits(drive)?;
        let mut sent_us = None;
        let neutral_from_us = self.wire.now_us();
        while self.wire.now_us() - neutral_from_us < NEUTRAL_US {
            self.command(0.0, 0.0, &mut sent_us)?;
            self.listen()?;
        }
        let answer = self.ask_while(Order::Request(Request::Arm), |link| {
            link.command(0.0, 0.0, &mut sent_us)
        })?;
        if let Answer::Refused(refusal) = answer {
            return Err(refused(refusal));
        }
        // What the board said before it armed is over.
        self.client.status = None;
        let from_us = self.wire.now_us();
        let drive_us = (drive.seconds * 1e6) as u64;
        while self.wire.now_us() - from_us < drive_us && self.interrupts() == 0 {
            self.command(drive.speed_m_s, drive.yaw_rate_rad_s, &mut sent_us)?;
            self.listen()?;
            if let Some(status) = &self.client.status {
                watch(status);
            }
            self.check_armed()?;
        }
        self.stop(&mut sent_us, watch)?;
        self.fresh_status()
    }

    /// A controlled stop, which a second wish to stop cuts short.
    fn stop(&mut self, sent_us: &mut Option<u64>, mut watch: impl FnMut(&BoardStatus)) -> Result<(), CommandError> {
        let from_us = self.wire.now_us();
        let interrupts = self.interrupts();
        let mut moving_us = from_us;
        while self.wire.now_us() - from_us < STOP_US && self.wire.now_us() - moving_us < STOPPED_US {
            if self.interrupts() > interrupts.max(1) {
                return Err(CommandError::Checks("interrupted twice: disarmed at once".into()));
            }
            self.command(0.0, 0.0, sent_us)?;
            self.listen()?;
            if let Some(status) = &self.client.status {
                watch(status);
            }
            self.check_armed()?;
            let stopped = self
                .client
                .status
                .is_some_and(|status| status.vehicle.estimate.speed_m_s.abs() < STOPPED_M_S);
            if !stopped {
                moving_us = self.wire.now_us();
            }
        }
        Ok(())
    }

    /// Repeats the drive command, if it is time to.
    fn command(&mut self, speed_m_s: f32, yaw_rate_rad_s: f32, sent_us: &mut Option<u64>) -> Result<(), CommandError> {
        let now_us = self.wire.now_us();
        if sent_us.is_none_or(|at| now_us - at >= COMMAND_PERIOD_MS * 1000) {
            self.give(Order::Drive(DriveCommand::driving(speed_m_s, yaw_rate_rad_s)))?;
            *sent_us = Some(now_us);
        }
        Ok(())
    }

    /// The vehicle must still be armed, as far as it has told since the board confirmed that it is.
    fn check_armed(&mut self) -> Result<(), CommandError> {
        let Some(status) = self.client.status else {
            return Ok(());
        };
        let vehicle = status.vehicle;
        if vehicle.mode == Mode::Armed {
            return Ok(());
        }
        Err(CommandError::Checks(format!(
            "the vehicle is {} by itself: {}",
            vehicle.mode.name(),
            vehicle.faults
        )))
    }

    /// The vehicle's own limits must allow the drive.
    fn check_limits(&mut self, drive: &DriveJob) -> Result<(), CommandError> {
        for (flag, name, value) in [
            ("--speed-m-s", "speed_max_m_s", drive.speed_m_s),
            ("--yaw-rate-rad-s", "yaw_rate_max_rad_s", drive.yaw_rate_rad_s),
        ] {
            let number = self.number_of("control", name)?;
            if let ParameterAnswer::Value { value: max, .. } = self.ask(ParameterRequest::Read { number })? {
                within(flag, value, max)?;
            }
        }
        Ok(())
    }
}
