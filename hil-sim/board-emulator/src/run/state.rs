//! State of a run outside the board: the vehicle and the schedule of its steps, the log, and the recordings.

use rigless::emulator::{Access, AccessKind, Host, Stop};
use rigless::session::Session;
use rigless::soc::Width;
use rigless::time::VirtualNanos;

use super::clock;
use super::settings::EmulationSettings;
use crate::board::DriveBoard;
use crate::elf::log;
use crate::error::Error;
use crate::vehicle::ClosedPlant;

/// The core's cycle counter, which the firmware reads between the stages of a tick.
const CYCLE_COUNTER: u64 = 0xE000_1004;

/// A range of memory that is read at every step of the plant.
#[derive(Debug)]
pub(super) struct Probe {
    /// Address of the first word.
    address: u64,
    /// Number of 32-bit words read at each step.
    words: u64,
    /// The words read so far.
    pub(super) samples: Vec<u32>,
}

impl Probe {
    pub(super) fn new(address: u64, words: u64) -> Self {
        Self {
            address,
            words,
            samples: Vec::new(),
        }
    }

    fn read(&mut self, host: &mut dyn Host) -> Result<(), Error> {
        for n in 0..self.words {
            self.samples.push(host.read(self.address + 4 * n, Width::W32)? as u32);
        }
        Ok(())
    }
}

/// State of a run outside the board.
pub(super) struct EmulationState {
    plant: Box<dyn ClosedPlant>,
    settings: EmulationSettings,
    rtt_block: u64,
    stepped_at: u64,
    /// Instant of the plant's next step. From this instant the steps are one interval apart: an instruction that runs
    /// past a stop does not delay the following steps.
    next_step: u64,
    /// Instant at which the firmware's clock started after the last start, in ns, once the clock runs. The steps are
    /// aligned with this instant.
    clock_start: Option<u64>,
    /// Number of restarts so far.
    resets: usize,
    next_drain: u64,
    log: Vec<u8>,
    pub(super) probe: Option<Probe>,
    /// Reads of the cycle counter, while they are recorded.
    pub(super) cycle_reads: Option<Vec<CycleRead>>,
    /// Accesses of the core to peripherals' registers.
    pub(super) accesses: u64,
    /// Stops between two instructions.
    pub(super) stops: u64,
    /// The first failure, which ends the run.
    failure: Option<Error>,
}

/// One read of the cycle counter by the core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CycleRead {
    /// Instructions retired so far.
    pub instructions: u64,
    /// Accesses to peripherals' registers so far, this one included. Between two consecutive reads in code that accesses
    /// no peripheral this count grows by one, unless an interrupt came between the reads.
    pub accesses: u64,
}

/// First bytes of the log's control block.
const LOG_IDENTITY: &[u8] = b"SEGGER RTT";

impl EmulationState {
    /// At power-up; `rtt_block` is the address of the log's control block.
    pub(super) fn new(plant: Box<dyn ClosedPlant>, settings: EmulationSettings, rtt_block: u64) -> Self {
        Self {
            plant,
            settings,
            rtt_block,
            stepped_at: 0,
            next_step: 0,
            clock_start: None,
            resets: 0,
            next_drain: 0,
            log: Vec::new(),
            probe: None,
            cycle_reads: None,
            accesses: 0,
            stops: 0,
            failure: None,
        }
    }

    pub(super) fn settings(&self) -> &EmulationSettings {
        &self.settings
    }

    /// A copy for a second run from this state on. The copy records nothing.
    pub(super) fn fork(&self) -> Self {
        Self {
            plant: self.plant.fork(),
            settings: self.settings,
            log: self.log.clone(),
            probe: None,
            cycle_reads: None,
            failure: None,
            ..*self
        }
    }

    /// Instant of the plant's next step, in ns.
    pub(super) fn next_step(&self) -> u64 {
        self.next_step
    }

    /// Instant at which the firmware's clock started after the last start, in ns, once the clock runs.
    pub(super) fn clock_start(&self) -> Option<u64> {
        self.clock_start
    }

    /// Whether the run has failed.
    pub(super) fn failed(&self) -> bool {
        self.failure.is_some()
    }

    /// The first failure of the run, if it failed.
    pub(super) fn outcome(self) -> Result<(), Error> {
        self.failure.map_or(Ok(()), Err)
    }

