//! `hil-sim link`: talks to a drive board over its serial port.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use clap::{Args, Subcommand};
use firmware::drive_board::LINK_BAUD;
use firmware::parameters;
use firmware::protocol::message::{
    BoardStatus, COMMAND_PERIOD_MS, HostMessage, PROTOCOL_VERSION, ParameterAnswer, ParameterRequest,
};
use model::command::Request;
use model::supervise::arming::Mode;
use model::vehicle::{Field, VehicleParameters};

use report::error::CommandError;
use virtual_board::link_client::LinkClient;

/// Flags of `link`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Serial port of the board: /dev/ttyACM0, COM3, ...
    #[arg(long)]
    port: String,
    #[command(subcommand)]
    action: Action,
}

/// What to do over the link.
#[derive(Debug, Subcommand)]
enum Action {
    /// Shows the vehicle's state for a while
    Status {
        /// How long, s
        #[arg(long, default_value_t = 5.0)]
        seconds: f64,
    },
    /// Arms, drives, stops and disarms; Ctrl-C lets the dead-man time stop the vehicle
    Drive {
        /// Speed, m/s, forward positive
        #[arg(long, allow_negative_numbers = true)]
        speed_m_s: f32,
        /// Yaw rate, rad/s, to the left positive
        #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
        yaw_rate_rad_s: f32,
        /// How long, s
        #[arg(long)]
        seconds: f64,
    },
    /// Opens the bridges at once
    Disarm,
    /// Forgets latched faults
    ClearFaults,
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
}

/// How often the drive command is repeated.
const COMMAND_PERIOD: Duration = Duration::from_millis(COMMAND_PERIOD_MS);
/// How long the board may take to answer.
const ANSWER_TIME: Duration = Duration::from_secs(3);

/// A wire with the board at its end.
pub trait Wire: Read + Write {}
impl<T: Read + Write> Wire for T {}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] for a port or parameter that is not there, [`CommandError::Checks`] when the
/// board refuses or does not answer.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let port = serialport::new(&arguments.port, LINK_BAUD)
        .timeout(Duration::from_millis(5))
        .open()
        .map_err(|error| CommandError::Input(format!("--port {}: {error}", arguments.port)))?;
    let mut link = Link::new(port);
    link.identify()?;
    match &arguments.action {
        Action::Status { seconds } => link.show(*seconds),
        Action::Drive {
            speed_m_s,
            yaw_rate_rad_s,
            seconds,
        } => link.drive(*speed_m_s, *yaw_rate_rad_s, *seconds),
        Action::Disarm => link.send(&HostMessage::Request(Request::Disarm)),
        Action::ClearFaults => link.send(&HostMessage::Request(Request::ClearFaults)),
        Action::Parameters { action } => match action {
            ParameterAction::List => {
                for (name, value) in link.parameters()? {
                    println!("{name} = {value}");
                }
                Ok(())
            }
            ParameterAction::Set { assignments } => link.set(assignments),
            ParameterAction::Defaults => {
                link.ask(ParameterRequest::Defaults)?;
                link.store()
            }
        },
    }
}

/// The link over one wire.
pub struct Link<W> {
    wire: W,
    client: LinkClient,
}

impl<W: Wire> Link<W> {
    /// The link over `wire`, whose reads must time out.
    pub fn new(wire: W) -> Self {
        Self {
            wire,
            client: LinkClient::default(),
        }
    }

    fn send(&mut self, message: &HostMessage) -> Result<(), CommandError> {
        self.wire.write_all(&LinkClient::encode(message))?;
        Ok(())
    }

