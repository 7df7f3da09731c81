//! The emulator's side of a run: steps the plant, drains the log, and does what it is told where the run
//! stands.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender};

use rigless::emulator::{self, AccessKind, Driver, Host, Settled, Stop};
use rigless::mcu::Operate;
use rigless::session::Session;
use rigless::snapshot;
use rigless::soc::Width;
use rigless::time::VirtualNanos;

use crate::board::DriveBoard;
use crate::gaps::{self, Gap};
use crate::plant::{BridgeState, ClosedPlant, MOTORS};
use crate::{Error, MS, Settings, rtt};

/// TIM5, the clock of the firmware's tasks: status and event generation registers.
const TASK_CLOCK_STATUS: u64 = 0x4000_0C10;
const TASK_CLOCK_EVENTS: u64 = 0x4000_0C14;
/// Its four compare flags.
const COMPARE_FLAGS: u64 = 0x1E;

/// Its counter.
const TASK_CLOCK_COUNT: u64 = 0x4000_0C24;
/// Counts of it before it wraps, in us.
const TASK_CLOCK_RANGE_US: u64 = 1 << 16;
/// Virtual time after a start by which the firmware's clock surely runs.
const CLOCK_RUNS_AFTER: u64 = 20 * MS;
/// How long before the firmware's tick the plant is stepped, so that the tick senses what just was, and
/// the plant moved with the bridges as the tick before had left them.
const STEP_BEFORE_TICK: u64 = 20_000;

/// The core's cycle counter, which the firmware reads between the stages of a tick.
const CYCLE_COUNTER: u64 = 0xE000_1004;

/// A watched instruction the core arrived at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hit {
    /// The instruction.
    pub address: u64,
    /// Instructions retired before it.
    pub instructions: u64,
    /// Virtual time in ns.
    pub at: u64,
}

/// What the emulator has had to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    /// Instructions retired.
    pub instructions: u64,
    /// Accesses of the core to peripherals' registers.
    pub accesses: u64,
    /// Stops between two instructions, for an event of a model or of the plant.
    pub stops: u64,
}

/// Memory read at every step of the plant: the firmware's flight record.
#[derive(Debug, Clone, Default)]
pub struct Probe {
    address: u64,
    words: u64,
    /// What was read, `words` 32-bit words a step.
    pub samples: Vec<u32>,
}

/// What the run keeps beside the board.
pub(crate) struct State {
    plant: Box<dyn ClosedPlant>,
    settings: Settings,
    rtt_block: u64,
    stepped_at: u64,
    /// The steps are laid from here an interval apart, so that an instruction that runs past a stop does not
    /// shift those after it.
    next_step: u64,
    /// When to look at the firmware's clock and lay the steps by it: once after each start.
    align_at: Option<u64>,
    resets: usize,
    next_drain: u64,
    log: Vec<u8>,
    bridges: [BridgeState; MOTORS],
    hits: Vec<Hit>,
    probe: Option<Probe>,
    /// Instructions retired at each read of the cycle counter, while they are kept.
    cycle_reads: Option<Vec<u64>>,
    accesses: u64,
    stops: u64,
    failure: Option<Error>,
}

impl State {
    pub(crate) fn new(plant: Box<dyn ClosedPlant>, settings: Settings, rtt_block: u64) -> Self {
        Self {
            plant,
            settings,
            rtt_block,
            stepped_at: 0,
            next_step: 0,
            align_at: Some(CLOCK_RUNS_AFTER),
            resets: 0,
            next_drain: 0,
            log: Vec::new(),
            bridges: [BridgeState::Open; MOTORS],
            hits: Vec::new(),
            probe: None,
            cycle_reads: None,
            accesses: 0,
            stops: 0,
            failure: None,
        }
    }

    pub(crate) fn settings(&self) -> &Settings {
        &self.settings
    }

    pub(crate) fn fork(&self) -> Self {
        Self {
            plant: self.plant.fork(),
            settings: self.settings,
            log: self.log.clone(),
            bridges: self.bridges,
            hits: Vec::new(),
            probe: None,
            cycle_reads: None,
            failure: None,
            ..*self
        }
    }

