//! Hears the board and sees the vehicle, and joins both into the rows of a run.

use model::supervise::arming::Mode;

use super::backend::Observation;
use super::file::Scenario;
use super::glances::Glances;
use super::outcome::Counts;
use super::trace::TraceRow;
use super::wire::FaultyWire;
use crate::link_client::LinkClient;

/// What a run hears and sees of the board and the vehicle.
#[derive(Debug)]
pub struct Observer {
    /// The link from the board.
    pub wire: FaultyWire,
    pub counts: Counts,
    /// The operator's end of the link.
    pub client: LinkClient,
    /// Reads what the board sends before the link delays or loses it, if the scenario has such a link. A run is judged by
    /// what the board did, not by what its operator heard.
    tap: Option<LinkClient>,
    /// The mode that the operator last heard of.
    pub heard: Option<Mode>,
    /// The modes of the last three rows.
    modes: [Mode; 3],
    /// The last command sent.
    pub commanded: [f64; 2],
    glances: Glances,
    last_tick: Option<u32>,
    /// The mode that the vehicle last reported.
    pub mode: Option<Mode>,
}

impl Observer {
    pub fn new(scenario: &Scenario, wire: FaultyWire) -> Self {
        // The same number, so that the tap takes the board's answer to the operator's question for its own.
        let client = || LinkClient::new(scenario.seed as u32);
        let faulty = scenario.steps.iter().any(|step| step.action.faults_the_way_back());
        Self {
            wire,
            counts: Counts::default(),
            client: client(),
            tap: faulty.then(client),
            heard: None,
            modes: [Mode::Disarmed; 3],
            commanded: [0.0; 2],
            glances: Glances::new(),
            last_tick: None,
            mode: None,
        }
    }

    /// Processes the observation at the end of millisecond `ms`. A completed row goes to `sink`. `arm_requested`: whether the
    /// operator's last request was to arm; between this request and the next status the bridges may be on.
    pub fn observe(
        &mut self,
        ms: u64,
        observation: &mut Observation,
        pressed_at_ms: Option<u64>,
        arm_requested: impl FnOnce() -> bool,
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
        if let Some(tap) = &mut self.tap {
            tap.receive(now_us, received);
        }
        if !received.is_empty() || self.wire.next_due_ms().is_some() {
            let arrived = self.wire.pass(ms, std::mem::take(received));
            self.client.receive(now_us, &arrived);
        }
        let counts = &mut self.counts;
        if let (Some(pressed), false, None) = (pressed_at_ms, bridges_on, counts.emergency_stop_ms) {
            counts.emergency_stop_ms = Some(ms - pressed);
        }
        if let Some(status) = &self.client.status {
            self.heard = Some(status.vehicle.mode);
        }
        let reader = self.tap.as_mut().unwrap_or(&mut self.client);
        if reader.status.is_some()
            && let Some(status) = reader.status.take()
            && self.last_tick != Some(status.vehicle.tick)
        {
            let link = status.link;
            let mut status = status.vehicle;
            self.last_tick = Some(status.tick);
            self.mode = Some(status.mode);
            // The board's clock restarts at each boot, but a run has one time.
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
        if bridges_on && !armed_since && !arm_requested() {
            counts.unarmed_drive_ms += 1;
        }
    }
}
