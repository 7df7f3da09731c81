//! The ports for clients. Each client has its own threads, so that a client that does not read delays nobody.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
#[cfg(unix)]
use std::sync::Arc;
#[cfg(unix)]
use std::sync::atomic::AtomicBool;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread;
#[cfg(unix)]
use std::time::Duration;

use report::error::CommandError;

use super::hub::ClientId;

/// Largest number of pieces of output that wait for a client that does not read. The client loses further pieces.
pub(super) const WAITING_MAX: usize = 256;

/// Largest number of events that the server has not taken yet. Clients that send more wait.
pub const HAPPENED_MAX: usize = 256;

/// An event at a port.
pub enum PortEvent {
    /// A client connected: its name, and its output.
    Came(ClientId, String, ClientOutput),
    /// A client sent something.
    Said(ClientId, Vec<u8>),
    /// A client disconnected.
    Left(ClientId),
}

/// Output to one client.
#[derive(Debug, Clone)]
pub struct ClientOutput(SyncSender<Vec<u8>>);

impl ClientOutput {
    /// Sent bytes wait in `output` for the thread that writes them.
    pub(super) fn new(output: SyncSender<Vec<u8>>) -> Self {
        Self(output)
    }

    /// Sends bytes, which a client that does not read loses; returns whether the client is still connected.
    pub fn send(&self, bytes: &[u8]) -> bool {
        !matches!(self.0.try_send(bytes.to_vec()), Err(TrySendError::Disconnected(_)))
    }
}

/// Numbers clients in the order of connection.
static CLIENTS: AtomicU64 = AtomicU64::new(1);

/// The number of the next client.
pub(super) fn next_client() -> ClientId {
    CLIENTS.fetch_add(1, Ordering::Relaxed)
}

/// Writes the waiting output of a client until the client or the server ends.
fn write_all(waiting: &Receiver<Vec<u8>>, mut to: impl Write) {
    while let Ok(bytes) = waiting.recv() {
        if to.write_all(&bytes).is_err() {
            return;
        }
    }
}

