//! The steps in which the tool arms, and a person acts on the board and looks at its lines.

use std::io::Write;

use firmware::hardware::ResetCause;
use firmware::protocol::message::{BoardStatus, STATUS_RATE_HZ};
use model::sample::Motor;
use model::supervise::arming::Mode;
use report::error::CommandError;

use super::person::Person;
use super::powered::{LOOK_S, STEADY_THE_ARM};
use super::procedure::{Procedure, StepEnd};
use super::step::{ArmedLook, LookEnd};
use super::verdict::{Finding, StepVerdict};
use crate::cli::link::console::Console;
use crate::cli::link::drive::DriveJob;
use crate::cli::link::wire::Wire;

/// Duration of a look at a driven motor, s: long enough for a picture. Without ground under the wheels nothing holds the
/// arm in the long run.
const DRIVEN_LOOK_S: f64 = 8.0;

/// Oscilloscope picture of the left motor's lines at a small forward voltage.
const PICTURE: &str = "\
         |<------------ 50 us ------------>|
PE9   ''''''''''''''''''''''''''''''''''''''''''''
PE11  ___/'''''''''''''''''''''''''''\\_____/''''''
         |<---- both high: brake --->|<--->| drive
                       ^ the converter samples: the current at PC0, which falls, crosses its mean";

impl<W: Wire, P: Person, O: Write> Procedure<'_, W, P, O> {
    /// Arms for the person's act, asks the question, and checks that the board can arm again.
    pub(super) fn armed_look(&mut self, look: &ArmedLook) -> Result<Finding, StepEnd> {
        if matches!(look.ends, LookEnd::Time | LookEnd::Stop) {
            self.tell(PICTURE)?;
        }
        let boot = self.boot()?;
        self.settle()?;
        let seconds = if look.speed_m_s == 0.0 { LOOK_S } else { DRIVEN_LOOK_S };
        self.ask_to(&format!("Armed for {seconds} s after Enter: then {}", look.act))?;
        self.ready()?;
        let job = DriveJob::new(look.speed_m_s, 0.0, seconds)?;
        let mut shown = WatchedLook::default();
        let (link, console) = (&mut self.link, &mut *self.console);
        let driven = link.drive_watching(&job, |client| {
            if let Some(status) = &client.status {
                shown.show(status, console);
            }
        });
        shown.written.map_err(StepEnd::Tool)?;
        match (driven, look.ends) {
            (Ok(_), LookEnd::Time) => {}
            (Ok(_), _) => return Ok(Finding::failed(format!("still armed after {seconds} s"))),
            (Err(error), LookEnd::Time) => return Err(error.into()),
            (Err(error), _) if !shown.armed => return Err(error.into()),
            // A board that the act silences says nothing, and the act may take its port away.
            (Err(_), LookEnd::Opened | LookEnd::Restart(_)) => {}
            (Err(error), LookEnd::Stop) => {
                if !self.stopped_by_the_stop()? {
                    return Err(error.into());
                }
            }
        }
        let found = self.look(look.question)?;
        if look.speed_m_s != 0.0 {
            // The arm of a vehicle that has driven with its wheels in the air swings for longer than the tool waits.
            self.ask_to(STEADY_THE_ARM)?;
        }
        if found.verdict != StepVerdict::Passed || look.ends == LookEnd::Time {
            return Ok(found);
        }
        let ended = match look.ends {
            LookEnd::Restart(causes) => {
                self.next_boot(boot)?;
                let cause = self.boot_log()?.cause;
                let seen = format!("reset by {}", cause.map_or("an unknown cause", ResetCause::name));
                if !cause.is_some_and(|cause| causes.contains(&cause)) {
                    return Ok(Finding::failed(seen));
                }
                seen
            }
            LookEnd::Opened => {
                let status = self.link.fresh_status()?;
                if status.boot != boot || status.vehicle.mode != Mode::Disarmed {
                    return Ok(Finding::failed(format!(
                        "boot {boot} is now boot {}, {}",
                        status.boot,
                        status.vehicle.mode.name()
                    )));
                }
                format!("disarmed by {}", status.vehicle.faults)
            }
            LookEnd::Stop | LookEnd::Time => {
                self.ask_to("Release the emergency stop")?;
                "disarmed by the stop".into()
            }
        };
        self.settle()?;
        Ok(Finding::passed(format!("seen; {ended}")))
    }
}

/// What the tool shows while a person looks at an armed board: the left motor's mean current, each second.
#[derive(Debug)]
struct WatchedLook {
    armed: bool,
    last: Option<u32>,
    sum_a: f64,
    count: u32,
    written: Result<(), CommandError>,
}

impl Default for WatchedLook {
    fn default() -> Self {
        Self {
            armed: false,
            last: None,
            sum_a: 0.0,
            count: 0,
            written: Ok(()),
        }
    }
}

impl WatchedLook {
    /// Takes a status, which may be the last one again.
    fn show<O: Write>(&mut self, status: &BoardStatus, console: &mut Console<O>) {
        self.armed |= status.vehicle.mode == Mode::Armed;
        if self.last.replace(status.sequence) == Some(status.sequence) || self.written.is_err() {
            return;
        }
        self.sum_a += f64::from(status.vehicle.current_a[Motor::Left as usize]);
        self.count += 1;
        if self.count == u32::from(STATUS_RATE_HZ) {
            let mean_a = self.sum_a / f64::from(self.count);
            (self.sum_a, self.count) = (0.0, 0);
            self.written = console.line(&format!("   armed; left motor {mean_a:+.2} A, mean of 1 s"));
        }
    }
}
