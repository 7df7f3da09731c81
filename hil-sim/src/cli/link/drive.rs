//! Driving over the link: arms, drives, stops, and always disarms.

use std::io::Write;
use std::ops::ControlFlow;

use firmware::protocol::message::{
    Answer, BoardStatus, COMMAND_PERIOD_MS, Order, ParameterAnswer, ParameterRequest, Refusal,
};
use model::command::{DriveCommand, Request};
use model::supervise::arming::Mode;
use model::supervise::codes::Blocker;
use model::tick::STOPPED_M_S;
use record_file::writer::RecordWriter;
use report::error::CommandError;
use virtual_board::link_client::LinkClient;

use super::console::Console;
use super::recording::{LinkRecording, Recorded};
use super::session::{Link, refused};
use super::status::{SHOW_US, line};
use super::wire::Wire;

/// Longest drive, and longest display of the status, s.
pub const SECONDS_MAX: f64 = 3600.0;

/// Time for which the tool commands rest before it arms, us: the vehicle arms only under a fresh command of 0.
const NEUTRAL_US: u64 = 100_000;
/// Longest wait for the calibration of the gyros, us. At rest the calibration takes half a second after a boot.
const CALIBRATION_US: u64 = 2_000_000;
/// Longest wait of a drive for the first record and the parameters, us. A board without records can still drive.
const RECORD_BEGINS_US: u64 = 1_000_000;
/// Longest time that a stop at the end of a drive may take, us.
const STOP_US: u64 = 4_000_000;
/// Time for which the speed must stay below [`STOPPED_M_S`], us.
const STOPPED_US: u64 = 500_000;

/// A checked drive.
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
    /// Checks the numbers before any other step.
    ///
    /// # Errors
    /// [`CommandError::Input`] names the number and its allowed range.
    pub fn new(speed_m_s: f32, yaw_rate_rad_s: f32, seconds: f64) -> Result<Self, CommandError> {
        let largest = DriveCommand::largest();
        within("--speed-m-s", speed_m_s, largest.speed_m_s)?;
        within("--yaw-rate-rad-s", yaw_rate_rad_s, largest.yaw_rate_rad_s)?;
        let seconds = check_seconds(seconds)?;
        Ok(Self {
            speed_m_s,
            yaw_rate_rad_s,
            seconds,
        })
    }
}

/// Checks that `value` is a number from `-max` to `max`.
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

/// Why the vehicle is not armed.
enum NotArmed {
    /// The board does not take this host's orders. Another host may be driving, and its vehicle must not be disturbed.
    Stranger(CommandError),
    /// Any other reason; the vehicle may be armed nevertheless.
    Failed(CommandError),
}

/// One status line per half second. A closed output does not end a drive; the tool reports it afterwards.
struct Lines<'a, O> {
    console: &'a mut Console<O>,
    next_us: u64,
    shown: Result<(), CommandError>,
}

impl<'a, O: Write> Lines<'a, O> {
    fn new(console: &'a mut Console<O>) -> Self {
        Self {
            console,
            next_us: 0,
            shown: Ok(()),
        }
    }

    fn show(&mut self, now_us: u64, status: Option<&BoardStatus>) {
        if let Some(status) = status.filter(|_| now_us >= self.next_us && self.shown.is_ok()) {
            self.next_us = now_us + SHOW_US;
            self.shown = self.console.coloured_line(&line(status));
        }
    }

    /// The last status before the Disarm, and what the vehicle has reported since: it is disarmed.
    fn end(self, last: &BoardStatus, disarmed: Option<&BoardStatus>) -> Result<(), CommandError> {
        self.shown?;
        self.console.coloured_line(&line(last))?;
        disarmed.map_or(Ok(()), |status| self.console.coloured_line(&line(status)))
    }
}

