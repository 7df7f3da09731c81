//! The served board, and its clients.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use report::error::CommandError;
use report::output::print;
use virtual_board::scenario::run::happen;
use virtual_board::scenario::{Backend, Observation, Scenario};

use super::hub::{ClientId, Hub};
use super::pace::Pace;
use super::ports::{ClientOutput, HAPPENED_MAX, PortEvent};

/// Longest wait for a client's bytes before the board continues.
const TURN_PATIENCE: Duration = Duration::from_millis(1);
/// Time between two reads of the board's log, ms of the board's time.
const LOG_LOOK_MS: u64 = 20;

/// The board and its clients.
pub struct Server<B, C> {
    backend: B,
    /// Reports why the board's time has stopped.
    check: C,
    scenario: Scenario,
    next_step: usize,
    hub: Hub,
    outputs: BTreeMap<ClientId, (String, ClientOutput)>,
    /// Whether the board has not booted yet and waits for the first client.
    off: bool,
    /// Time since the log was last read, ms of the board's time.
    log_age_ms: u64,
}

impl<B: Backend, C: FnMut(&mut B) -> Result<(), CommandError>> Server<B, C> {
    /// A board in a scenario's simulated world, with the scenario's steps; `off` until the first client
    /// connects.
    pub fn new(backend: B, scenario: Scenario, check: C, off: bool) -> Self {
        Self {
            backend,
            check,
            scenario,
            next_step: 0,
            hub: Hub::default(),
            outputs: BTreeMap::new(),
            off,
            log_age_ms: 0,
        }
    }

    /// Serves until `ended`, and prints the board's log to its last line, whatever ends the board.
    ///
    /// # Errors
    /// The board cannot continue, the vehicle has left the range of the plant's equations, every port
    /// is closed, or the output is closed.
    pub fn serve(&mut self, events: &Receiver<PortEvent>, pace: Pace, ended: &AtomicBool) -> Result<(), CommandError> {
        let served = self.serve_on(events, pace, ended);
        let printed = self.print_log();
        served.and(printed)
    }

    fn serve_on(
        &mut self,
        events: &Receiver<PortEvent>,
        mut pace: Pace,
        ended: &AtomicBool,
    ) -> Result<(), CommandError> {
        let begun = Instant::now();
        if self.scenario.chocked_until_armed {
            // The server has no operator who could pull the chocks.
            print("the scenario's chocks are not put in place\n")?;
        }
        while !ended.load(Ordering::Relaxed) {
            let patience = if pace.is_due() { Duration::ZERO } else { TURN_PATIENCE };
            match events.recv_timeout(patience) {
                Ok(event) => self.take(event)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(CommandError::Other("every port is closed".into()));
                }
            }
            // At most as many events per turn as the queue holds, so that the board's time advances
            // however much a client sends.
            for event in events.try_iter().take(HAPPENED_MAX) {
                self.take(event)?;
            }
            let now_us = begun.elapsed().as_micros() as u64;
            if self.off {
                pace.rest(now_us);
                continue;
            }
            let go_ms = pace.go(now_us);
            if go_ms > 0 {
                self.advance(go_ms)?;
                pace.ran(go_ms, begun.elapsed().as_micros() as u64 - now_us);
            }
            if let Some(word) = pace.word(begun.elapsed().as_micros() as u64) {
                print(&format!("{word}\n"))?;
            }
        }
        Ok(())
    }

    /// Runs the board for some milliseconds, and sends the board's output to the clients.
    fn advance(&mut self, ms: u64) -> Result<(), CommandError> {
        let start_us = self.backend.now_us();
        let (mut said, mut instants) = (Vec::new(), Vec::new());
        let mut hear = |observation: &mut Observation| said.append(&mut observation.received);
        for instant_us in (1..=ms).map(|ms| start_us + ms * 1000) {
            while let Some(step) = self.scenario.steps.get(self.next_step)
                && step.at_s * 1e6 < instant_us as f64
            {
                self.backend.run_through(&std::mem::take(&mut instants), &mut hear);
                self.next_step += 1;
                happen(&step.action, &mut self.backend);
            }
            instants.push(instant_us);
        }
        self.backend.run_through(&instants, &mut hear);
        if self.backend.now_us() < start_us + ms * 1000 {
            (self.check)(&mut self.backend)?;
            return Err(CommandError::Other("the board's time stands still".into()));
        }
        if !said.is_empty() {
            self.outputs.retain(|_, (_, output)| output.send(&said));
        }
        self.log_age_ms += ms;
        if self.log_age_ms >= LOG_LOOK_MS {
            self.print_log()?;
        }
        let mut validity = Ok(());
        self.backend.plant(&mut |plant| validity = plant.validity());
        validity.map_err(|invalid| CommandError::Checks(invalid.to_string()))
    }

    fn print_log(&mut self) -> Result<(), CommandError> {
        self.log_age_ms = 0;
        let mut lines = self.backend.log().into_iter();
        lines.try_for_each(|line| print(&format!("{line}\n")))
    }

    fn take(&mut self, event: PortEvent) -> Result<(), CommandError> {
        match event {
            PortEvent::Came(client, name, output) => {
                print(&format!("{name}: came\n"))?;
                self.off = false;
                self.outputs.insert(client, (name, output));
            }
            PortEvent::Said(client, bytes) => {
                let outcome = self.hub.take(client, &bytes);
                self.backend.send(&outcome.to_board);
                if let Some((name, output)) = self.outputs.get(&client) {
                    if !outcome.to_client.is_empty() {
                        output.send(&outcome.to_client);
                    }
                    if outcome.became_operator {
                        print(&format!("{name}: drives\n"))?;
                    }
                }
            }
            PortEvent::Left(client) => {
                let drove = self.hub.leave(client);
                if let Some((name, _)) = self.outputs.remove(&client) {
                    let and = if drove { ", and has driven" } else { "" };
                    print(&format!("{name}: left{and}\n"))?;
                }
            }
        }
        Ok(())
    }
}
