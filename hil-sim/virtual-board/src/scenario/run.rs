//! Runs a scenario on a backend.

use firmware::protocol::message::{COMMAND_PERIOD_MS, Order};
use model::command::{DriveCommand, Request};
use model::supervise::arming::Mode;

use super::backend::Backend;
use super::file::Scenario;
use super::observer::Observer;
use super::outcome::{DriveOutcome, RunEnd};
use super::step::{Action, Step};
use super::trace::{Trace, TraceRow};
use super::wire::{FaultyWire, LinkStep, WireDirection, WireFault};
use crate::link_client::{AGAIN_US, LinkClient};
use plant::Invalid;
use plant::noise::Noise;
use thiserror::Error;

/// Stream of the scenario's seed for noise on the link.
const LINK_NOISE_STREAM: u64 = 6;
/// Streams for the link faults to the board and from the board.
const WIRE_STREAMS: [u64; 2] = [7, 8];

/// Why a run could not continue.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum RunError {
    /// The simulated vehicle left the range in which the plant's equations are valid.
    #[error(transparent)]
    Plant(#[from] Invalid),
}

/// The operator's actions and the events in the vehicle's surroundings.
struct Script<'a> {
    scenario: &'a Scenario,
    next: usize,
    /// Commanded speed and yaw rate; `None` while the operator is silent.
    command: Option<[f64; 2]>,
    noise: Noise,
    pressed_at_ms: Option<u64>,
    to_board: FaultyWire,
    /// The link fault from the board, once a step has set it.
    to_host: Option<WireFault>,
    /// The operator's program hangs and repeats its last frame.
    stuck: bool,
    /// The last drive command sent, as a frame.
    last_drive: Vec<u8>,
    /// When Disarm was last sent, while the operator has not heard that the vehicle is disarmed.
    disarm_sent_ms: Option<u64>,
}

/// Runs `scenario` and keeps its rows. `progress` is called with the number of simulated milliseconds.
///
/// # Errors
/// [`RunError`]: the run could not continue.
pub fn run(
    scenario: &Scenario,
    backend: &mut dyn Backend,
    progress: impl FnMut(u64),
) -> Result<DriveOutcome, RunError> {
    let mut trace = Trace::default();
    let RunEnd { log, counts } = run_into(scenario, backend, |row| trace.rows.push(*row), progress)?;
    Ok(DriveOutcome { trace, log, counts })
}

/// Runs `scenario` and passes each row to `sink` as soon as it is known, so that the memory use does not grow with
/// the run. `progress` is called with the number of simulated milliseconds.
///
/// # Errors
/// [`RunError`]: the run could not continue.
pub fn run_into(
    scenario: &Scenario,
    backend: &mut dyn Backend,
    sink: impl FnMut(&TraceRow),
    progress: impl FnMut(u64),
) -> Result<RunEnd, RunError> {
    run_watched(scenario, backend, sink, progress, |_| {})
}

/// As [`run_into`]. Between two actions of the operator, at most some hundred milliseconds apart, and once at the
/// end, `between` may take records and log from the board.
///
/// # Errors
/// [`RunError`]: the run could not continue.
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
        disarm_sent_ms: None,
    };
    let mut observer = Observer::new(scenario, to_host);
    // The observer reads only statuses.
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
            script.disarm_again(ms, &mut observer, backend);
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
        // Runs until the operator acts again. While chocks are in place, the operator checks every millisecond.
        let until_ms = if chocked {
            ms + 1
        } else {
            script.idle_until(ms).min(end_ms)
        };
        let instants: Vec<u64> = (ms + 1..=until_ms).map(|ms| start_us + ms * 1000).collect();
        backend.run_through(&instants, &mut |observation| {
            observer.observe(
                ms,
                observation,
                script.pressed_at_ms,
                || script.arm_requested(),
                &mut sink,
            );
            ms += 1;
            progress(ms);
        });
        // A backend that cannot continue makes no further observation.
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

impl Script<'_> {
    /// Whether the last request was to arm.
    fn arm_requested(&self) -> bool {
        self.scenario.steps[..self.next]
            .iter()
            .rev()
            .find_map(|step| match step.action {
                Action::Arm => Some(true),
                Action::Disarm => Some(false),
                _ => None,
            })
            .unwrap_or(false)
    }

    /// The next millisecond after `ms` at which the operator acts or an event happens.
    fn idle_until(&self, ms: u64) -> u64 {
        let command = (ms / COMMAND_PERIOD_MS + 1) * COMMAND_PERIOD_MS;
        let step = self.scenario.steps.get(self.next).map_or(u64::MAX, at_ms);
        let arrival = self.to_board.next_due_ms().unwrap_or(u64::MAX);
        command.min(step).min(arrival).max(ms + 1)
    }

    /// Sends bytes through the link to the board and delivers the bytes that have come through.
    fn send(&mut self, ms: u64, bytes: Vec<u8>, backend: &mut dyn Backend) {
        let arrived = self.to_board.pass(ms, bytes);
        if !arrived.is_empty() {
            backend.send(&arrived);
        }
    }

    /// Sends Disarm again, as the link tool does, until the operator hears that the vehicle is disarmed.
    fn disarm_again(&mut self, ms: u64, observer: &mut Observer, backend: &mut dyn Backend) {
        let Some(sent_ms) = self.disarm_sent_ms else { return };
        if observer.heard == Some(Mode::Disarmed) {
            self.disarm_sent_ms = None;
        } else if ms >= sent_ms + AGAIN_US / 1000 {
            self.disarm_sent_ms = Some(ms);
            self.send(ms, observer.client.disarm().1, backend);
        }
    }

    /// Sends an order; sends nothing before the board has identified itself.
    fn give(&mut self, ms: u64, client: &mut LinkClient, order: Order, backend: &mut dyn Backend) {
        if let Some((_, frame)) = client.order(backend.now_us(), order) {
            self.send(ms, frame, backend);
        }
    }

    /// Sends the drive command: a new order or, from a program that hangs, the last frame again.
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
            Action::Arm => {
                self.disarm_sent_ms = None;
                self.give(ms, client, Order::Request(Request::Arm), backend);
            }
            Action::Disarm => {
                self.disarm_sent_ms = Some(ms);
                self.send(ms, client.disarm().1, backend);
            }
            Action::ClearFaults => self.give(ms, client, Order::Request(Request::ClearFaults), backend),
            // A program that hangs reacts to no action.
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

/// Applies a step's effect on the vehicle and its surroundings. The function ignores the operator's and the link's
/// actions.
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

/// The millisecond of a step.
fn at_ms(step: &Step) -> u64 {
    (step.at_s * 1000.0).round() as u64
}
