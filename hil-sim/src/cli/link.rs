//! `hil-sim link`: talks to a drive board over its serial port, or to a served one.
#![deny(clippy::print_stdout)] // A closed output is an error, not a panic: everything goes through the console.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use clap::{Args, Subcommand};
use firmware::hardware::ClockSource;
use firmware::protocol::message::{BoardStatus, Identity, Order};
use model::command::Request;
use report::error::CommandError;

pub mod console;
pub mod drive;
pub mod memory;
pub mod parameters;
pub mod session;
pub mod wire;

use console::Console;
use drive::{DriveJob, check_seconds};
use session::Link;
use wire::{Port, Wire};

/// Flags of `link`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Serial port of the board: /dev/ttyACM0, COM3, ...; or tcp:ADDRESS of a served one
    #[arg(long)]
    port: String,
    #[command(subcommand)]
    action: LinkCommand,
}

/// What to do over the link.
#[derive(Debug, Subcommand)]
enum LinkCommand {
    /// Shows the vehicle's state for a while; exit code 1 if the board falls silent
    Status {
        /// How long, s
        #[arg(long, default_value_t = 5.0, allow_negative_numbers = true)]
        seconds: f64,
    },
    /// Arms, drives, stops and disarms; Ctrl-C stops the vehicle, a second one disarms it at once
    Drive {
        /// Speed, m/s, forward positive
        #[arg(long, allow_negative_numbers = true)]
        speed_m_s: f32,
        /// Yaw rate, rad/s, to the left positive
        #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
        yaw_rate_rad_s: f32,
        /// How long, s
        #[arg(long, allow_negative_numbers = true)]
        seconds: f64,
    },
    /// Opens the bridges at once
    Disarm,
    /// Forgets latched faults
    ClearFaults,
    /// Shows the board's log since its boot
    Log,
    /// Shows the last faults, which the board keeps over resets
    Faults,
    /// Writes the record of every tick to a file, in the link's own frames
    Record {
        /// The file; must not exist
        #[arg(long)]
        out: PathBuf,
        /// How long, s; Ctrl-C ends it before
        #[arg(long, default_value_t = 3600.0, allow_negative_numbers = true)]
        seconds: f64,
    },
    /// Writes the records of the last 2 s before a fault to a file, in the link's own frames
    LookBack {
        /// The file; must not exist
        #[arg(long)]
        out: PathBuf,
    },
    /// Reads, changes and stores parameters
    Parameters {
        #[command(subcommand)]
        action: ParameterAction,
    },
}

/// What to do with parameters.
#[derive(Debug, Subcommand)]
enum ParameterAction {
    /// Shows every parameter as the board has it
    List,
    /// Changes parameters, stores the set in the board's flash and puts it in force
    Set {
        /// `table.name=value`, as in the vehicle file; several at once
        #[arg(required = true)]
        assignments: Vec<String>,
    },
    /// Goes back to the set the firmware was built with
    Defaults,
    /// Writes the board's set to a vehicle file
    Dump {
        /// The file; must not exist
        file: PathBuf,
    },
    /// Stores a vehicle file's set in the board and puts it in force
    Load {
        /// The file
        file: PathBuf,
    },
    /// Shows how the board's set differs from a vehicle file's, the board's value first; exit code 1 if it does
    Diff {
        /// The file
        file: PathBuf,
    },
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] for a number, port, file or parameter that is not good, [`CommandError::Checks`] when the
/// board refuses, reports a fault or falls silent, [`CommandError::Other`] when the output is closed.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let begin = |port: &str| Ok(Link::new(Port::open(port)?, nonce(), interrupts()?));
    run_on(arguments, begin, &mut Console(io::stdout()))
}

