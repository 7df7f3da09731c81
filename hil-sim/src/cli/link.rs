//! `hil-sim link`: talks to a drive board over its serial port, or to a served board.
#![deny(clippy::print_stdout)] // A closed output is an error, not a panic: all output goes through the console.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use clap::{Args, Subcommand};
use firmware::protocol::message::Order;
use model::command::Request;
use report::error::CommandError;
use report::files::refuse_existing;

pub mod console;
pub mod drive;
mod files;
pub mod memory;
mod parameter_actions;
pub mod parameters;
pub mod recording;
pub mod session;
pub mod status;
pub mod update;
mod websocket;
pub mod wire;

use console::Console;
use drive::{DriveJob, check_seconds};
use files::into_new_record;
use parameter_actions::{ParameterAction, parameters_of};
use session::Link;
pub(in crate::cli) use status::who;
use status::{StatusDetail, line};
use update::Update;
use wire::{Port, Wire};

/// Flags of `link`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Serial port of the board: /dev/ttyACM0, COM3, ...; or tcp:HOST:PORT or ws://HOST:PORT of a served one. Always needed
    #[arg(long, global = true)]
    port: Option<String>,
    #[command(subcommand)]
    action: LinkCommand,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim link --port /dev/ttyACM0 status
  hil-sim link --port tcp:127.0.0.1:5760 drive --speed-m-s 0.3 --seconds 5
  hil-sim link --port /dev/ttyACM0 log
  hil-sim link --port /dev/ttyACM0 record --out drive.mcap
  hil-sim link --port /dev/ttyACM0 parameters dump my-vehicle.toml";

const STATUS_EXAMPLES: &str = "\
Examples:
  hil-sim link --port /dev/ttyACM0 status
  hil-sim link --port /dev/ttyACM0 status --all --seconds 60";

const DRIVE_EXAMPLES: &str = "\
Examples:
  hil-sim link --port /dev/ttyACM0 drive --speed-m-s 0.3 --seconds 5
  hil-sim link --port /dev/ttyACM0 drive --speed-m-s 0.3 --seconds 5 --record drive.mcap
  hil-sim link --port /dev/ttyACM0 drive --speed-m-s 0 --yaw-rate-rad-s -0.5 --seconds 3";

const RECORD_EXAMPLES: &str = "\
Examples:
  hil-sim link --port /dev/ttyACM0 record --out drive.mcap --seconds 60
  hil-sim replay drive.mcap";

const LOOK_BACK_EXAMPLES: &str = "\
Examples:
  hil-sim link --port /dev/ttyACM0 look-back --out fault.rec
  hil-sim replay fault.rec --csv fault.csv";

const UPDATE_EXAMPLES: &str = "\
Examples:
  hil-sim link --port /dev/ttyACM0 update target/thumbv7em-none-eabihf/release/drive-board";

const PARAMETER_EXAMPLES: &str = "\
Examples:
  hil-sim link --port /dev/ttyACM0 parameters list
  hil-sim link --port /dev/ttyACM0 parameters set control.speed_max_m_s=1 control.comfort_s=0.2
  hil-sim link --port /dev/ttyACM0 parameters dump my-vehicle.toml
  hil-sim link --port /dev/ttyACM0 parameters diff my-vehicle.toml
  hil-sim link --port /dev/ttyACM0 parameters load my-vehicle.toml";

/// What to do over the link.
#[derive(Debug, Subcommand)]
enum LinkCommand {
    /// Shows the vehicle's status for a while; exit code 1 if the board falls silent
    #[command(after_help = STATUS_EXAMPLES)]
    Status {
        /// Also distance, place, heading, spar, currents, voltages, limits, and the terms of the control laws
        #[arg(long)]
        all: bool,
        /// How long, s
        #[arg(long, default_value_t = 5.0, allow_negative_numbers = true)]
        seconds: f64,
    },
    /// Arms, drives, stops and disarms; Ctrl-C stops the vehicle, a second one disarms it at once
    #[command(after_help = DRIVE_EXAMPLES)]
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
        /// Record every tick meanwhile: NAME.mcap for other tools, any other name for the link's own frames; must not
        /// exist
        #[arg(long, value_name = "FILE")]
        record: Option<PathBuf>,
    },
    /// Opens the bridges at once
    #[command(after_help = "Examples:\n  hil-sim link --port /dev/ttyACM0 disarm")]
    Disarm,
    /// Clears latched faults
    #[command(after_help = "Examples:\n  hil-sim link --port /dev/ttyACM0 clear-faults")]
    ClearFaults,
    /// Shows the board's log since its boot
    #[command(after_help = "Examples:\n  hil-sim link --port /dev/ttyACM0 log")]
    Log,
    /// Shows the last faults, which the board keeps over resets
    #[command(after_help = "Examples:\n  hil-sim link --port /dev/ttyACM0 faults")]
    Faults,
    /// Writes the record of every tick and the log to a file; into a .mcap file also status, terms of the laws and events
    #[command(after_help = RECORD_EXAMPLES)]
    Record {
        /// The file, NAME.mcap for other tools, any other name for the link's own frames; must not exist
        #[arg(long)]
        out: PathBuf,
        /// How long, s; Ctrl-C ends it before
        #[arg(long, default_value_t = 3600.0, allow_negative_numbers = true)]
        seconds: f64,
    },
    /// Writes the records of the last 2 s before a fault to a file
    #[command(after_help = LOOK_BACK_EXAMPLES)]
    LookBack {
        /// The file; must not exist
        #[arg(long)]
        out: PathBuf,
    },
    /// Sends a sealed firmware to the board, which installs it and goes back to its own if the new one does not come up
    #[command(after_help = UPDATE_EXAMPLES)]
    Update {
        /// The firmware's ELF, as `.ci/build-board` has built and sealed it
        file: PathBuf,
    },
    /// Reads, changes and stores parameters
    #[command(after_help = PARAMETER_EXAMPLES)]
    Parameters {
        #[command(subcommand)]
        action: ParameterAction,
    },
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] for an invalid number, port, file or parameter, [`CommandError::Checks`] when the board
/// refuses, reports a fault or falls silent, [`CommandError::Other`] when the output is closed.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let begin = |port: &str| Ok(Link::new(Port::open(port)?, nonce(), interrupts()?));
    run_on(arguments, begin, &mut Console(io::stdout()))
}

