//! `hil-sim serve`: a simulated board on a port, in real time, for everything that talks to a real one.

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use clap::Args;
use report::error::CommandError;
use report::output::print;
use virtual_board::scenario::run::happen;
use virtual_board::scenario::{Backend, Scenario, VirtualBackend};

use super::drive::{self, load_scenario, load_vehicles};

mod hub;
mod ports;
pub(super) mod websocket;

use hub::{ClientId, Hub};
use ports::{ClientOutput, PortEvent, listen, open_pty, serve_tcp};
use websocket::serve_websocket;

/// Flags of `serve`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// A pseudo-terminal, which clients open like a serial port
    #[arg(long)]
    pty: bool,
    /// A TCP address; 127.0.0.1:5760 if no port is given
    #[arg(long, value_name = "ADDRESS", value_parser = tcp_address)]
    tcp: Option<SocketAddr>,
    /// An address for WebSockets, such as 127.0.0.1:5761: for `hil-sim console`, and for no page from another machine
    #[arg(long, value_name = "ADDRESS", value_parser = tcp_address)]
    websocket: Option<SocketAddr>,
    /// Let other machines than this one reach the addresses
    #[arg(long)]
    any_machine: bool,
    /// Scenario whose ground and events the vehicle meets, file or name; its operator's steps are the client's business
    #[arg(long, value_name = "SCENARIO")]
    scenario: Option<PathBuf>,
    /// Vehicle file; the scenario's, or the reference vehicle, if left out
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Vehicle file of the simulated vehicle, where it is another than the one the firmware is told of
    #[arg(long, value_name = "FILE")]
    plant_vehicle: Option<PathBuf>,
    /// Seed of the sensors' noise
    #[arg(long, value_parser = super::campaign::seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Simulated seconds per second
    #[arg(long, default_value_t = 1.0, value_parser = rate)]
    rate: f64,
    /// Boot the board when the first client comes: its record then begins with the boot, and can be replayed
    #[arg(long)]
    wait: bool,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim serve --pty
  hil-sim serve --tcp 127.0.0.1:5760 --scenario kerb
  hil-sim serve --websocket 127.0.0.1:5761
  hil-sim serve --wait
  hil-sim link --port tcp:127.0.0.1:5760 drive --speed-m-s 0.3 --seconds 5 --record drive.mcap";

/// Where the board listens if nothing else is said.
const DEFAULT_TCP: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 5760);
/// How long the server waits for a client's bytes before the board goes on.
const PATIENCE: Duration = Duration::from_millis(1);
/// Most simulated time in one go, us: a machine that slept does not catch up.
const STRIDE_MAX_US: u64 = 100_000;

fn tcp_address(text: &str) -> Result<SocketAddr, String> {
    text.parse()
        .map_err(|_| format!("must be an IP address and a port, as {DEFAULT_TCP}"))
}

fn rate(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(rate) if (0.01..=100.0).contains(&rate) => Ok(rate),
        _ => Err("must be 0.01 to 100".to_owned()),
    }
}

