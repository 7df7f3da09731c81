//! The link tool's environment: a wire to the board, and a clock.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use firmware::drive_board::LINK_BAUD;
use report::error::CommandError;
use serialport::ClearBuffer;

use super::websocket::WebSocketStream;

/// A wire to the board, and the host's clock.
pub trait Wire {
    /// Sends bytes.
    ///
    /// # Errors
    /// The wire is lost.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;
    /// Receives the bytes that have arrived, and waits for some milliseconds at most; returns their number.
    ///
    /// # Errors
    /// The wire is lost.
    fn receive(&mut self, bytes: &mut [u8]) -> io::Result<usize>;
    /// The host's time, us from any fixed start.
    fn now_us(&self) -> u64;
}

/// Longest wait of a read for bytes, and of a write for room.
const WIRE_PATIENCE: Duration = Duration::from_millis(5);

/// Bytes both ways.
trait Stream: Read + Write {}
impl<T: Read + Write> Stream for T {}

/// Prefixes of a served board's ports: `tcp:127.0.0.1:5760`, `ws://127.0.0.1:5761`.
const TCP_SCHEME: &str = "tcp:";
const WEBSOCKET_SCHEME: &str = "ws:";

/// A serial port, or a connection to a served board, and the host's monotonic clock.
pub struct Port {
    port: Box<dyn Stream>,
    opened: Instant,
}

impl Port {
    /// Opens a port by its name, or connects to the board that `hil-sim serve` serves at `tcp:ADDRESS` or `ws://ADDRESS`.
    ///
    /// # Errors
    /// [`CommandError::Input`]: the port does not exist, or is in use.
    pub fn open(name: &str) -> Result<Self, CommandError> {
        let wrong = |why: &str| CommandError::Input(format!("--port {name}: {why}"));
        let port: Box<dyn Stream> = if let Some(address) = name.strip_prefix(TCP_SCHEME) {
            if !is_host_and_port(address) {
                return Err(wrong("allowed is tcp:HOST:PORT, as tcp:127.0.0.1:5760"));
            }
            let stream = connect(address).map_err(|why| wrong(&why))?;
            stream
                .set_read_timeout(Some(WIRE_PATIENCE))
                .and_then(|()| stream.set_write_timeout(Some(WIRE_PATIENCE)))
                .map_err(|error| wrong(&error.to_string()))?;
            Box::new(stream)
        } else if let Some(address) = name.strip_prefix(WEBSOCKET_SCHEME) {
            let address = address.strip_prefix("//").unwrap_or_default();
            let address = address.strip_suffix('/').unwrap_or(address);
            if !is_host_and_port(address) {
                return Err(wrong("allowed is ws://HOST:PORT, as ws://127.0.0.1:5761"));
            }
            let stream = connect(address).map_err(|why| wrong(&why))?;
            Box::new(WebSocketStream::greet(stream, address, WIRE_PATIENCE).map_err(|why| wrong(&why))?)
        } else {
            let port = serialport::new(name, LINK_BAUD)
                .timeout(WIRE_PATIENCE)
                .open()
                .map_err(|error| wrong(&not_opened(name, &error)))?;
            // Bytes from before the tool's start are old.
            port.clear(ClearBuffer::Input)
                .map_err(|error| wrong(&error.to_string()))?;
            Box::new(port)
        };
        Ok(Self {
            port,
            opened: Instant::now(),
        })
    }
}

/// Connects to the listener at HOST:PORT.
fn connect(address: &str) -> Result<TcpStream, String> {
    let stream = TcpStream::connect(address).map_err(|error| match error.kind() {
        ErrorKind::ConnectionRefused => {
            "nobody listens there: `hil-sim serve` must run, and prints its ports".to_owned()
        }
        _ => error.to_string(),
    })?;
    stream.set_nodelay(true).map_err(|error| error.to_string())?;
    Ok(stream)
}

/// Why a port cannot be opened, and the remedy.
fn not_opened(name: &str, error: &serialport::Error) -> String {
    if name.starts_with("wss:") {
        return "no encrypted WebSocket is spoken; a served board is ws://HOST:PORT".into();
    }
    // The system's message about a file that is not a terminal ("Not a typewriter") does not help.
    if std::fs::metadata(name).is_ok() {
        return match error.kind() {
            serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => {
                format!("{error}; on Linux, serial ports belong to a group, often `dialout`")
            }
            serialport::ErrorKind::NoDevice => format!("{error}; another program may have opened it"),
            _ => "is not a serial port".into(),
        };
    }
    if is_host_and_port(name) {
        return format!("no such port; a served board is {TCP_SCHEME}{name}");
    }
    let there: Vec<String> = serialport::available_ports()
        .unwrap_or_default()
        .into_iter()
        .map(|port| port.port_name)
        .collect();
    match &there[..] {
        [] => format!("{error}; this machine has no serial port"),
        there => format!("{error}; this machine has {}", there.join(", ")),
    }
}

/// Whether `address` is HOST:PORT.
fn is_host_and_port(address: &str) -> bool {
    address
        .rsplit_once(':')
        .is_some_and(|(host, port)| !host.is_empty() && !host.contains('/') && port.parse::<u16>().is_ok())
}

/// Whether an access only timed out.
fn is_passing(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
    )
}

/// Meaning of a connection's end.
const CLOSED: &str = "the other end has closed the connection: is a board served at this port?";

/// Adds the meaning to the system's message about a lost port ("Broken pipe"). Only a connection can be reset.
fn gone(error: &io::Error) -> io::Error {
    let meaning = match error.kind() {
        ErrorKind::ConnectionReset | ErrorKind::ConnectionAborted => CLOSED.to_owned(),
        _ => format!("the port is gone ({error}): is the cable in, and the board powered?"),
    };
    io::Error::new(error.kind(), meaning)
}

impl Wire for Port {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self.port.write_all(bytes) {
            // A wire that accepts nothing loses the frame. The board's silence then shows the consequence.
            Err(error) if is_passing(&error) => Ok(()),
            result => result.map_err(|error| gone(&error)),
        }
    }

    fn receive(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self.port.read(bytes) {
            Err(error) if is_passing(&error) => Ok(0),
            // A serial port returns no bytes when none have arrived. A connection that returns no bytes is closed.
            Ok(0) => Err(io::Error::new(ErrorKind::UnexpectedEof, CLOSED)),
            result => result.map_err(|error| gone(&error)),
        }
    }

    fn now_us(&self) -> u64 {
        self.opened.elapsed().as_micros() as u64
    }
}
