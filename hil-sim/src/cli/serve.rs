//! `hil-sim serve`: a simulated board on a port, in real time, for every program that talks to a real board.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;

use clap::Args;
use model::vehicle::Vehicle;
use plant::Plant;
use report::error::CommandError;
use report::output::print;
use virtual_board::scenario::{Backend, Scenario, VirtualBackend};

use super::drive::{self, BoardKind, load_scenario, load_vehicles};
use super::emulated::{self, only_emulated};

mod hub;
mod pace;
mod ports;
mod server;
pub(super) mod websocket;

use pace::Pace;
use ports::{HAPPENED_MAX, listen, open_pty, serve_tcp};
use server::Server;
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
    /// Vehicle file of the simulated vehicle, where it is another than the one that the firmware is given
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
    /// What is served: the firmware's tasks on a virtual board, or the flashed ELF on an emulated one
    #[arg(long, value_enum, default_value_t)]
    board: BoardKind,
    /// ELF to run on the emulated board; the workspace's own, built if needed, if left out
    #[arg(long, value_name = "ELF")]
    pub firmware: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim serve --pty
  hil-sim serve --tcp 127.0.0.1:5760 --scenario kerb
  hil-sim serve --websocket 127.0.0.1:5761
  hil-sim serve --wait
  hil-sim serve --board emulated
  hil-sim link --port tcp:127.0.0.1:5760 drive --speed-m-s 0.3 --seconds 5 --record drive.mcap";

/// Default address of the board.
const DEFAULT_TCP: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 5760);
/// Shortest simulated time of a go of the virtual board, ms: a client's bytes wait no longer than a go.
const VIRTUAL_GO_MS: u64 = 1;

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
    check_addresses(arguments)?;
    match (arguments.board, &arguments.firmware) {
        (BoardKind::Emulated, firmware) => emulated::run(firmware.as_deref()),
        (BoardKind::Virtual, Some(_)) => Err(only_emulated()),
        (BoardKind::Virtual, None) => run_on(
            arguments,
            VIRTUAL_GO_MS,
            |vehicle, plant| {
                VirtualBackend::boot(vehicle, plant).map_err(|error| CommandError::Input(error.to_string()))
            },
            |_backend| Ok(()),
        ),
    }
}

/// Serves the board that `boot` creates, which runs for at least `go_ms` at a time. `check` reports why a board's time
/// has stopped.
///
/// # Errors
/// As [`run`], and the errors of `boot` and `check`.
pub fn run_on<B: Backend>(
    arguments: &Arguments,
    go_ms: u64,
    boot: impl FnOnce(&Vehicle<f64>, Plant) -> Result<B, CommandError>,
    check: impl FnMut(&mut B) -> Result<(), CommandError>,
) -> Result<(), CommandError> {
    check_addresses(arguments)?;
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
    let backend = boot(&vehicle, plant)?;

    let (events, happened) = sync_channel(HAPPENED_MAX);
    for (flag, address) in addresses(arguments) {
        let (serve, scheme) = match flag {
            TCP => (serve_tcp as ports::Serve, "tcp:"),
            _ => (serve_websocket as ports::Serve, "ws://"),
        };
        let bound = listen(flag, address, events.clone(), serve)?;
        print(&format!("board at {scheme}{bound}\n"))?;
    }
    if arguments.pty {
        print(&format!("board at {}\n", open_pty(events.clone())?))?;
    }
    let ended = Arc::new(AtomicBool::new(false));
    let end = ended.clone();
    ctrlc::set_handler(move || end.store(true, Ordering::Relaxed))
        .map_err(|error| CommandError::Other(error.to_string()))?;
    let mut server = Server::new(backend, scenario, check, arguments.wait);
    server.serve(&happened, Pace::new(arguments.rate, go_ms), &ended)
}

/// The flags of the addresses.
const TCP: &str = "--tcp";
const WEBSOCKET: &str = "--websocket";

/// Flag and address of each listener.
fn addresses(arguments: &Arguments) -> impl Iterator<Item = (&'static str, SocketAddr)> {
    let other = arguments.pty || arguments.websocket.is_some();
    let tcp = arguments.tcp.or((!other).then_some(DEFAULT_TCP));
    let listeners = [(TCP, tcp), (WEBSOCKET, arguments.websocket)];
    listeners
        .into_iter()
        .filter_map(|(flag, address)| Some((flag, address?)))
}

/// Refuses an address that other machines can reach, unless `--any-machine` allows it.
fn check_addresses(arguments: &Arguments) -> Result<(), CommandError> {
    let open = addresses(arguments).find(|(_, address)| !address.ip().is_loopback() && !arguments.any_machine);
    open.map_or(Ok(()), |(flag, address)| {
        Err(CommandError::Input(format!(
            "{flag} {address}: other machines could drive; --any-machine lets them"
        )))
    })
}

/// Level ground.
fn level(seed: Option<u64>) -> Result<Scenario, CommandError> {
    let text = format!("title = \"served\"\nduration_s = 1.0\nseed = {}\n", seed.unwrap_or(1));
    Scenario::parse("served", &text).map_err(|error| CommandError::Input(error.to_string()))
}
