//! Runs a scenario on a back end.

use firmware::protocol::message::{COMMAND_PERIOD_MS, Order};
use model::command::{DriveCommand, Request};
use model::supervise::arming::Mode;

use super::backend::{Backend, Observation};
use super::file::Scenario;
use super::glances::Glances;
use super::outcome::{Counts, DriveOutcome, RunEnd};
use super::step::{Action, Step};
use super::trace::{Trace, TraceRow};
use super::wire::{FaultyWire, LinkStep, WireDirection, WireFault};
use crate::link_client::LinkClient;
use plant::Invalid;
use plant::noise::Noise;
use thiserror::Error;

/// Stream of the scenario's seed for noise on the link.
const LINK_NOISE_STREAM: u64 = 6;
/// Streams for the faults of the way to the board and of the way back.
const WIRE_STREAMS: [u64; 2] = [7, 8];

/// Why a run could not go on.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum RunError {
    /// The simulated vehicle left the range in which the plant's equations hold.
    #[error(transparent)]
    Plant(#[from] Invalid),
}

/// The operator and the world's events.
struct Script<'a> {
    scenario: &'a Scenario,
    next: usize,
    /// Speed and yaw rate; `None` while silent.
    command: Option<[f64; 2]>,
    noise: Noise,
    pressed_at_ms: Option<u64>,
    to_board: FaultyWire,
    /// What the way back does, once a step has said so.
    to_host: Option<WireFault>,
    /// The operator's program hangs: it repeats its last frame.
    stuck: bool,
    /// The last drive command sent, as a frame.
    last_drive: Vec<u8>,
}

/// Runs `scenario` and keeps its rows; `progress` is called with the milliseconds done.
///
/// # Errors
/// [`RunError`]: the run could not go on.
pub fn run(
    scenario: &Scenario,
    backend: &mut dyn Backend,
    progress: impl FnMut(u64),
) -> Result<DriveOutcome, RunError> {
    let mut trace = Trace::default();
    let RunEnd { log, counts } = run_into(scenario, backend, |row| trace.rows.push(*row), progress)?;
    Ok(DriveOutcome { trace, log, counts })
}

/// Runs `scenario`; each row goes to `sink` as soon as it is known, so that memory does not grow with the run.
/// `progress` is called with the milliseconds done.
///
/// # Errors
/// [`RunError`]: the run could not go on.
pub fn run_into(
    scenario: &Scenario,
    backend: &mut dyn Backend,
    sink: impl FnMut(&TraceRow),
    progress: impl FnMut(u64),
) -> Result<RunEnd, RunError> {
    run_watched(scenario, backend, sink, progress, |_| {})
}

/// As [`run_into`]; between two acts of the operator, at most some hundred milliseconds apart, and once at the end,
/// `between` may take from the board what it keeps: records and log.
///
/// # Errors
/// [`RunError`]: the run could not go on.
pub fn run_watched(
    scenario: &Scenario,
    backend: &mut dyn Backend,
    mut sink: impl FnMut(&TraceRow),
    mut progress: impl FnMut(u64),
    mut between: impl FnMut(&mut dyn Backend),
) -> Result<RunEnd, RunError> {
    let [to_board, to_host] = WIRE_STREAMS.map(|stream| FaultyWire::new(Noise::new(scenario.seed, stream)));
    let mut script = Script {
        scenario,
        next: 0,
        command: Some([0.0, 0.0]),
        noise: Noise::new(scenario.seed, LINK_NOISE_STREAM),
        pressed_at_ms: None,
        to_board,
        to_host: None,
        stuck: false,
        last_drive: Vec::new(),
    };
    let mut observer = Observer::new(LinkClient::new(scenario.seed as u32), to_host);
    // The observer reads statuses only.
    backend.make_no_records();
    let start_us = backend.now_us();
    let mut chocked = scenario.chocked_until_armed;
    if chocked {
        backend.plant(&mut |plant| plant.set_chocked(true));
    }
    let end_ms = (scenario.duration_s * 1000.0).round() as u64;
    let mut ms = 0;
    while ms < end_ms {
        script.events(ms, &mut observer.client, backend);
        if ms % COMMAND_PERIOD_MS == 0 {
            if observer.client.identity().is_none() {
                script.send(ms, observer.client.identify(), backend);
            }
            if let Some([speed_m_s, yaw_rate_rad_s]) = script.command {
                observer.commanded = [speed_m_s, yaw_rate_rad_s];
                script.drive(ms, &mut observer.client, backend);
            }
        }
        script.send(ms, Vec::new(), backend);
        if let Some(fault) = script.to_host.take() {
            observer.wire.set_fault(fault);
        }
        // Until the operator acts again; while there are chocks to pull, the operator looks every millisecond.
        let until_ms = if chocked {
            ms + 1
        } else {
            script.idle_until(ms).min(end_ms)
        };
        let instants: Vec<u64> = (ms + 1..=until_ms).map(|ms| start_us + ms * 1000).collect();
        backend.run_through(&instants, &mut |observation| {
            observer.observe(ms, observation, &script, &mut sink);
            ms += 1;
            progress(ms);
        });
        // A back end that cannot go on observes nothing more.
        ms = until_ms;
        between(backend);
        let mut validity = Ok(());
        backend.plant(&mut |plant| validity = plant.validity());
        validity?;
        if chocked && observer.mode.is_some_and(|mode| mode != Mode::Disarmed) {
            chocked = false;
            backend.plant(&mut |plant| plant.set_chocked(false));
        }
    }
    let mut counts = observer.counts;
    counts.host_unreadable_frames = observer.client.unreadable_frames;
    Ok(RunEnd {
        log: backend.log(),
        counts,
    })
}

