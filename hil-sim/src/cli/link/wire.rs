//! What the link tool runs on: a wire with the board at its end, and a clock.

use std::io::{self, ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use firmware::drive_board::LINK_BAUD;
use report::error::CommandError;
use serialport::SerialPort;

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
const PATIENCE: Duration = Duration::from_millis(5);

/// A serial port, and the host's monotonic clock.
pub struct Port {
    port: Box<dyn SerialPort>,
    opened: Instant,
}

impl Port {
    /// Opens a port by its name.
    ///
    /// # Errors
    /// [`CommandError::Input`]: there is no such port, or it is taken.
    pub fn open(name: &str) -> Result<Self, CommandError> {
        let port = serialport::new(name, LINK_BAUD)
            .timeout(PATIENCE)
            .open()
            .map_err(|error| CommandError::Input(format!("--port {name}: {error}")))?;
        Ok(Self {
            port,
            opened: Instant::now(),
        })
    }
}

/// Whether an access only took too long.
fn is_passing(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
    )
}

impl Wire for Port {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self.port.write_all(bytes) {
            // A wire that takes nothing loses the frame; what that means, the board's silence tells.
            Err(error) if is_passing(&error) => Ok(()),
            result => result,
        }
    }

    fn receive(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self.port.read(bytes) {
            Err(error) if is_passing(&error) => Ok(0),
            result => result,
        }
    }

    fn now_us(&self) -> u64 {
        self.opened.elapsed().as_micros() as u64
    }
}
