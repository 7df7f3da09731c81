//! What the link tool runs on: a wire with the board at its end, and a clock.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use firmware::drive_board::LINK_BAUD;
use report::error::CommandError;
use serialport::ClearBuffer;

use super::websocket::WebSocketStream;

/// A wire with the board at its end, and the host's clock.
pub trait Wire {
    /// Sends bytes.
    ///
    /// # Errors
    /// The wire is gone.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;
    /// Receives what has come, waiting some milliseconds at most; returns its length.
    ///
    /// # Errors
    /// The wire is gone.
    fn receive(&mut self, bytes: &mut [u8]) -> io::Result<usize>;
    /// The host's time, us from any fixed start.
    fn now_us(&self) -> u64;
}

/// How long a read waits for bytes, and a write for room.
const WIRE_PATIENCE: Duration = Duration::from_millis(5);

/// Bytes both ways.
trait Stream: Read + Write {}
impl<T: Read + Write> Stream for T {}

/// How the ports of a served board begin: `tcp:127.0.0.1:5760`, `ws://127.0.0.1:5761`.
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
    /// [`CommandError::Input`]: there is no such port, or it is taken.
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
            // What came before the tool did is old.
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

/// Connects to whoever listens at HOST:PORT.
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

/// Why a name is no port that opens, and what to do about it.
fn not_opened(name: &str, error: &serialport::Error) -> String {
    if name.starts_with("wss:") {
        return "no encrypted WebSocket is spoken; a served board is ws://HOST:PORT".into();
    }
    // What the system says of a thing that is no terminal ("Not a typewriter") helps nobody.
    if std::fs::metadata(name).is_ok() {
        return match error.kind() {
            serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => {
                format!("{error}; on Linux, serial ports belong to a group, often `dialout`")
            }
            serialport::ErrorKind::NoDevice => format!("{error}; another program may have opened it"),
            _ => "is no serial port".into(),
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

/// Whether an access only took too long.
fn is_passing(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
    )
}

/// What a connection's end means.
const CLOSED: &str = "the other end has closed the connection: is a board served at this port?";

/// What the system says of a port that is no more ("Broken pipe"), and what it means. Only a connection is reset.
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
            // A wire that takes nothing loses the frame; the board's silence then shows what that means.
            Err(error) if is_passing(&error) => Ok(()),
            result => result.map_err(|error| gone(&error)),
        }
    }

    fn receive(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self.port.read(bytes) {
            Err(error) if is_passing(&error) => Ok(0),
            // A port that is read without waiting has nothing; a connection that has nothing to give is closed.
            Ok(0) => Err(io::Error::new(ErrorKind::UnexpectedEof, CLOSED)),
            result => result.map_err(|error| gone(&error)),
        }
    }

    fn now_us(&self) -> u64 {
        self.opened.elapsed().as_micros() as u64
    }
}
