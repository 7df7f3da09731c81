//! The procedure: step after step, with the questions to the person and the reads from the board that the steps share.

use std::io::Write;

use firmware::flight_record::FlightRecord;
use firmware::protocol::message::{Identity, Order};
use firmware::records::codec::Records;
use report::error::CommandError;
use report::visible::visible_line;
use virtual_board::link_client::LinkClient;

use super::person::{Person, Reply};
use super::step::{BringUpStep, StepKind};
use super::steps::STEPS;
use super::verdict::{BringUpReport, Finding, StepLine, StepVerdict};
use crate::cli::link::console::Console;
use crate::cli::link::session::Link;
use crate::cli::link::update::Update;
use crate::cli::link::who;
use crate::cli::link::wire::Wire;

/// Number of times that the tool looks for a switched-off board before it gives up: some minutes.
const BOOT_LOOKS: u32 = 3000;
/// Time between two attempts to open a lost port.
const PORT_PAUSE: std::time::Duration = std::time::Duration::from_millis(50);
/// Duration of a look at the board's records, us.
const LOOK_US: u64 = 300_000;
/// Longest wait for the end of a look, us. The board keeps 2 s of ticks, whose 100 KiB take 1.1 s on the link while
/// more ticks arrive.
const CATCH_UP_US: u64 = 5_000_000;

/// Inputs of the procedure.
#[derive(Debug, Clone)]
pub struct BringUpExtent {
    /// Whether the board is simulated: the steps that only a bench shows then block no other step.
    pub simulated: bool,
    /// Whether somebody stands at a bench. Without one the tool skips the steps that only a bench can show.
    pub at_a_bench: bool,
    /// Number of starts of the supply.
    pub cold_starts: u32,
    /// Number of supply cuts while the board stores.
    pub power_cuts: u32,
    /// The firmware to send over the link.
    pub firmware: Option<Update>,
}

/// The procedure in progress.
pub struct Procedure<'a, W, P, O: Write> {
    /// The conversation with the board.
    pub(super) link: Link<W>,
    /// Opens the port again after it was lost.
    reopen: &'a mut dyn FnMut() -> Result<Link<W>, CommandError>,
    person: P,
    pub(super) console: &'a mut Console<O>,
    /// Inputs of the procedure.
    pub(super) extent: BringUpExtent,
}

impl<'a, W: Wire, P: Person, O: Write> Procedure<'a, W, P, O> {
    /// A new procedure over the port that `reopen` opens.
    ///
    /// # Errors
    /// The port does not open.
    pub fn new(
        reopen: &'a mut dyn FnMut() -> Result<Link<W>, CommandError>,
        person: P,
        console: &'a mut Console<O>,
        extent: BringUpExtent,
    ) -> Result<Self, CommandError> {
        Ok(Self {
            link: reopen()?,
            reopen,
            person,
            console,
            extent,
        })
    }

    /// Carries out the steps up to the first failed step. The tool asks for the bridges' supply, and arms the vehicle,
    /// only after every earlier step has passed. For a simulated board, only the steps that it can show must have
    /// passed.
    ///
    /// # Errors
    /// The output is closed, nobody answers, or the user asks to stop. The tool then disarms the vehicle. The board's
    /// behaviour is never an error but a finding.
    pub fn run(mut self) -> Result<BringUpReport, CommandError> {
        let mut report = BringUpReport {
            board: "unknown".into(),
            simulated: self.extent.simulated,
            steps: Vec::new(),
        };
        let result = self.steps(&mut report);
        self.stop_records();
        // The tool disarms whatever happened, and whichever board answers.
        let disarmed = self.link.disarm();
        result?;
        if report
            .steps
            .iter()
            .any(|line| line.finding.verdict == StepVerdict::Passed)
        {
            disarmed?;
        }
        Ok(report)
    }

    fn steps(&mut self, report: &mut BringUpReport) -> Result<(), CommandError> {
        for (number, step) in (1..).zip(STEPS) {
            let finding = match self.obstacle(step, &report.steps) {
                Some(why) => Finding::not_shown(why),
                None => self.step(number, step)?,
            };
            if let Some(identity) = self.link.client.identity() {
                report.board = who(identity);
            }
            self.console.coloured_line(&format!(
                "   {}: {}",
                finding.verdict.coloured(),
                visible_line(&finding.seen)
            ))?;
            if finding.verdict == StepVerdict::Failed {
                self.console.line(&format!("   look at: {}", step.look_at))?;
            }
            report.steps.push(StepLine {
                number,
                title: step.title,
                finding,
            });
        }
        Ok(())
    }