    /// Keeps the first failure.
    fn note(&mut self, result: Result<(), Error>) {
        if let Err(failure) = result {
            self.failure.get_or_insert(failure);
        }
    }

    /// Counts and records an access of the core to a register.
    pub(super) fn on_access(&mut self, session: &mut Session<DriveBoard>, access: &Access) {
        self.accesses += 1;
        if access.address == CYCLE_COUNTER
            && access.kind == AccessKind::Read
            && let Some(reads) = &mut self.cycle_reads
        {
            reads.push(CycleRead {
                instructions: access.instruction_count,
                accesses: self.accesses,
            });
        }
        let corrected = clock::correct_flags(session, access);
        self.note(corrected);
        if !self.settings.part.external_clock {
            let withheld = clock::withhold_external(session, access);
            self.note(withheld);
        }
    }

    /// Steps the plant and drains the log when they are due.
    pub(super) fn on_stop(&mut self, session: &mut Session<DriveBoard>, stop: Stop, host: &mut dyn Host) {
        let at = stop.at;
        if at.0 >= self.next_step {
            if !self.step_plant(session, at, host) {
                // The part stays in reset from step to step. For the board this is the same as the part's own brown-out
                // reset.
                session.reset_by_pin(at, stop.instruction_count, host);
            }
            self.schedule_step(session, at);
        }
        if at.0 >= self.next_drain {
            let drained = self.drain_log(host);
            self.note(drained);
            self.next_drain = at.0 + self.settings.log_interval;
        }
    }

    /// Drains the log into [`EmulationState::log`]. The log is empty until the firmware has initialised its RAM.
    pub(super) fn drain_log(&mut self, host: &mut dyn Host) -> Result<(), Error> {
        if self.ram_is_initialised(host)? {
            log::drain(self.rtt_block, host, &mut self.log)?;
        }
        Ok(())
    }

    /// Whether the firmware has initialised its RAM since its start. The log's control block shows it: until then the RAM
    /// test leaves its patterns everywhere.
    fn ram_is_initialised(&self, host: &mut dyn Host) -> Result<bool, Error> {
        for (at, byte) in (self.rtt_block..).zip(LOG_IDENTITY) {
            if host.read(at, Width::W8)? != u64::from(*byte) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Reads the probe's words, if a probe is set.
    fn read_probe(&mut self, host: &mut dyn Host) -> Result<(), Error> {
        if self.probe.is_some() && self.ram_is_initialised(host)? {
            self.probe.as_mut().map_or(Ok(()), |probe| probe.read(host))?;
        }
        Ok(())
    }

    /// The log drained so far, as the firmware encoded it.
    pub(super) fn log(&self) -> &[u8] {
        &self.log
    }

    /// Steps the plant from its last step to now and puts its sensors' outputs on the pins; returns whether the supply is
    /// enough for the board.
    fn step_plant(&mut self, session: &mut Session<DriveBoard>, at: VirtualNanos, host: &mut dyn Host) -> bool {
        let board = session.board_mut();
        let bridges = board.bridges(at);
        let seconds = (at.0 - self.stepped_at) as f64 * 1e-9;
        self.plant.configure_imus(board.intf_config1());
        let sensed = self.plant.step(seconds, &bridges);
        board.sense(at, &sensed);
        self.stepped_at = at.0;
        let read = self.read_probe(host);
        self.note(read);
        !sensed.unpowered
    }

    /// Schedules the next step: one interval later or, once after each start, just before a tick of the firmware.
    fn schedule_step(&mut self, session: &mut Session<DriveBoard>, at: VirtualNanos) {
        let interval = self.settings.plant_interval;
        // An instruction may have run past the instant at which the step was due.
        let due = self.next_step;
        self.next_step = due + ((at.0 - due) / interval + 1) * interval;
        if session.resets().len() != self.resets {
            self.resets = session.resets().len();
            self.clock_start = None;
        }
        if self.clock_start.is_none() {
            match clock::started_at(session, at) {
                Ok(Some(started)) => {
                    self.clock_start = Some(started);
                    self.next_step = clock::just_before_tick(at.0, started);
                }
                Ok(None) => {}
                Err(failure) => self.note(Err(failure)),
            }
        }
    }
}