    /// The next step an interval after the one due now; once after a start, by the firmware's clock.
    fn lay_next_step(&mut self, at: VirtualNanos, session: &mut Session<DriveBoard>) {
        let interval = self.settings.plant_interval;
        // An instruction may have run past the instant the step was due at.
        let due = self.next_step;
        self.next_step = due + ((at.0 - due) / interval + 1) * interval;
        if session.resets().len() != self.resets {
            self.resets = session.resets().len();
            self.align_at = Some(at.0 + CLOCK_RUNS_AFTER);
        }
        if self.align_at.is_some_and(|align_at| at.0 >= align_at) {
            self.align_at = None;
            match session.mcu().read(at, TASK_CLOCK_COUNT, Width::W32) {
                Ok(count) => self.next_step = just_before_tick(at.0, count & 0xFFFF, started_at(session)),
                Err(fault) => self.failure = Some(Error::Core(format!("{fault:?}"))),
            }
        }
    }

    fn step_plant(&mut self, now: u64, session: &mut Session<DriveBoard>, host: &mut dyn Host) {
        let board = session.board_mut();
        self.bridges = board.bridges(VirtualNanos(now));
        let seconds = (now - self.stepped_at) as f64 * 1e-9;
        let sensed = self.plant.step(seconds, &self.bridges);
        board.sense(VirtualNanos(now), &sensed);
        self.stepped_at = now;
        if let Some(probe) = &mut self.probe {
            for n in 0..probe.words {
                match host.read(probe.address + 4 * n, Width::W32) {
                    Ok(word) => probe.samples.push(word as u32),
                    Err(error) => self.failure = Some(error.into()),
                }
            }
        }
    }
}

/// When the part last started.
fn started_at(session: &Session<DriveBoard>) -> u64 {
    session.resets().last().map_or(0, |reset| reset.at.0)
}

/// The first instant after `now` that lies just before a tick of a firmware that started at `started`
/// and whose clock's low 16 bits read `count_us`: the clock is the time since the start, less what the
/// start-up code took before it set the clock going (less than half the count's range).
fn just_before_tick(now: u64, count_us: u64, started: u64) -> u64 {
    let elapsed_us = (now - started) / 1000;
    let lag_us = (elapsed_us - count_us % TASK_CLOCK_RANGE_US) % TASK_CLOCK_RANGE_US;
    let first_tick = started + lag_us * 1000;
    let before = first_tick + MS - STEP_BEFORE_TICK;
    before + now.saturating_sub(before).div_ceil(MS) * MS
}

/// The board where the run stands, between two instructions.
pub struct Stopped<'a> {
    session: &'a mut Session<DriveBoard>,
    host: &'a mut dyn Host,
    state: &'a mut State,
    stop: Stop,
    digest: &'a [u8; 32],
}