impl<W: Wire> Link<W> {
    /// Arms, drives and stops, and shows the status meanwhile. Whatever happens to a vehicle that this host may have
    /// armed, the last order is a Disarm, which the board must confirm.
    ///
    /// # Errors
    /// A speed beyond the vehicle's largest; the board refuses to arm, falls silent, or leaves the armed state; the
    /// output is closed; the user asks to stop twice.
    pub fn drive<O: Write>(&mut self, drive: &DriveJob, console: &mut Console<O>) -> Result<(), CommandError> {
        let mut lines = Lines::new(console);
        let status = self.drive_attended(drive, |link| {
            lines.show(link.wire.now_us(), link.client.status.as_ref());
            ControlFlow::Continue(())
        })?;
        lines.end(&status, self.client.status.as_ref())
    }

    /// As [`Link::drive`], and writes the record of every tick to `out`, from the oldest record that the board still
    /// has. A write error stops the vehicle.
    ///
    /// # Errors
    /// As [`Link::drive`]; `out` cannot be written.
    pub fn drive_recorded<R: Write, O: Write>(
        &mut self,
        drive: &DriveJob,
        out: &mut RecordWriter<R>,
        console: &mut Console<O>,
    ) -> Result<Recorded, CommandError> {
        let identity = match self.client.identity() {
            Some(identity) => *identity,
            None => self.identify()?,
        };
        let mut recorder = LinkRecording::default();
        recorder.begin(self, identity)?;
        // The tool reads the parameters before the vehicle arms, because it sends no commands during the read.
        let from_us = self.wire.now_us();
        while !recorder.is_under_way() && self.wire.now_us() - from_us < RECORD_BEGINS_US {
            self.listen()?;
            recorder.take(self, out)?;
        }
        let mut lines = Lines::new(console);
        let mut written = Ok(());
        let driven = self.drive_attended(drive, |link| {
            lines.show(link.wire.now_us(), link.client.status.as_ref());
            if written.is_ok() {
                written = recorder.take(link, out);
            }
            if written.is_ok() {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        });
        written?;
        // What comes later may have been asked after this.
        let disarmed = self.client.status;
        let recorded = recorder.take(self, out).and_then(|()| recorder.end(self, out));
        lines.end(&driven?, disarmed.as_ref())?;
        recorded
    }

    /// As [`Link::drive`] without output. While the vehicle is armed, `watch` is called with the client, its newest
    /// status and its new records. Returns the last status before the Disarm.
    ///
    /// # Errors
    /// As [`Link::drive`].
    pub fn drive_watching(
        &mut self,
        drive: &DriveJob,
        mut watch: impl FnMut(&mut LinkClient),
    ) -> Result<BoardStatus, CommandError> {
        self.drive_attended(drive, |link| {
            watch(&mut link.client);
            ControlFlow::Continue(())
        })
    }

    /// As [`Link::drive`]. `attend` is called repeatedly while the vehicle is armed, and may end the drive with a
    /// controlled stop. Returns the last status before the Disarm.
    fn drive_attended(
        &mut self,
        drive: &DriveJob,
        attend: impl FnMut(&mut Self) -> ControlFlow<()>,
    ) -> Result<BoardStatus, CommandError> {
        let mut sent_us = None;
        let driven = match self.arm(drive, &mut sent_us) {
            Err(NotArmed::Stranger(error)) => return Err(error),
            Err(NotArmed::Failed(error)) => Err(error),
            Ok(()) => self.armed_drive(drive, &mut sent_us, attend),
        };
        let disarmed = self.disarm();
        let status = driven?;
        disarmed?;
        Ok(status)
    }

    /// Commands rest, and arms.
    fn arm(&mut self, drive: &DriveJob, sent_us: &mut Option<u64>) -> Result<(), NotArmed> {
        if let Err(error) = self.prepare(drive, sent_us) {
            // The client forgets a board that does not know the client.
            return Err(match self.client.identity() {
                None => NotArmed::Stranger(error),
                Some(_) => NotArmed::Failed(error),
            });
        }
        let answer = self.ask_while(Order::Request(Request::Arm), |link| link.command(0.0, 0.0, sent_us));
        match answer.map_err(NotArmed::Failed)? {
            Answer::Refused(Refusal::UnknownSession) => Err(NotArmed::Stranger(refused(Refusal::UnknownSession))),
            Answer::Refused(refusal) => Err(NotArmed::Failed(refused(refusal))),
            _ => Ok(()),
        }
    }

    /// Everything before the Arm request.
    fn prepare(&mut self, drive: &DriveJob, sent_us: &mut Option<u64>) -> Result<(), CommandError> {
        self.check_limits(drive)?;
        let from_us = self.wire.now_us();
        loop {
            let waited_us = self.wire.now_us() - from_us;
            let calibrates = self
                .client
                .status
                .is_some_and(|status| status.vehicle.blockers.contains(Blocker::NotCalibrated));
            if waited_us >= NEUTRAL_US && !(calibrates && waited_us < CALIBRATION_US) {
                return Ok(());
            }
            self.command(0.0, 0.0, sent_us)?;
            self.listen()?;
        }
    }

    /// Everything between Arm and Disarm; returns the last status before it.
    fn armed_drive(
        &mut self,
        drive: &DriveJob,
        sent_us: &mut Option<u64>,
        mut attend: impl FnMut(&mut Self) -> ControlFlow<()>,
    ) -> Result<BoardStatus, CommandError> {
        // A status from before the arming no longer counts.
        self.client.status = None;
        let from_us = self.wire.now_us();
        let drive_us = (drive.seconds * 1e6) as u64;
        while self.wire.now_us() - from_us < drive_us && self.interrupts() == 0 {
            self.command(drive.speed_m_s, drive.yaw_rate_rad_s, sent_us)?;
            self.listen()?;
            let goes_on = attend(self);
            self.check_armed()?;
            if goes_on.is_break() {
                break;
            }
        }
        self.stop(sent_us, attend)?;
        self.fresh_status()
    }

    /// A controlled stop, which a second request to stop ends early.
    fn stop(
        &mut self,
        sent_us: &mut Option<u64>,
        mut attend: impl FnMut(&mut Self) -> ControlFlow<()>,
    ) -> Result<(), CommandError> {
        let from_us = self.wire.now_us();
        let interrupts = self.interrupts();
        let mut moving_us = from_us;
        while self.wire.now_us() - from_us < STOP_US && self.wire.now_us() - moving_us < STOPPED_US {
            if self.interrupts() > interrupts.max(1) {
                return Err(CommandError::Checks("interrupted twice: disarmed at once".into()));
            }
            self.command(0.0, 0.0, sent_us)?;
            self.listen()?;
            // The vehicle is already stopping.
            let _ = attend(self);
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

    /// Repeats the drive command if it is due.
    fn command(&mut self, speed_m_s: f32, yaw_rate_rad_s: f32, sent_us: &mut Option<u64>) -> Result<(), CommandError> {
        let now_us = self.wire.now_us();
        if sent_us.is_none_or(|at| now_us - at >= COMMAND_PERIOD_MS * 1000) {
            self.give(Order::Drive(DriveCommand::driving(speed_m_s, yaw_rate_rad_s)))?;
            *sent_us = Some(now_us);
        }
        Ok(())
    }

    /// Checks that the vehicle is still armed, by its reports since the board confirmed the arming.
    fn check_armed(&mut self) -> Result<(), CommandError> {
        let Some(status) = self.client.status else {
            return Ok(());
        };
        let vehicle = status.vehicle;
        if vehicle.mode == Mode::Armed {
            return Ok(());
        }
        let mode = vehicle.mode.name();
        Err(CommandError::Checks(if vehicle.faults.is_empty() {
            format!("the vehicle is {mode}, without a fault: by the button on the board, or by another host")
        } else {
            format!("the vehicle is {mode} by itself: {}", vehicle.faults)
        }))
    }

    /// Checks that the vehicle's own limits allow the drive.
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
