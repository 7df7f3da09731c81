//! The ports at which clients come: each has threads of its own, so that a client that does not read holds up nobody.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
#[cfg(unix)]
use std::sync::Arc;
#[cfg(unix)]
use std::sync::atomic::AtomicBool;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, TrySendError, sync_channel};
use std::thread;
#[cfg(unix)]
use std::time::Duration;

use report::error::CommandError;

use super::hub::ClientId;

/// Pieces of output that wait for a client that does not read; further ones are lost to it.
pub(super) const WAITING_MAX: usize = 256;

/// What happens at a port.
pub enum PortEvent {
    /// A client came; its name, and where its bytes go.
    Came(ClientId, String, ClientOutput),
    /// A client sent something.
    Said(ClientId, Vec<u8>),
    /// A client is gone.
    Left(ClientId),
}

/// The way to one client.
#[derive(Debug, Clone)]
pub struct ClientOutput(SyncSender<Vec<u8>>);

impl ClientOutput {
    /// What is sent waits in `output` for the thread that writes it.
    pub(super) fn new(output: SyncSender<Vec<u8>>) -> Self {
        Self(output)
    }

    /// Sends bytes; a client that does not read loses them. Whether the client is still there.
    pub fn send(&self, bytes: &[u8]) -> bool {
        !matches!(self.0.try_send(bytes.to_vec()), Err(TrySendError::Disconnected(_)))
    }
}

/// Numbers clients in the order of coming.
static CLIENTS: AtomicU64 = AtomicU64::new(1);

/// The number of the next client.
pub(super) fn next_client() -> ClientId {
    CLIENTS.fetch_add(1, Ordering::Relaxed)
}

/// Writes what waits for a client until the client or the server is gone.
fn write_all(waiting: &Receiver<Vec<u8>>, mut to: impl Write) {
    while let Ok(bytes) = waiting.recv() {
        if to.write_all(&bytes).is_err() {
            return;
        }
    }
}

/// Reads what a client says until it or the server is gone.
fn read_all(client: ClientId, mut from: impl Read, events: &Sender<PortEvent>) {
    let mut bytes = [0; 1024];
    loop {
        match from.read(&mut bytes) {
            Ok(0) => break,
            Ok(length) => {
                if events.send(PortEvent::Said(client, bytes[..length].to_vec())).is_err() {
                    return;
                }
            }
            Err(error) if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::TimedOut) => {}
            Err(_) => break,
        }
    }
    let _ = events.send(PortEvent::Left(client));
}

/// Begins to serve one client.
pub type Serve = fn(TcpStream, Sender<PortEvent>) -> std::io::Result<()>;

/// Listens at the address that `flag` names, lets `serve` begin with each client, and returns the address, with the port
/// that the system chose for port 0.
///
/// # Errors
/// [`CommandError::Input`]: the address is taken, or not of this machine.
pub fn listen(
    flag: &str,
    address: SocketAddr,
    events: Sender<PortEvent>,
    serve: Serve,
) -> Result<SocketAddr, CommandError> {
    let wrong = |error: std::io::Error| CommandError::Input(format!("{flag} {address}: {error}"));
    let listener = TcpListener::bind(address).map_err(wrong)?;
    let bound = listener.local_addr().map_err(wrong)?;
    thread::spawn(move || {
        for stream in listener.incoming() {
            let Ok(stream) = stream else { continue };
            let came = serve(stream, events.clone());
            if came.is_err() && events.send(PortEvent::Left(0)).is_err() {
                return;
            }
        }
    });
    Ok(bound)
}

/// Starts the two threads of a TCP client.
///
/// # Errors
/// Those of the socket.
pub fn serve_tcp(stream: TcpStream, events: Sender<PortEvent>) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let name = format!("tcp {}", stream.peer_addr()?);
    let (writer, client) = (stream.try_clone()?, next_client());
    let (output, waiting) = sync_channel(WAITING_MAX);
    if events.send(PortEvent::Came(client, name, ClientOutput(output))).is_ok() {
        thread::spawn(move || write_all(&waiting, writer));
        thread::spawn(move || read_all(client, stream, &events));
    }
    Ok(())
}

/// Opens a pseudo-terminal and returns the name of its other end, which a client opens like a serial port.
///
/// # Errors
/// [`CommandError::Other`]: the system gives none.
#[cfg(unix)]
pub fn open_pty(events: Sender<PortEvent>) -> Result<String, CommandError> {
    use serialport::{SerialPort, TTYPort};

    let failed = |error: serialport::Error| CommandError::Other(format!("--pty: {error}"));
    let (mut board, other) = TTYPort::pair().map_err(failed)?;
    board.set_timeout(LOOK).map_err(failed)?;
    let name = other.name().unwrap_or_default();
    // Closed, so that the board's end tells whether a client is there.
    drop(other);
    let client_name = format!("pty {name}");
    thread::spawn(move || serve_pty(board, &client_name, &events));
    Ok(name)
}

/// Between two looks whether somebody has opened a pseudo-terminal's other end.
#[cfg(unix)]
const LOOK: Duration = Duration::from_millis(20);

/// Serves one client of the pseudo-terminal after the other, until the server is gone.
#[cfg(unix)]
fn serve_pty(mut board: serialport::TTYPort, name: &str, events: &Sender<PortEvent>) {
    let mut bytes = [0; 1024];
    let mut client: Option<(ClientId, Arc<AtomicBool>)> = None;
    loop {
        let read = board.read(&mut bytes);
        let there = match &read {
            Ok(length) => *length > 0,
            Err(error) => matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::TimedOut),
        };
        if !there {
            // Nobody has the other end open.
            if let Some((gone, open)) = client.take() {
                open.store(false, Ordering::Relaxed);
                if events.send(PortEvent::Left(gone)).is_err() {
                    return;
                }
            }
            thread::sleep(LOOK);
            continue;
        }
        if client.is_none() {
            let Ok(writer) = board.try_clone_native() else { return };
            let (output, waiting) = sync_channel(WAITING_MAX);
            let (id, open) = (next_client(), Arc::new(AtomicBool::new(true)));
            let still = open.clone();
            thread::spawn(move || write_pty(&waiting, writer, &still));
            if events
                .send(PortEvent::Came(id, name.to_owned(), ClientOutput(output)))
                .is_err()
            {
                return;
            }
            client = Some((id, open));
        }
        if let (Some((id, _)), Ok(length)) = (&client, read)
            && events.send(PortEvent::Said(*id, bytes[..length].to_vec())).is_err()
        {
            return;
        }
    }
}

/// Writes what waits for a client of the pseudo-terminal until the client or the server is gone.
#[cfg(unix)]
fn write_pty(waiting: &Receiver<Vec<u8>>, mut to: serialport::TTYPort, still: &AtomicBool) {
    while let Ok(bytes) = waiting.recv() {
        // What a client that has left would have read is nobody's.
        if !still.load(Ordering::Relaxed) {
            return;
        }
        match to.write_all(&bytes) {
            // The client does not read: it loses this.
            Err(error) if error.kind() == ErrorKind::TimedOut => {}
            Err(_) => return,
            Ok(()) => {}
        }
    }
}

/// No pseudo-terminals on this system.
///
/// # Errors
/// Always [`CommandError::Input`].
#[cfg(not(unix))]
pub fn open_pty(_events: Sender<PortEvent>) -> Result<String, CommandError> {
    Err(CommandError::Input(
        "--pty: this system has no pseudo-terminals; --tcp works".into(),
    ))
}