/// Runs the command in the conversation that `begin` begins at the port of the command line. The conversation's wire
/// has the clock, and the console is the only output.
///
/// # Errors
/// As [`run`].
pub fn run_on<W: Wire, O: Write>(
    arguments: &Arguments,
    begin: impl FnOnce(&str) -> Result<Link<W>, CommandError>,
    console: &mut Console<O>,
) -> Result<(), CommandError> {
    // Whatever is wrong with the command line is told before the port opens.
    let job = Job::new(&arguments.action)?;
    job.run(begin(&arguments.port)?, console)
}

/// A number that no tool has used before on this board: of the time and the process.
pub(in crate::cli) fn nonce() -> u32 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    (since.as_micros() as u32) ^ std::process::id().rotate_left(16)
}

/// Counts how often the user asks to stop, instead of ending the program before its Disarm.
pub(in crate::cli) fn interrupts() -> Result<Arc<AtomicU32>, CommandError> {
    let count = Arc::new(AtomicU32::new(0));
    let counter = count.clone();
    ctrlc::set_handler(move || {
        counter.fetch_add(1, Ordering::Relaxed);
    })
    .map_err(|error| CommandError::Other(error.to_string()))?;
    Ok(count)
}

/// A checked action.
enum Job<'a> {
    Status(f64),
    Drive(DriveJob),
    Disarm,
    ClearFaults,
    Log,
    Faults,
    Record(File, f64),
    LookBack(File),
    Parameters(&'a ParameterAction),
}

impl<'a> Job<'a> {
    fn new(action: &'a LinkCommand) -> Result<Self, CommandError> {
        Ok(match action {
            LinkCommand::Status { seconds } => Self::Status(check_seconds(*seconds)?),
            LinkCommand::Drive {
                speed_m_s,
                yaw_rate_rad_s,
                seconds,
            } => Self::Drive(DriveJob::new(*speed_m_s, *yaw_rate_rad_s, *seconds)?),
            LinkCommand::Disarm => Self::Disarm,
            LinkCommand::ClearFaults => Self::ClearFaults,
            LinkCommand::Log => Self::Log,
            LinkCommand::Faults => Self::Faults,
            LinkCommand::Record { out, seconds } => Self::Record(create_new(out)?, check_seconds(*seconds)?),
            LinkCommand::LookBack { out } => Self::LookBack(create_new(out)?),
            LinkCommand::Parameters { action } => Self::Parameters(action),
        })
    }

    fn run<W: Wire, O: Write>(self, mut link: Link<W>, console: &mut Console<O>) -> Result<(), CommandError> {
        if let Self::Disarm = self {
            // Before anything else, and whoever the board is.
            return link.disarm();
        }
        let identity = link.identify()?;
        match self {
            Self::Disarm => Ok(()),
            Self::Status(seconds) => {
                console.line(&who(&identity))?;
                link.show(seconds, console)
            }
            Self::Drive(drive) => link.drive(&drive, console),
            Self::ClearFaults => link.order(Order::Request(Request::ClearFaults)),
            Self::Log => link.show_log(console),
            Self::Faults => link.show_faults(console),
            Self::Record(file, seconds) => {
                let recorded = into_file(file, |out| link.record(seconds, out))?;
                console.line(&recorded.line())
            }
            Self::LookBack(file) => {
                let recorded = into_file(file, |out| link.look_back(out))?;
                console.line(&recorded.line())
            }
            Self::Parameters(action) => parameters_of(&mut link, action, console),
        }
    }
}