impl Stopped<'_> {
    /// The board.
    pub fn board(&mut self) -> &mut DriveBoard {
        self.session.board_mut()
    }

    /// Virtual time in ns.
    pub fn now(&self) -> u64 {
        self.stop.at.0
    }

    /// Instructions retired so far.
    pub fn instructions(&self) -> u64 {
        self.stop.instruction_count
    }

    /// What the emulator has done so far.
    pub fn work(&self) -> Work {
        Work {
            instructions: self.stop.instruction_count,
            accesses: self.state.accesses,
            stops: self.state.stops,
        }
    }

    /// When the part last started, in ns.
    pub fn started_at(&self) -> u64 {
        started_at(self.session)
    }

    /// Restarts so far: when, and whose.
    pub fn resets(&self) -> Vec<(u64, String)> {
        let resets = self.session.resets().iter();
        resets.map(|reset| (reset.at.0, format!("{:?}", reset.cause))).collect()
    }

    /// Reads memory.
    ///
    /// # Errors
    /// Outside the part's memory.
    pub fn read(&mut self, address: u64, length: usize) -> Result<Vec<u8>, Error> {
        (address..)
            .take(length)
            .map(|at| Ok(self.host.read(at, Width::W8)? as u8))
            .collect()
    }

    /// Reads a stretch of memory by words; `length` is a multiple of four.
    ///
    /// # Errors
    /// Outside the part's memory.
    pub fn read_block(&mut self, address: u64, length: usize) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::with_capacity(length);
        for at in (address..).step_by(4).take(length / 4) {
            bytes.extend((self.host.read(at, Width::W32)? as u32).to_le_bytes());
        }
        Ok(bytes)
    }

    /// Reads a word of memory.
    ///
    /// # Errors
    /// Outside the part's memory.
    pub fn read_word(&mut self, address: u64) -> Result<u32, Error> {
        Ok(self.host.read(address, Width::W32)? as u32)
    }

    /// Writes RAM, or changes flash as a programmer would.
    ///
    /// # Errors
    /// Outside the part's memory.
    pub fn write(&mut self, address: u64, bytes: &[u8]) -> Result<(), Error> {
        for (at, byte) in (address..).zip(bytes) {
            let byte = u64::from(*byte);
            if self.host.write(at, Width::W8, byte).is_err() {
                self.host.program(at, Width::W8, byte)?;
            }
        }
        Ok(())
    }

    /// Reads a register of a peripheral as the core would.
    ///
    /// # Errors
    /// Where the bus answers no read.
    pub fn register(&mut self, address: u64) -> Result<u32, Error> {
        let at = self.stop.at;
        let word = self.session.mcu().read(at, address, Width::W32);
        word.map(|word| word as u32)
            .map_err(|fault| Error::Core(format!("{fault:?}")))
    }

    /// Bridges as the plant last saw them.
    pub fn bridges(&mut self) -> [BridgeState; MOTORS] {
        self.session.board_mut().bridges(self.stop.at)
    }

    /// Takes what came up the host link since the last arrival.
    pub(crate) fn receive(&mut self) -> Vec<u8> {
        self.board().wire().take()
    }

    /// Records every arrival at an instruction from now on.
    pub fn watch(&mut self, address: u64) {
        self.session.watch(emulator::Watch::Instruction(address));
    }

    /// Takes the recorded arrivals.
    pub fn take_hits(&mut self) -> Vec<Hit> {
        std::mem::take(&mut self.state.hits)
    }

    /// Reads `words` 32-bit words from `address` at every step of the plant from now on.
    pub fn probe(&mut self, address: u64, words: u64) {
        self.state.probe = Some(Probe {
            address,
            words,
            samples: Vec::new(),
        });
    }

    /// Keeps the instructions retired at each read of the cycle counter from now on.
    pub fn keep_cycle_reads(&mut self) {
        self.state.cycle_reads = Some(Vec::new());
    }

    /// Takes the kept counts, and keeps no more.
    pub fn take_cycle_reads(&mut self) -> Vec<u64> {
        self.state.cycle_reads.take().unwrap_or_default()
    }

    /// Takes what the probe read.
    pub fn take_probe(&mut self) -> Vec<u32> {
        self.state
            .probe
            .as_mut()
            .map(|probe| std::mem::take(&mut probe.samples))
            .unwrap_or_default()
    }

    /// The log so far, as it came through the probe.
    ///
    /// # Errors
    /// When its buffer is outside the part's memory.
    pub fn log_bytes(&mut self) -> Result<Vec<u8>, Error> {
        rtt::drain(self.state.rtt_block, self.host, &mut self.state.log)?;
        Ok(self.state.log.clone())
    }

    /// Everything the emulated part could not stand in for.
    pub fn gaps(&self) -> Vec<Gap> {
        gaps::of(self.session)
    }

    /// Takes a snapshot of the run.
    pub(crate) fn freeze(&mut self) -> Result<(snapshot::Taken, State), Error> {
        let taken = snapshot::take(self.session, self.host, self.stop, self.digest, &Nothing {})?;
        Ok((taken, self.state.fork()))
    }

    /// Pulls the reset pin.
    pub fn reset_by_pin(&mut self) {
        let (at, instructions) = (self.stop.at, self.stop.instruction_count);
        self.session.reset_by_pin(at, instructions, self.host);
    }
}