/// Serves until Ctrl-C.
///
/// # Errors
/// [`CommandError::Input`] on a bad file, flag or address, [`CommandError::Checks`] when the simulated vehicle leaves the
/// range in which the plant's equations hold.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let drive = drive::Arguments {
        scenario: arguments.scenario.clone(),
        seed: arguments.seed,
        ..drive::Arguments::default()
    };
    let scenario = match &arguments.scenario {
        Some(_) => load_scenario(&drive)?,
        None => level(arguments.seed)?,
    };
    let (vehicle, simulated) = load_vehicles(
        arguments.vehicle.as_deref(),
        arguments.plant_vehicle.as_deref(),
        &scenario,
    )?;
    let input = |error: String| CommandError::Input(error);
    let plant = scenario.plant(&simulated).map_err(|error| input(error.to_string()))?;
    let backend = VirtualBackend::boot(&vehicle, plant).map_err(|error| input(error.to_string()))?;

    let (events, happened) = channel();
    let other = arguments.pty || arguments.websocket.is_some();
    let tcp = arguments.tcp.or((!other).then_some(DEFAULT_TCP));
    for (flag, address) in [("--tcp", tcp), ("--websocket", arguments.websocket)] {
        if let Some(address) = address.filter(|address| !address.ip().is_loopback() && !arguments.any_machine) {
            return Err(input(format!(
                "{flag} {address}: other machines could drive; --any-machine lets them"
            )));
        }
    }
    if let Some(address) = tcp {
        let bound = listen("--tcp", address, events.clone(), serve_tcp)?;
        print(&format!("board at tcp:{bound}\n"))?;
    }
    if let Some(address) = arguments.websocket {
        let bound = listen("--websocket", address, events.clone(), serve_websocket)?;
        print(&format!("board at ws://{bound}\n"))?;
    }
    if arguments.pty {
        print(&format!("board at {}\n", open_pty(events.clone())?))?;
    }
    let ended = Arc::new(AtomicBool::new(false));
    let end = ended.clone();
    ctrlc::set_handler(move || end.store(true, Ordering::Relaxed))
        .map_err(|error| CommandError::Other(error.to_string()))?;
    let mut server = Server {
        backend,
        scenario,
        next_step: 0,
        hub: Hub::default(),
        outputs: BTreeMap::new(),
        off: arguments.wait,
    };
    server.serve(&happened, arguments.rate, &ended)
}

/// Level ground.
fn level(seed: Option<u64>) -> Result<Scenario, CommandError> {
    let text = format!("title = \"served\"\nduration_s = 1.0\nseed = {}\n", seed.unwrap_or(1));
    Scenario::parse("served", &text).map_err(|error| CommandError::Input(error.to_string()))
}

/// The board and its clients.
struct Server {
    backend: VirtualBackend,
    scenario: Scenario,
    next_step: usize,
    hub: Hub,
    outputs: BTreeMap<ClientId, (String, ClientOutput)>,
    /// The board has not booted yet: it waits for the first client.
    off: bool,
}

impl Server {
    fn serve(&mut self, events: &Receiver<PortEvent>, rate: f64, ended: &AtomicBool) -> Result<(), CommandError> {
        let (mut last, mut due_us) = (Instant::now(), 0.0);
        if self.scenario.chocked_until_armed {
            // Nobody pulls them here.
            print("the scenario's chocks are not put in place\n")?;
        }
        while !ended.load(Ordering::Relaxed) {
            match events.recv_timeout(PATIENCE) {
                Ok(event) => self.take(event)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(CommandError::Other("every port is closed".into()));
                }
            }
            while let Ok(event) = events.try_recv() {
                self.take(event)?;
            }
            let now = Instant::now();
            due_us += now.duration_since(last).as_secs_f64() * 1e6 * rate;
            last = now;
            if self.off {
                due_us = 0.0;
                continue;
            }
            let stride_us = (due_us as u64).min(STRIDE_MAX_US) / 1000 * 1000;
            due_us = (due_us - stride_us as f64).min(STRIDE_MAX_US as f64);
            self.advance(stride_us / 1000)?;
        }
        Ok(())
    }

    /// Lets the board run some milliseconds, and tells the clients what it says.
    fn advance(&mut self, ms: u64) -> Result<(), CommandError> {
        let start_us = self.backend.now_us();
        for instant_us in (1..=ms).map(|ms| start_us + ms * 1000) {
            while let Some(step) = self.scenario.steps.get(self.next_step)
                && step.at_s * 1e6 < instant_us as f64
            {
                self.next_step += 1;
                happen(&step.action, &mut self.backend);
            }
            self.backend.board.run_until(instant_us);
        }
        let said = self.backend.board.receive();
        if !said.is_empty() {
            self.outputs.retain(|_, (_, output)| output.send(&said));
        }
        for line in self.backend.log() {
            print(&format!("{line}\n"))?;
        }
        let mut validity = Ok(());
        self.backend.plant(&mut |plant| validity = plant.validity());
        validity.map_err(|invalid| CommandError::Checks(invalid.to_string()))
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