/// One action on the board's parameters.
fn parameters_of<W: Wire, O: Write>(
    link: &mut Link<W>,
    action: &ParameterAction,
    console: &mut Console<O>,
) -> Result<(), CommandError> {
    match action {
        ParameterAction::List => {
            let parameters = link.parameters()?;
            for number in 0..parameters.count() {
                if let (Some((table, field)), Some(value)) = (parameters.field(number), parameters.value(number)) {
                    console.line(&format!("{table}.{} = {value}", field.name))?;
                }
            }
            Ok(())
        }
        ParameterAction::Set { assignments } => link.set(assignments),
        ParameterAction::Defaults => link.defaults(),
        ParameterAction::Dump { file } => {
            let text = vehicle_file::to_toml(&link.parameters()?);
            into_file(create_new(file)?, |out| Ok(out.write_all(text.as_bytes())?))?;
            console.line(&format!("wrote {}", file.display()))
        }
        ParameterAction::Load { file } => {
            let wanted = read(file)?;
            let differences = link.load(&wanted)?;
            for difference in &differences {
                console.line(&difference.to_string())?;
            }
            console.line(&format!("{} parameters changed", differences.len()))
        }
        ParameterAction::Diff { file } => {
            let wanted = read(file)?;
            let differences = link.differences(&wanted)?;
            for difference in &differences {
                console.line(&difference.to_string())?;
            }
            if differences.is_empty() {
                Ok(())
            } else {
                Err(CommandError::Checks(format!("{} parameters differ", differences.len())))
            }
        }
    }
}

/// The parameters of a vehicle file, as the board has them.
fn read(file: &Path) -> Result<model::vehicle::VehicleParameters<f32>, CommandError> {
    vehicle_file::read_vehicle(file)
        .map(|vehicle| vehicle.parameters().cast::<f32>())
        .map_err(|error| CommandError::Input(error.to_string()))
}

/// Creates a file that must not exist yet.
fn create_new(file: &Path) -> Result<File, CommandError> {
    File::create_new(file).map_err(|error| CommandError::Input(format!("{}: {error}", file.display())))
}

/// Writes into a file and makes sure that it is there.
fn into_file<R>(
    file: File,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<R, CommandError>,
) -> Result<R, CommandError> {
    let mut out = BufWriter::new(file);
    let written = write(&mut out);
    out.flush()
        .and_then(|()| out.get_ref().sync_all())
        .map_err(|error| CommandError::Other(format!("output: {error}")))?;
    written
}

impl<W: Wire> Link<W> {
    /// Shows the state every half second.
    ///
    /// # Errors
    /// The board falls silent, or the output is closed.
    pub fn show<O: Write>(&mut self, seconds: f64, console: &mut Console<O>) -> Result<(), CommandError> {
        let from_us = self.wire.now_us();
        let until_us = from_us + (seconds * 1e6) as u64;
        let mut next_us = from_us;
        while self.wire.now_us() < until_us && self.interrupts() == 0 {
            let status = self.fresh_status()?;
            if self.wire.now_us() >= next_us {
                console.line(&line(&status))?;
                next_us += SHOW_US;
            }
        }
        Ok(())
    }
}

/// How often the state is shown, us.
const SHOW_US: u64 = 500_000;

/// One line that says who the board is.
pub(in crate::cli) fn who(identity: &Identity) -> String {
    let about = identity.about;
    let [major, minor, patch] = about.version;
    format!(
        "firmware {major}.{minor}.{patch}, build {:08x}, parameters {:08x}, protocol {}",
        about.build, about.schema, identity.protocol
    )
}

/// One line of status.
fn line(status: &BoardStatus) -> String {
    let BoardStatus {
        vehicle, link, clock, ..
    } = status;
    format!(
        "{}: {:.2} m/s, phi {:.1} deg, slope {:.1} deg, {:.1} V; faults {}; blockers {}; link: {} frames, \
         {} unreadable, {} UART errors, {} repeated, {} foreign, {} late, {} requests and {} answers dropped{}",
        vehicle.mode.name(),
        vehicle.estimate.speed_m_s,
        vehicle.estimate.phi_rad.to_degrees(),
        vehicle.estimate.slope_rad.to_degrees(),
        vehicle.battery_v,
        vehicle.faults,
        vehicle.blockers,
        link.frames,
        link.unreadable_frames(),
        link.uart_errors,
        link.repeated_frames,
        link.foreign_frames,
        link.late_orders,
        link.dropped_requests,
        link.dropped_answers,
        match clock {
            ClockSource::External => "",
            ClockSource::Internal => "; no external clock",
        },
    )
}