/// Runs the command over the link that `begin` opens at the port of the command line. The link's wire provides the clock,
/// and the console is the only output.
///
/// # Errors
/// As [`run`].
pub fn run_on<W: Wire, O: Write>(
    arguments: &Arguments,
    begin: impl FnOnce(&str) -> Result<Link<W>, CommandError>,
    console: &mut Console<O>,
) -> Result<(), CommandError> {
    // The tool reports errors in the command line before it opens the port.
    let port = arguments.port.as_deref().ok_or_else(|| {
        CommandError::Input(
            "--port is missing: a serial port, as /dev/ttyACM0, or a served tcp:HOST:PORT or ws://HOST:PORT".into(),
        )
    })?;
    let job = Job::new(&arguments.action)?;
    job.run(begin(port)?, console)
}

/// A number that no tool has used before on this board, made from the time and the process.
pub(in crate::cli) fn nonce() -> u32 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    (since.as_micros() as u32) ^ std::process::id().rotate_left(16)
}

/// Counts the user's requests to stop, so that they do not end the program before its Disarm.
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
    Status(f64, StatusDetail),
    Drive(DriveJob, Option<&'a Path>),
    Disarm,
    ClearFaults,
    Log,
    Faults,
    Record(&'a Path, f64),
    LookBack(&'a Path),
    Update(Update),
    Parameters(&'a ParameterAction),
}

impl<'a> Job<'a> {
    fn new(action: &'a LinkCommand) -> Result<Self, CommandError> {
        Ok(match action {
            LinkCommand::Status { all, seconds } => {
                let detail = if *all { StatusDetail::All } else { StatusDetail::Line };
                Self::Status(check_seconds(*seconds)?, detail)
            }
            LinkCommand::Drive {
                speed_m_s,
                yaw_rate_rad_s,
                seconds,
                record,
            } => {
                if let Some(file) = record {
                    refuse_existing("--record", file)?;
                }
                Self::Drive(DriveJob::new(*speed_m_s, *yaw_rate_rad_s, *seconds)?, record.as_deref())
            }
            LinkCommand::Disarm => Self::Disarm,
            LinkCommand::ClearFaults => Self::ClearFaults,
            LinkCommand::Log => Self::Log,
            LinkCommand::Faults => Self::Faults,
            LinkCommand::Record { out, seconds } => {
                refuse_existing("--out", out)?;
                Self::Record(out, check_seconds(*seconds)?)
            }
            LinkCommand::LookBack { out } => {
                refuse_existing("--out", out)?;
                Self::LookBack(out)
            }
            LinkCommand::Update { file } => Self::Update(Update::read(file)?),
            LinkCommand::Parameters { action } => Self::Parameters(action),
        })
    }

    fn run<W: Wire, O: Write>(self, mut link: Link<W>, console: &mut Console<O>) -> Result<(), CommandError> {
        if let Self::Disarm = self {
            // Disarm comes before anything else, whichever board answers.
            link.disarm()?;
            return link
                .client
                .status
                .map_or(Ok(()), |status| console.coloured_line(&line(&status)));
        }
        let identity = link.identify()?;
        match self {
            Self::Disarm => Ok(()),
            Self::Status(seconds, detail) => {
                console.line(&who(&identity))?;
                link.show(seconds, detail, console)
            }
            Self::Drive(drive, None) => link.drive(&drive, console),
            Self::Drive(drive, Some(file)) => {
                let recorded = into_new_record("--record", file, |out| link.drive_recorded(&drive, out, console))?;
                console.line(&recorded.line())
            }
            Self::ClearFaults => {
                link.order(Order::Request(Request::ClearFaults))?;
                let status = link.fresh_status()?;
                console.coloured_line(&line(&status))
            }
            Self::Log => link.show_log(console),
            Self::Faults => link.show_faults(console),
            Self::Record(file, seconds) => {
                let recorded = into_new_record("--out", file, |out| link.record(seconds, out))?;
                console.line(&recorded.line())
            }
            Self::LookBack(file) => {
                let recorded = into_new_record("--out", file, |out| link.look_back(out))?;
                console.line(&recorded.line())
            }
            Self::Update(update) => {
                console.line(&who(&identity))?;
                link.update(&update, console)
            }
            Self::Parameters(action) => parameters_of(&mut link, action, console),
        }
    }
}