    /// Why a step cannot follow the earlier steps.
    fn obstacle(&self, step: &BringUpStep, before: &[StepLine]) -> Option<&'static str> {
        if before.iter().any(|line| line.finding.verdict == StepVerdict::Failed) {
            return Some("not tried: a step before it failed");
        }
        if step.bench_only && !self.extent.at_a_bench {
            return Some("a simulated board cannot show it");
        }
        let missing = |(line, step): (&StepLine, &BringUpStep)| {
            !(line.finding.is_settled() || self.extent.simulated && step.bench_only)
        };
        if step.powered && before.iter().zip(STEPS).any(missing) {
            return Some("not tried: every step before it must have passed");
        }
        None
    }

    fn step(&mut self, number: usize, step: &BringUpStep) -> Result<Finding, CommandError> {
        self.console.line(&format!(
            "{number:>2} {}: {} Passes: {}.",
            step.title, step.does, step.passes
        ))?;
        let result = self.carried_out(step);
        self.check_interrupt()?;
        match result {
            // The board's behaviour is the step's finding.
            Err(StepEnd::Board(CommandError::Checks(why))) => Ok(Finding::failed(why)),
            Err(StepEnd::Board(error) | StepEnd::Tool(error)) => Err(error),
            Err(StepEnd::Found(finding)) | Ok(finding) => Ok(finding),
        }
    }

    fn carried_out(&mut self, step: &BringUpStep) -> Result<Finding, StepEnd> {
        if step.of_spar && !self.link.has_spar()? {
            return Ok(Finding::not_needed("the vehicle has no spar"));
        }
        match step.kind {
            StepKind::Look(question) => self.look(question),
            StepKind::Measure(question, min, max) => self.measure(question, min, max),
            StepKind::Identity => self.identity(),
            StepKind::Clock => self.clock(),
            StepKind::ColdStarts => self.cold_starts(),
            StepKind::ResetButton => self.reset_button(),
            StepKind::Contacts => self.contacts(),
            StepKind::SupplyOff => self.supply_off(),
            StepKind::CurrentZeros => self.current_zeros(),
            StepKind::CurrentGain => self.current_gain(),
            StepKind::AtRest(place) => self.at_rest(place),
            StepKind::TiltedForward(place) => self.tilted_forward(place),
            StepKind::Wheels => self.wheels(),
            StepKind::BallastByHand => self.ballast_by_hand(),
            StepKind::Store => self.store(),
            StepKind::PowerCuts => self.power_cuts(),
            StepKind::NoExternalClock => self.no_external_clock(),
            StepKind::Update => self.update(),
            StepKind::SupplyOn => self.supply_on(),
            StepKind::Armed => self.armed(),
            StepKind::Levelling => self.levelling(),
            StepKind::ArmedLook(look) => self.armed_look(&look),
            StepKind::StopArmed => self.stop_armed(),
            StepKind::ButtonArmed => self.button_armed(),
            StepKind::Forward => self.forward(),
            StepKind::Turn => self.turn(),
            StepKind::TickCost => self.tick_cost(),
        }
    }

    fn check_interrupt(&self) -> Result<(), CommandError> {
        if self.link.interrupts() == 0 {
            return Ok(());
        }
        Err(CommandError::Checks(
            "interrupted: the procedure is not complete".into(),
        ))
    }

    /// Asks the person and waits for an answer; `each` sees every tick of the board meanwhile.
    ///
    /// # Errors
    /// Nobody answers, or the user asks to stop. [`StepEnd::Found`]: the person skips the step.
    pub(super) fn ask_watching(
        &mut self,
        question: &str,
        mut each: impl FnMut(&FlightRecord),
    ) -> Result<Reply, StepEnd> {
        self.console
            .line(&format!(" > {question} [Enter or y, n, s to skip, or a number]"))?;
        // A board that has restarted, or whose port is lost, sends none. The step's next look at the board shows that.
        let _ = self.start_records();
        let reply = loop {
            if self.check_interrupt().is_err() {
                return Err(StepEnd::Tool(CommandError::Checks("interrupted: disarmed".into())));
            }
            // A board without power is silent.
            let _ = self.link.listen();
            self.drain(&mut each);
            if let Some(line) = self.person.reply(question).map_err(StepEnd::Tool)? {
                match Reply::read(&line) {
                    Some(reply) => break reply,
                    None => self.console.line(" > an answer is Enter, y, n, s or a number")?,
                }
            }
        };
        self.stop_records();
        if reply == Reply::Skip {
            return Err(StepEnd::Found(Finding::not_shown("left out")));
        }
        Ok(reply)
    }

    /// Asks the person to do something; done, or not possible.
    ///
    /// # Errors
    /// As [`Self::ask_watching`]; [`StepEnd::Found`] as well if the person says no.
    pub(super) fn ask_to(&mut self, what: &str) -> Result<(), StepEnd> {
        match self.ask_watching(what, |_| {})? {
            Reply::Yes => Ok(()),
            _ => Err(StepEnd::Found(Finding::failed(format!("not done: {what}")))),
        }
    }

    /// Asks for a measured value.
    ///
    /// # Errors
    /// As [`Self::ask_to`].
    pub(super) fn ask_number(&mut self, question: &str) -> Result<f64, StepEnd> {
        loop {
            if let Reply::Number(number) = self.ask_watching(question, |_| {})? {
                return Ok(number);
            }
        }
    }

    /// Asks the person what they see.
    pub(super) fn look(&mut self, question: &str) -> Result<Finding, StepEnd> {
        Ok(match self.ask_watching(question, |_| {})? {
            Reply::Yes => Finding::passed("seen"),
            _ => Finding::failed("not seen"),
        })
    }

    fn measure(&mut self, question: &str, min: f64, max: f64) -> Result<Finding, StepEnd> {
        let value = self.ask_number(question)?;
        Ok(Finding::of((min..=max).contains(&value), format!("{value}")))
    }

    /// Tells the person something.
    ///
    /// # Errors
    /// The output is closed.
    pub(super) fn tell(&mut self, text: &str) -> Result<(), StepEnd> {
        text.lines()
            .try_for_each(|line| self.console.line(line))
            .map_err(StepEnd::Tool)
    }

    /// The ticks of the next short time.
    ///
    /// # Errors
    /// The board is silent, or sends no records.
    pub(super) fn ticks(&mut self) -> Result<Vec<FlightRecord>, StepEnd> {
        let since_us = self.link.fresh_status()?.vehicle.time_us;
        self.start_records()?;
        let from_us = self.link.wire.now_us();
        let mut ticks = Vec::new();
        let mut newest_us = 0;
        // The board first sends its stored ticks of the last seconds.
        while newest_us < since_us + LOOK_US && self.link.wire.now_us() - from_us < CATCH_UP_US {
            self.link.listen()?;
            self.drain(|tick| {
                newest_us = tick.sample.time_us;
                ticks.push(*tick);
            });
        }
        self.stop_records();
        ticks.retain(|tick| tick.sample.time_us > since_us);
        if ticks.is_empty() {
            return Err(StepEnd::Found(Finding::failed(
                "the board sends no records of its ticks",
            )));
        }
        Ok(ticks)
    }

    pub(super) fn start_records(&mut self) -> Result<(), StepEnd> {
        self.link.client.records.clear();
        if self.link.client.identity().is_some() {
            self.link.give(Order::Recording { from: Some(0) })?;
        }
        Ok(())
    }

    pub(super) fn stop_records(&mut self) {
        // A board without power sends no stream.
        let _ = self.link.give(Order::Recording { from: None });
    }

    fn drain(&mut self, each: impl FnMut(&FlightRecord)) {
        each_tick(&mut self.link.client, each);
    }

    /// Waits until the board has booted again after the boot number `boot`.
    ///
    /// # Errors
    /// The board does not come back, or the user asks to stop.
    pub(super) fn next_boot(&mut self, boot: u32) -> Result<Identity, StepEnd> {
        for _ in 0..BOOT_LOOKS {
            self.check_interrupt().map_err(StepEnd::Tool)?;
            match self.link.other_boot(boot) {
                Ok(Some(identity)) => return Ok(identity),
                Ok(None) => {}
                // A port that is powered through the board's cable disappears with the board.
                Err(_) => match (self.reopen)() {
                    Ok(link) => self.link = link,
                    Err(_) => std::thread::sleep(PORT_PAUSE),
                },
            }
        }
        Err(StepEnd::Found(Finding::failed("the board did not start again")))
    }
}

/// Takes the ticks whose records have arrived.
pub(super) fn each_tick(client: &mut LinkClient, mut each: impl FnMut(&FlightRecord)) {
    while let Some(block) = client.records.pop_front() {
        Records::new(&block.bytes).flatten().for_each(|tick| each(&tick));
    }
}

/// What ends a step early.
pub enum StepEnd {
    /// The step has a verdict.
    Found(Finding),
    /// The board did not behave as required.
    Board(CommandError),
    /// The output is closed, nobody answers, or the user asks to stop.
    Tool(CommandError),
}

impl From<CommandError> for StepEnd {
    fn from(error: CommandError) -> Self {
        match error {
            CommandError::Checks(_) => Self::Board(error),
            // A closed output, a bad port.
            CommandError::Input(_) | CommandError::Other(_) => Self::Tool(error),
        }
    }
}
