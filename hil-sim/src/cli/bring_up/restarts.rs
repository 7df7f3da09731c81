//! The steps in which the board restarts, and the steps that store.

use std::io::Write;

use firmware::events::Event;
use firmware::hardware::{ClockSource, ResetCause};
use firmware::protocol::message::ParameterRequest;
use report::error::CommandError;

use super::person::Person;
use super::procedure::{Procedure, StepEnd};
use super::verdict::Finding;
use crate::cli::link::wire::Wire;

/// The parameter that is changed and restored, and by how much: a dead-man time one hundredth longer is harmless.
const SAFETY_TABLE: &str = "safety";
const NAME: &str = "command_timeout_s";
const FACTOR: f32 = 1.01;
/// Largest number of stores between two supply cuts: the stores of some seconds, a small part of a sector's
/// endurance.
const STORES_MAX: u32 = 400;

/// Content of a boot's log.
pub(super) struct BootLog {
    /// What reset the board.
    pub(super) cause: Option<ResetCause>,
    crashed: bool,
    set_lost: bool,
}

impl<W: Wire, P: Person, O: Write> Procedure<'_, W, P, O> {
    /// The number of the board's present boot.
    pub(super) fn boot(&mut self) -> Result<u32, StepEnd> {
        Ok(match self.link.client.identity() {
            Some(identity) => identity.about.boot,
            None => self.link.identify()?.about.boot,
        })
    }

    /// What the log of the present boot says.
    pub(super) fn boot_log(&mut self) -> Result<BootLog, StepEnd> {
        let mut log = BootLog {
            cause: None,
            crashed: false,
            set_lost: false,
        };
        self.link.log(|block, _| {
            for line in &block.lines {
                match line.event {
                    Event::Booted(cause) => log.cause = Some(cause),
                    Event::Crashed => log.crashed = true,
                    Event::SetLost => log.set_lost = true,
                    _ => {}
                }
            }
            Ok(())
        })?;
        Ok(log)
    }

    pub(super) fn cold_starts(&mut self) -> Result<Finding, StepEnd> {
        let starts = self.extent.cold_starts;
        for start in 1..=starts {
            let boot = self.boot()?;
            self.ask_to(&format!(
                "Switch the board's supply off for 1 s and on again ({start} of {starts})"
            ))?;
            self.next_boot(boot)?;
            let log = self.boot_log()?;
            let cause = log.cause.map_or("an unknown cause", ResetCause::name);
            if !matches!(log.cause, Some(ResetCause::PowerOn | ResetCause::BrownOut)) {
                return Ok(Finding::failed(format!("start {start}: reset by {cause}")));
            }
            if log.crashed {
                return Ok(Finding::failed(format!(
                    "start {start}: the last run ended in a panic or a fault"
                )));
            }
        }
        Ok(Finding::passed(format!("{starts} starts")))
    }

    pub(super) fn reset_button(&mut self) -> Result<Finding, StepEnd> {
        let boot = self.boot()?;
        self.ask_to("Press the board's reset button")?;
        self.next_boot(boot)?;
        let cause = self.boot_log()?.cause;
        Ok(Finding::of(
            cause == Some(ResetCause::Pin),
            format!("reset by {}", cause.map_or("an unknown cause", ResetCause::name)),
        ))
    }

    pub(super) fn no_external_clock(&mut self) -> Result<Finding, StepEnd> {
        let boot = self.boot()?;
        self.ask_to("Take the external clock away and reset the board")?;
        self.next_boot(boot)?;
        let without = self.link.fresh_status()?.clock;
        let boot = self.boot()?;
        self.ask_to("Put the external clock back and reset the board")?;
        self.next_boot(boot)?;
        let with = self.link.fresh_status()?.clock;
        Ok(Finding::of(
            without == ClockSource::Internal && with == ClockSource::External,
            format!("without: {}; with: {}", without.name(), with.name()),
        ))
    }

    pub(super) fn update(&mut self) -> Result<Finding, StepEnd> {
        let Some(firmware) = self.extent.firmware.clone() else {
            return Ok(Finding::not_shown("no `--firmware FILE` to send"));
        };
        self.link.update(&firmware, self.console)?;
        self.ask_to(
            "The firmware is sent once more after Enter. Cut the board's supply as soon as the tool says that the board \
             restarts, and switch it on again",
        )?;
        let boot = self.boot()?;
        // The port may have been lost with the supply. A firmware on trial was rolled back.
        let Err(ended) = self.link.update(&firmware, self.console) else {
            return Ok(Finding::not_shown("confirmed twice: the supply was not cut"));
        };
        let [major, minor, patch] = self.next_boot(boot)?.about.version;
        Ok(Finding::passed(format!(
            "confirmed; after the cut the board runs {major}.{minor}.{patch} (the tool: {ended})"
        )))
    }

    pub(super) fn store(&mut self) -> Result<Finding, StepEnd> {
        let number = self.link.number_of(SAFETY_TABLE, NAME)?;
        let before = self.link.read(number)?;
        let changed = before * FACTOR;
        self.store_value(changed)?;
        let after = self.link.read(number)?;
        self.store_value(before)?;
        let back = self.link.read(number)?;
        Ok(Finding::of(
            after.to_bits() == changed.to_bits() && back.to_bits() == before.to_bits(),
            format!("{SAFETY_TABLE}.{NAME}: {before}, stored {changed}, read {after}, put back {back}"),
        ))
    }

    fn store_value(&mut self, value: f32) -> Result<(), CommandError> {
        self.link.set(&[format!("{SAFETY_TABLE}.{NAME}={value}")])
    }

    pub(super) fn power_cuts(&mut self) -> Result<Finding, StepEnd> {
        let number = self.link.number_of(SAFETY_TABLE, NAME)?;
        let before = self.link.read(number)?;
        let values = [before, before * FACTOR];
        // With an empty store, a lost set looks like a set that never was complete.
        self.store_value(before)?;
        let cuts = self.extent.power_cuts;
        for cut in 1..=cuts {
            let boot = self.boot()?;
            self.ask_to(&format!(
                "The board stores for some seconds after Enter: cut its supply meanwhile, and switch it on again \
                 ({cut} of {cuts})"
            ))?;
            let stores = (0..STORES_MAX).find(|n| self.store_value(values[(n % 2) as usize]).is_err());
            if stores.is_none() {
                return Ok(Finding::failed("the supply was not cut"));
            }
            self.next_boot(boot)?;
            let log = self.boot_log()?;
            let value = self.link.read(number)?;
            if log.set_lost || !values.iter().any(|known| known.to_bits() == value.to_bits()) {
                return Ok(Finding::failed(format!(
                    "cut {cut}: the set is lost, {SAFETY_TABLE}.{NAME} is {value}"
                )));
            }
        }
        self.link.ask(ParameterRequest::Discard)?;
        self.store_value(before)?;
        Ok(Finding::passed(format!(
            "{cuts} cuts, the old or the new value after each"
        )))
    }
}