    /// Takes what has come.
    fn receive(&mut self) -> Result<(), CommandError> {
        let mut bytes = [0; 512];
        match self.wire.read(&mut bytes) {
            Ok(length) => self.client.receive(&bytes[..length]),
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
                ) => {}
            Err(error) => return Err(error.into()),
        }
        Ok(())
    }

    /// Receives until `done` finds what it waits for.
    fn wait<T>(&mut self, what: &str, done: impl Fn(&mut LinkClient) -> Option<T>) -> Result<T, CommandError> {
        let since = Instant::now();
        while since.elapsed() < ANSWER_TIME {
            self.receive()?;
            if let Some(found) = done(&mut self.client) {
                return Ok(found);
            }
        }
        Err(CommandError::Checks(format!(
            "no {what} from the board: is it powered, flashed, and this its port?"
        )))
    }

    /// Asks who is there.
    ///
    /// # Errors
    /// No answer, or a firmware of another protocol.
    pub fn identify(&mut self) -> Result<(), CommandError> {
        // A zero ends whatever stands half sent on the wire.
        self.wire.write_all(&[0])?;
        self.send(&HostMessage::Identify)?;
        let protocol = self.wait("identity", |client| client.protocol)?;
        if protocol == PROTOCOL_VERSION {
            Ok(())
        } else {
            Err(CommandError::Checks(format!(
                "the board speaks protocol {protocol}, this tool {PROTOCOL_VERSION}"
            )))
        }
    }

    fn show(&mut self, seconds: f64) -> Result<(), CommandError> {
        let since = Instant::now();
        let mut next = 0.0;
        while since.elapsed().as_secs_f64() < seconds {
            self.receive()?;
            if since.elapsed().as_secs_f64() >= next
                && let Some(status) = self.client.status
            {
                println!("{}", line(&status));
                next += 0.5;
            }
        }
        Ok(())
    }

    /// Arms, drives, stops, disarms.
    ///
    /// # Errors
    /// The board refuses to arm, or leaves the armed state by itself.
    pub fn drive(&mut self, speed_m_s: f32, yaw_rate_rad_s: f32, seconds: f64) -> Result<(), CommandError> {
        self.hold(0.3, 0.0, 0.0)?;
        self.send(&HostMessage::Request(Request::Arm))?;
        self.hold(0.3, 0.0, 0.0)?;
        let status = self.wait("status", |client| client.status)?;
        if status.vehicle.mode != Mode::Armed {
            let blockers = status.vehicle.blockers;
            return Err(CommandError::Checks(format!("not armed: blocked by {blockers}")));
        }
        self.hold(seconds, speed_m_s, yaw_rate_rad_s)?;
        // A controlled stop, then open.
        self.hold(3.0, 0.0, 0.0)?;
        let status = self.wait("status", |client| client.status)?;
        println!("{}", line(&status));
        self.send(&HostMessage::Request(Request::Disarm))?;
        if status.vehicle.mode == Mode::Disarmed {
            let faults = status.vehicle.faults;
            return Err(CommandError::Checks(format!(
                "the vehicle disarmed by itself: {faults}"
            )));
        }
        Ok(())
    }

    /// Repeats one drive command for a while.
    fn hold(&mut self, seconds: f64, speed_m_s: f32, yaw_rate_rad_s: f32) -> Result<(), CommandError> {
        let since = Instant::now();
        let mut sent: Option<Instant> = None;
        while since.elapsed().as_secs_f64() < seconds {
            if sent.is_none_or(|at| at.elapsed() >= COMMAND_PERIOD) {
                self.send(&HostMessage::Drive {
                    speed_m_s,
                    yaw_rate_rad_s,
                })?;
                sent = Some(Instant::now());
            }
            self.receive()?;
        }
        Ok(())
    }

    /// Asks one thing of the parameters.
    ///
    /// # Errors
    /// No answer.
    pub fn ask(&mut self, request: ParameterRequest) -> Result<ParameterAnswer, CommandError> {
        self.client.parameter_answers.clear();
        self.send(&HostMessage::Parameters(request))?;
        self.wait("answer about parameters", |client| client.parameter_answers.pop())
    }

    /// The names of the board's parameters, in the order of their numbers.
    fn names(&mut self) -> Result<Vec<(&'static str, &'static Field)>, CommandError> {
        let ParameterAnswer::Value { schema, .. } = self.ask(ParameterRequest::Read { number: 0 })? else {
            return Err(CommandError::Checks("the board has no parameters".into()));
        };
        let reference = vehicle_file::reference().map_err(|error| CommandError::Other(error.to_string()))?;
        let with_spar = reference.parameters().cast::<f32>();
        let without = VehicleParameters {
            spar: None,
            ..with_spar
        };
        let kind = [with_spar, without]
            .into_iter()
            .find(|kind| parameters::schema(kind) == schema);
        let kind = kind.ok_or_else(|| {
            CommandError::Checks(
                "the board's firmware has other parameters than this tool: build both from one tree".into(),
            )
        })?;
        Ok((0..kind.count()).filter_map(|number| kind.field(number)).collect())
    }

    /// Every parameter by name, `table.name`, with its value.
    ///
    /// # Errors
    /// No answer, or a firmware with other parameters.
    pub fn parameters(&mut self) -> Result<Vec<(String, f32)>, CommandError> {
        let names = self.names()?;
        let mut values = Vec::new();
        for (number, (table, field)) in (0..).zip(names) {
            match self.ask(ParameterRequest::Read { number })? {
                ParameterAnswer::Value { value, .. } => values.push((format!("{table}.{}", field.name), value)),
                other => return Err(refused(&other)),
            }
        }
        Ok(values)
    }

    /// Changes parameters, `table.name=value` each, and stores the set.
    ///
    /// # Errors
    /// An unknown name or a bad value (nothing is changed then), or the board refuses.
    pub fn set(&mut self, assignments: &[String]) -> Result<(), CommandError> {
        let names = self.names()?;
        let mut changes = Vec::new();
        for assignment in assignments {
            let bad = |why: String| CommandError::Input(format!("{assignment}: {why}"));
            let (name, text) = assignment
                .split_once('=')
                .ok_or_else(|| bad("expected table.name=value".into()))?;
            let (number, (_, field)) = (0_u16..)
                .zip(&names)
                .find(|(_, (table, field))| name == format!("{table}.{}", field.name))
                .ok_or_else(|| bad("unknown parameter; `parameters list` shows them".into()))?;
            let value: f64 = text.parse().unwrap_or(f64::NAN);
            if !field.allows(value) {
                return Err(bad(format!("allowed is {} to {}", field.min, field.max)));
            }
            changes.push((number, value as f32));
        }
        for (number, value) in changes {
            match self.ask(ParameterRequest::Write { number, value })? {
                ParameterAnswer::Value { .. } => {}
                other => return Err(refused(&other)),
            }
        }
        self.store()
    }

    fn store(&mut self) -> Result<(), CommandError> {
        match self.ask(ParameterRequest::Store)? {
            ParameterAnswer::Stored => Ok(()),
            other => Err(refused(&other)),
        }
    }
}

fn refused(answer: &ParameterAnswer) -> CommandError {
    CommandError::Checks(match answer {
        ParameterAnswer::Armed => "refused: the vehicle is armed".into(),
        ParameterAnswer::FlashFailed => "the board's flash failed; the set in force stays".into(),
        ParameterAnswer::OutOfRange { min, max } => format!("refused: allowed is {min} to {max}"),
        ParameterAnswer::Inconsistent { number } => {
            format!("refused: the set contradicts itself at parameter {number} of `parameters list`, counted from 0")
        }
        other => format!("refused: {other:?}"),
    })
}

/// One line of status.
fn line(status: &BoardStatus) -> String {
    let BoardStatus { vehicle, link, .. } = status;
    format!(
        "{}: {:.2} m/s, phi {:.1} deg, slope {:.1} deg, {:.1} V; faults {}; blockers {}; \
         link: {} frames, {} unreadable, {} UART errors, {} requests dropped",
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
        link.dropped_requests,
    )
}