/// Reads a client's bytes until the client or the server ends.
fn read_all(client: ClientId, mut from: impl Read, events: &SyncSender<PortEvent>) {
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

/// Starts to serve one client.
pub type Serve = fn(TcpStream, SyncSender<PortEvent>) -> std::io::Result<()>;

/// Listens at the address that `flag` names, calls `serve` for each client, and returns the address, with the port that
/// the system chose for port 0.
///
/// # Errors
/// [`CommandError::Input`]: the address is in use, or does not belong to this machine.
pub fn listen(
    flag: &str,
    address: SocketAddr,
    events: SyncSender<PortEvent>,
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
/// The socket's errors.
pub fn serve_tcp(stream: TcpStream, events: SyncSender<PortEvent>) -> std::io::Result<()> {
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
/// [`CommandError::Other`]: the system provides no pseudo-terminal.
#[cfg(unix)]
pub fn open_pty(events: SyncSender<PortEvent>) -> Result<String, CommandError> {
    use serialport::{SerialPort, TTYPort};

    let failed = |error: serialport::Error| CommandError::Other(format!("--pty: {error}"));
    let (mut board, other) = TTYPort::pair().map_err(failed)?;
    board.set_timeout(LOOK).map_err(failed)?;
    let name = other.name().unwrap_or_default();
    // Closed, so that the board's end shows whether a client is connected.
    drop(other);
    let client_name = format!("pty {name}");
    thread::spawn(move || serve_pty(board, &client_name, &events));
    Ok(name)
}

/// Time between two checks whether a client has opened the pseudo-terminal's other end.
#[cfg(unix)]
const LOOK: Duration = Duration::from_millis(20);

/// Serves one client of the pseudo-terminal after the other, until the server ends.
#[cfg(unix)]
fn serve_pty(mut board: serialport::TTYPort, name: &str, events: &SyncSender<PortEvent>) {
    let mut bytes = [0; 1024];
    let mut client: Option<(ClientId, Arc<AtomicBool>)> = None;
    loop {
        let read = board.read(&mut bytes);
        let there = match &read {
            Ok(length) => *length > 0,
            Err(error) => matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::TimedOut),
        };
        if !there {
            // No client has the other end open.
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

/// Writes the waiting output of a client of the pseudo-terminal until the client or the server ends.
#[cfg(unix)]
fn write_pty(waiting: &Receiver<Vec<u8>>, mut to: serialport::TTYPort, still: &AtomicBool) {
    while let Ok(bytes) = waiting.recv() {
        // Output for a client that has left is dropped.
        if !still.load(Ordering::Relaxed) {
            return;
        }
        match to.write_all(&bytes) {
            // The client does not read and loses this output.
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
pub fn open_pty(_events: SyncSender<PortEvent>) -> Result<String, CommandError> {
    Err(CommandError::Input(
        "--pty: this system has no pseudo-terminals; --tcp works".into(),
    ))
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;
    use std::sync::mpsc::Receiver;
    use std::time::Duration;

    use tungstenite::Message;

    use super::super::websocket::serve_websocket;
    use super::*;

    /// After this time a test fails instead of hanging. It is not a measured bound.
    const GIVE_UP: Duration = Duration::from_mins(1);
    const PIECE: usize = 16 << 10;
    /// Pieces that are sent to a client that does not read, 64 MB: more than the system keeps for a connection, some MB on
    /// each side of it, and more than waits in the server.
    const PIECES: u32 = 4096;

    /// A port, and its events.
    fn port(serve: Serve) -> (SocketAddr, Receiver<PortEvent>) {
        let (events, happened) = sync_channel(HAPPENED_MAX);
        let any = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        (listen("--tcp", any, events, serve).expect("a port"), happened)
    }

    fn came(happened: &Receiver<PortEvent>) -> ClientOutput {
        match happened.recv_timeout(GIVE_UP).expect("a client") {
            PortEvent::Came(_, _, output) => output,
            PortEvent::Said(..) | PortEvent::Left(_) => panic!("nobody has come yet"),
        }
    }

    /// Sends numbered pieces while nobody reads. The test's end shows that nobody waits for the client.
    fn send_all(output: &ClientOutput) {
        for number in 0..PIECES {
            assert!(output.send(&piece(number)), "the client is there");
            // A board pauses too, which gives the port's thread time to fill all available room.
            thread::sleep(Duration::from_micros(100));
        }
    }

    fn piece(number: u32) -> Vec<u8> {
        let mut piece = vec![0; PIECE];
        piece[..4].copy_from_slice(&number.to_le_bytes());
        piece
    }

    /// Sends the last piece until the client, which reads again, has received it; returns the number of pieces received
    /// by then.
    fn heard_again(output: &ClientOutput, mut hear: impl FnMut() -> Vec<u8> + Send + 'static) -> usize {
        let (told, heard) = std::sync::mpsc::channel();
        thread::spawn(move || {
            let mut pieces = 0;
            loop {
                let piece = hear();
                assert_eq!(piece.len(), PIECE, "whole pieces");
                pieces += 1;
                if piece[..4] == PIECES.to_le_bytes() {
                    let _ = told.send(pieces);
                    return;
                }
            }
        });
        let begun = std::time::Instant::now();
        loop {
            output.send(&piece(PIECES));
            if let Ok(pieces) = heard.recv_timeout(Duration::from_millis(5)) {
                return pieces;
            }
            assert!(begun.elapsed() < GIVE_UP, "the client hears nothing any more");
        }
    }

    /// A client that does not read delays nobody and takes bounded room. When it reads again, it receives new output.
    #[test]
    fn a_client_that_does_not_read_loses_what_there_is_no_room_for() {
        let (address, happened) = port(serve_tcp);
        let mut silent = TcpStream::connect(address).expect("connects");
        let output = came(&happened);
        send_all(&output);
        let over_tcp = heard_again(&output, move || {
            let mut piece = vec![0; PIECE];
            silent.read_exact(&mut piece).expect("the server speaks");
            piece
        });

        let (address, happened) = port(serve_websocket);
        let stream = TcpStream::connect(address).expect("connects");
        let (mut silent, _) = tungstenite::client(format!("ws://{address}/"), stream).expect("greeted");
        let output = came(&happened);
        send_all(&output);
        let over_websocket = heard_again(&output, move || {
            loop {
                if let Message::Binary(piece) = silent.read().expect("the server speaks") {
                    return piece.to_vec();
                }
            }
        });
        for heard in [over_tcp, over_websocket] {
            assert!(heard < PIECES as usize / 2, "{heard} of {PIECES} pieces were kept");
        }
    }
}