/// Something to do where the run stands.
pub(crate) type Task = Box<dyn FnOnce(&mut Stopped<'_>) + Send>;

/// Something to do at each instant that a run passes through.
pub(crate) type Watch = Box<dyn FnMut(&mut Stopped<'_>) + Send>;

/// What the caller may ask of a run that stands still.
pub(crate) enum Order {
    Do(Task),
    /// Bytes down the host link.
    Send(Vec<u8>),
    /// On through instants in ns and in order, doing something at each.
    Run(VecDeque<u64>, Watch),
    End,
}

/// What the caller hears when the run has come as far as it asked.
#[derive(Debug, Default)]
pub(crate) struct Arrival {
    /// Virtual time in ns.
    pub(crate) now: u64,
    /// What came up the host link since the last arrival.
    pub(crate) received: Vec<u8>,
}

/// The emulator's side of the run.
pub(crate) struct Conductor {
    state: State,
    orders: Receiver<Order>,
    arrivals: Sender<Arrival>,
    /// Instants still to run through, and what to do at each.
    instants: VecDeque<u64>,
    watch: Watch,
    digest: [u8; 32],
}

impl Conductor {
    pub(crate) fn new(state: State, orders: Receiver<Order>, arrivals: Sender<Arrival>, digest: [u8; 32]) -> Self {
        Self {
            state,
            orders,
            arrivals,
            instants: VecDeque::new(),
            watch: Box::new(|_| {}),
            digest,
        }
    }

    /// How the run went.
    pub(crate) fn finish(self) -> Result<(), Error> {
        match self.state.failure {
            Some(failure) => Err(failure),
            None => Ok(()),
        }
    }
}

impl Driver<DriveBoard> for Conductor {
    fn on_settled(&mut self, session: &mut Session<DriveBoard>, _: &mut dyn Host, settled: Settled) {
        match settled {
            Settled::Access { .. } => self.state.accesses += 1,
            Settled::Stop(_) => self.state.stops += 1,
            _ => {}
        }
        match settled {
            // A software update event of a timer sets its compare flags in this model while the compare
            // registers are zero. The part does not, and the firmware's clock would take the flag for half
            // a period gone by. Taken back here.
            Settled::Access { access, .. }
                if access.address == TASK_CLOCK_EVENTS && access.kind == AccessKind::Write =>
            {
                let kept = u64::from(u32::MAX) & !COMPARE_FLAGS;
                let at = access.virtual_time;
                if let Err(fault) = session.mcu().write(at, TASK_CLOCK_STATUS, Width::W32, kept) {
                    self.state.failure = Some(Error::Core(format!("{fault:?}")));
                }
            }
            Settled::Access { access, .. } if access.address == CYCLE_COUNTER && access.kind == AccessKind::Read => {
                if let Some(reads) = &mut self.state.cycle_reads {
                    reads.push(access.instruction_count);
                }
            }
            Settled::Hit(hit) => self.state.hits.push(Hit {
                address: hit.address,
                instructions: hit.instruction_count,
                at: hit.at.0,
            }),
            _ => {}
        }
    }

    fn on_stop(&mut self, session: &mut Session<DriveBoard>, stop: Stop, host: &mut dyn Host) -> Option<VirtualNanos> {
        let now = stop.at.0;
        if now >= self.state.next_step {
            self.state.step_plant(now, session, host);
            self.state.lay_next_step(stop.at, session);
        }
        if now >= self.state.next_drain {
            if let Err(error) = rtt::drain(self.state.rtt_block, host, &mut self.state.log) {
                self.state.failure = Some(error.into());
            }
            self.state.next_drain = now + self.state.settings.log_interval;
        }
        loop {
            match self.instants.front() {
                Some(&instant) if now < instant => return Some(VirtualNanos(instant.min(self.state.next_step))),
                Some(_) => {
                    self.instants.pop_front();
                    (self.watch)(&mut Stopped {
                        session,
                        host,
                        state: &mut self.state,
                        stop,
                        digest: &self.digest,
                    });
                    continue;
                }
                None => {}
            }
            let received = session.board_mut().wire().take();
            self.arrivals.send(Arrival { now, received }).ok()?;
            loop {
                // A caller that is gone ends the run as one that says so.
                match self.orders.recv().unwrap_or(Order::End) {
                    Order::Do(task) => task(&mut Stopped {
                        session,
                        host,
                        state: &mut self.state,
                        stop,
                        digest: &self.digest,
                    }),
                    Order::Send(bytes) => session.board_mut().wire().send(&bytes),
                    Order::Run(instants, watch) => {
                        self.instants = instants;
                        self.watch = watch;
                        // Nowhere to go is arrived.
                        break;
                    }
                    Order::End => return None,
                }
            }
        }
    }
}

/// What a snapshot keeps of this side of the run: nothing, [`Frozen`] does.
pub(crate) struct Nothing {}
rigless::store!(Nothing {
    values: [],
    parts: [],
    built: []
});