/// The observer of the run.
#[derive(Debug)]
struct Observer {
    /// The way from the board.
    wire: FaultyWire,
    counts: Counts,
    client: LinkClient,
    /// The modes of the last three rows.
    modes: [Mode; 3],
    /// The last command sent.
    commanded: [f64; 2],
    glances: Glances,
    last_tick: Option<u32>,
    /// As the vehicle last reported.
    mode: Option<Mode>,
}

impl Observer {
    fn new(client: LinkClient, wire: FaultyWire) -> Self {
        Self {
            wire,
            counts: Counts::default(),
            client,
            modes: [Mode::Disarmed; 3],
            commanded: [0.0; 2],
            glances: Glances::new(),
            last_tick: None,
            mode: None,
        }
    }

    /// Takes the observation at the end of millisecond `ms`; a row that it completes goes to `sink`.
    fn observe(
        &mut self,
        ms: u64,
        observation: &mut Observation,
        script: &Script<'_>,
        sink: &mut impl FnMut(&TraceRow),
    ) {
        let Observation {
            now_us,
            booted_us,
            ref mut glance,
            bridges_on,
            ref mut received,
        } = *observation;
        self.glances.add(now_us, glance);
        if !received.is_empty() || self.wire.next_due_ms().is_some() {
            let arrived = self.wire.pass(ms, std::mem::take(received));
            self.client.receive(now_us, &arrived);
        }
        let counts = &mut self.counts;
        if let (Some(pressed), false, None) = (script.pressed_at_ms, bridges_on, counts.emergency_stop_ms) {
            counts.emergency_stop_ms = Some(ms - pressed);
        }
        if self.client.status.is_some()
            && let Some(status) = self.client.status.take()
            && self.last_tick != Some(status.vehicle.tick)
        {
            let link = status.link;
            let mut status = status.vehicle;
            self.last_tick = Some(status.tick);
            self.mode = Some(status.mode);
            // The board's clock starts at each of its boots; a run has one time.
            status.time_us += booted_us;
            let truth = self.glances.truth_at(status.time_us).unwrap_or_default();
            self.modes = [self.modes[1], self.modes[2], status.mode];
            sink(&TraceRow {
                commanded: self.commanded,
                status,
                link,
                truth,
                bridges_on,
            });
        }
        let armed_since = self.modes.iter().any(|mode| *mode != Mode::Disarmed);
        if bridges_on && !armed_since && script.arm_requested() != Some(true) {
            counts.unarmed_drive_ms += 1;
        }
    }
}

