//! A board with its simulated vehicle, for the page: bytes of the link in and out, and the vehicle's true
//! state.

use firmware::drive_board::SCALES;
use model::vehicle::Vehicle;
use plant::Truth;
use serde::{Deserialize, Serialize};
use virtual_board::scenario::file::{DEFAULT, DEFAULT_NAME};
use virtual_board::scenario::run::happen;
use virtual_board::scenario::trace::Fnv1a;
use virtual_board::scenario::{Action, Backend, Scenario, Step, VirtualBackend, run, shipped};

use crate::surface;

/// The scene that the page requests: vehicle, ground and events.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PageScene {
    /// Name of a shipped scenario with the ground and the events; level ground if empty.
    pub scenario: String,
    /// Text of the vehicle's file; the reference vehicle if empty.
    pub vehicle: String,
    /// Slope of the bare plane along x, rad, on level ground.
    pub slope_rad: f64,
}

/// The simulated vehicle's true state, independent of its board's messages.
#[derive(Debug, Serialize)]
pub struct Seen {
    /// Time since the start, us.
    now_us: u64,
    truth: Truth,
    bridges_on: bool,
    emergency_stop: bool,
    /// Heights of the ground above the bare plane, m, along the heading, the axle above the middle one.
    ground_m: Vec<f32>,
    /// Distance between two heights, m.
    ground_spacing_m: f64,
    /// Inclination of the bare plane along the heading, rad, positive uphill.
    plane_rad: f64,
    /// Lines of the firmware's log since the last call.
    log: Vec<String>,
    /// Why the simulation ended: the plant's equations no longer hold.
    ended: Option<String>,
}

/// A board and its vehicle in virtual time.
pub struct Simulation {
    backend: VirtualBackend,
    steps: Vec<Step>,
    next_step: usize,
    radius_m: f64,
    emergency_stop: bool,
    /// Hash of the board's whole output.
    said: Fnv1a,
}

impl Simulation {
    /// Boots a board in this scene.
    ///
    /// # Errors
    /// The error in the scene's description, as text.
    pub fn boot(scene: &PageScene) -> Result<Self, String> {
        let scenario = scenario(scene)?;
        let vehicle = vehicle(&scene.vehicle)?;
        let plant = scenario.plant(&vehicle).map_err(|error| error.to_string())?;
        let backend = VirtualBackend::boot(&vehicle, plant).map_err(|error| error.to_string())?;
        Ok(Self {
            backend,
            steps: scenario.steps,
            next_step: 0,
            radius_m: vehicle.parameters().body.wheel_radius_m,
            emergency_stop: false,
            said: Fnv1a::default(),
        })
    }

    /// Runs for some milliseconds and returns the board's output.
    pub fn run(&mut self, ms: u32) -> Vec<u8> {
        let start_us = self.backend.now_us();
        for instant_us in (1..=u64::from(ms)).map(|ms| start_us + ms * 1000) {
            while let Some(step) = self.steps.get(self.next_step)
                && step.at_s * 1e6 < instant_us as f64
            {
                self.next_step += 1;
                happen(&step.action, &mut self.backend);
            }
            self.backend.board.run_until(instant_us);
        }
        let said = self.backend.board.receive();
        self.said.take(&said);
        said
    }

    /// Hash of the board's whole output: equal hashes mean equal runs.
    pub fn hash(&self) -> u64 {
        self.said.0
    }

    /// Sends bytes to the board.
    pub fn send(&mut self, bytes: &[u8]) {
        self.backend.send(bytes);
    }

    /// Carries out an event on the vehicle: the lines of one step of a scenario, without its time.
    ///
    /// # Errors
    /// The error in the step.
    pub fn act(&mut self, step: &str) -> Result<(), String> {
        let text = format!("title = \"page\"\nduration_s = 1.0\n[[step]]\nat_s = 0.0\n{step}\n");
        let scenario = Scenario::parse("step", &text).map_err(|error| error.to_string())?;
        for step in &scenario.steps {
            if let Action::EmergencyStop { pressed } = step.action {
                self.emergency_stop = pressed;
            }
            happen(&step.action, &mut self.backend);
        }
        Ok(())
    }

    /// The true state now.
    pub fn look(&mut self) -> Seen {
        let radius_m = self.radius_m;
        let mut ended = None;
        self.backend
            .plant(&mut |plant| ended = plant.validity().err().map(|invalid| invalid.to_string()));
        let log = self.backend.log();
        let (now_us, emergency_stop) = (self.backend.now_us(), self.emergency_stop);
        self.backend.board.world(|world| {
            let truth = world.plant.truth();
            let ground = world.plant.ground();
            let plane = ground.terrain().plane();
            let heading = truth.heading_rad;
            Seen {
                now_us,
                truth,
                bridges_on: world.bridges_on(),
                emergency_stop,
                ground_m: surface::outline(ground, truth.x_m, heading, radius_m),
                ground_spacing_m: surface::spacing_m(radius_m),
                plane_rad: plane.slope_x_rad * heading.cos() + plane.slope_y_rad * heading.sin(),
                log,
                ended,
            }
        })
    }
}

/// The scenario of a scene.
fn scenario(scene: &PageScene) -> Result<Scenario, String> {
    if scene.scenario.is_empty() {
        let slope = scene.slope_rad;
        let text = format!(
            "title = \"page\"\nduration_s = 1.0\n[terrain.plane]\nslope_x_rad = {slope:?}\nslope_y_rad = 0.0\n"
        );
        return Scenario::parse("page", &text).map_err(|error| error.to_string());
    }
    shipped::find(std::path::Path::new(&scene.scenario)).map_err(|error| error.to_string())
}

/// The vehicle that a file's text describes.
fn vehicle(text: &str) -> Result<Vehicle<f64>, String> {
    if text.is_empty() {
        return vehicle_file::reference().map_err(|error| error.to_string());
    }
    vehicle_file::parse_vehicle_for("vehicle file", text, &SCALES.sensor_ranges()).map_err(|error| error.to_string())
}

/// Drives the default scenario and returns the hash of its trace.
///
/// # Errors
/// The scenario cannot be driven.
pub fn default_drive_hash() -> Result<u64, String> {
    let scenario = Scenario::parse(DEFAULT_NAME, DEFAULT).map_err(|error| error.to_string())?;
    let vehicle = vehicle("")?;
    let plant = scenario.plant(&vehicle).map_err(|error| error.to_string())?;
    let mut backend = VirtualBackend::boot(&vehicle, plant).map_err(|error| error.to_string())?;
    let driven = run(&scenario, &mut backend, |_| {}).map_err(|error| error.to_string())?;
    Ok(driven.trace.hash())
}