impl Script<'_> {
    /// Whether the last request was to arm: between it and the next state the bridges may be on.
    fn arm_requested(&self) -> Option<bool> {
        self.scenario.steps[..self.next]
            .iter()
            .rev()
            .find_map(|step| match step.action {
                Action::Arm => Some(true),
                Action::Disarm => Some(false),
                _ => None,
            })
    }

    /// The next millisecond after `ms` at which the operator or the world does something.
    fn idle_until(&self, ms: u64) -> u64 {
        let command = (ms / COMMAND_PERIOD_MS + 1) * COMMAND_PERIOD_MS;
        let step = self.scenario.steps.get(self.next).map_or(u64::MAX, at_ms);
        let arrival = self.to_board.next_due_ms().unwrap_or(u64::MAX);
        command.min(step).min(arrival).max(ms + 1)
    }

    /// Sends bytes on the way to the board; what has come through goes in.
    fn send(&mut self, ms: u64, bytes: Vec<u8>, backend: &mut dyn Backend) {
        let arrived = self.to_board.pass(ms, bytes);
        if !arrived.is_empty() {
            backend.send(&arrived);
        }
    }

    /// Sends an order; nothing before the board has said who it is.
    fn give(&mut self, ms: u64, client: &mut LinkClient, order: Order, backend: &mut dyn Backend) {
        if let Some((_, frame)) = client.order(backend.now_us(), order) {
            self.send(ms, frame, backend);
        }
    }

    /// Sends the drive command: a fresh order, or from a program that hangs the last frame once more.
    fn drive(&mut self, ms: u64, client: &mut LinkClient, backend: &mut dyn Backend) {
        let [speed_m_s, yaw_rate_rad_s] = self.command.unwrap_or_default().map(|value| value as f32);
        let order = Order::Drive(DriveCommand::driving(speed_m_s, yaw_rate_rad_s));
        if !self.stuck
            && let Some((_, frame)) = client.order(backend.now_us(), order)
        {
            self.last_drive = frame;
        }
        self.send(ms, self.last_drive.clone(), backend);
    }

    fn events(&mut self, ms: u64, client: &mut LinkClient, backend: &mut dyn Backend) {
        while let Some(step) = self.scenario.steps.get(self.next)
            && at_ms(step) <= ms
        {
            self.next += 1;
            self.act(&step.action, ms, client, backend);
        }
    }

    fn act(&mut self, action: &Action, ms: u64, client: &mut LinkClient, backend: &mut dyn Backend) {
        match *action {
            Action::Arm => self.give(ms, client, Order::Request(Request::Arm), backend),
            Action::Disarm => self.send(ms, client.disarm().1, backend),
            Action::ClearFaults => self.give(ms, client, Order::Request(Request::ClearFaults), backend),
            // A program that hangs hears nobody.
            Action::Drive { .. } | Action::Silence | Action::Speak if self.stuck => {}
            Action::Drive {
                speed_m_s,
                yaw_rate_rad_s,
            } => self.command = Some([speed_m_s, yaw_rate_rad_s]),
            Action::Silence => self.command = None,
            Action::Speak => self.command = Some([0.0, 0.0]),
            Action::EmergencyStop { pressed } => {
                if pressed {
                    self.pressed_at_ms = Some(ms);
                }
                happen(action, backend);
            }
            Action::SensorFault { .. } | Action::Battery { .. } | Action::Chocks { .. } | Action::World(_) => {
                happen(action, backend);
            }
            Action::LinkNoise { bytes } => {
                let noise: Vec<u8> = (0..bytes).map(|_| self.noise.bits() as u8).collect();
                self.send(ms, noise, backend);
            }
            Action::Link(LinkStep::StuckOperator { stuck }) => {
                self.stuck = stuck;
            }
            Action::Link(LinkStep::Link {
                direction,
                latency_ms,
                jitter_ms,
                loss,
                duplication,
                reordering,
            }) => {
                let fault = WireFault {
                    latency_ms,
                    jitter_ms,
                    loss,
                    duplication,
                    reordering,
                };
                if direction != WireDirection::ToHost {
                    self.to_board.set_fault(fault);
                }
                if direction != WireDirection::ToBoard {
                    self.to_host = Some(fault);
                }
            }
        }
    }
}

/// Lets what a step does to the vehicle and its surroundings happen. What the operator or the link does is not its
/// business.
pub fn happen(action: &Action, backend: &mut dyn Backend) {
    match *action {
        Action::EmergencyStop { pressed } => backend.set_emergency_stop(pressed),
        Action::SensorFault { sensor, fault } => {
            backend.plant(&mut |plant| sensor.set_fault(plant, fault));
        }
        Action::Battery { open_circuit_v } => {
            backend.plant(&mut |plant| plant.set_open_circuit_v(open_circuit_v));
        }
        Action::Chocks { chocked } => backend.plant(&mut |plant| plant.set_chocked(chocked)),
        Action::World(world) => backend.plant(&mut |plant| world.act(plant)),
        Action::Arm
        | Action::Disarm
        | Action::ClearFaults
        | Action::Drive { .. }
        | Action::Silence
        | Action::Speak
        | Action::LinkNoise { .. }
        | Action::Link(_) => {}
    }
}

/// The millisecond in which a step happens.
fn at_ms(step: &Step) -> u64 {
    (step.at_s * 1000.0).round() as u64
}
