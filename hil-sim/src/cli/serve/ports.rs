//! The ports at which clients come: each has threads of its own, so that a client that does not read holds up nobody.

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

/// Pieces of output that wait for a client that does not read; further ones are lost to it.
pub(super) const WAITING_MAX: usize = 256;

/// Things that happened and that the server has not taken yet; clients that say more wait.
pub const HAPPENED_MAX: usize = 256;

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

/// Begins to serve one client.
pub type Serve = fn(TcpStream, SyncSender<PortEvent>) -> std::io::Result<()>;

/// Listens at the address that `flag` names, lets `serve` begin with each client, and returns the address, with the port
/// that the system chose for port 0.
///
/// # Errors
/// [`CommandError::Input`]: the address is taken, or not of this machine.
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
/// Those of the socket.
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
/// [`CommandError::Other`]: the system gives none.
#[cfg(unix)]
pub fn open_pty(events: SyncSender<PortEvent>) -> Result<String, CommandError> {
    use serialport::{SerialPort, TTYPort};

    let failed = |error: serialport::Error| CommandError::Other(format!("--pty: {error}"));
    let (mut board, other) = TTYPort::pair().map_err(failed)?;
    board.set_timeout(LOOK).map_err(failed)?;
    let name = other.name().unwrap_or_default();
    // Closed, so that the board's end shows whether a client is there.
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

    /// After this time a test gives up instead of hanging; nothing is measured by it.
    const GIVE_UP: Duration = Duration::from_mins(1);
    const PIECE: usize = 16 << 10;
    /// Pieces that are sent to a client that does not read, 64 MB: more than the system keeps for a connection, some MB on
    /// each side of it, and more than waits in the server.
    const PIECES: u32 = 4096;

    /// A port, and what happens there.
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

    /// Sends numbered pieces while nobody reads. That this ends shows that nobody waits for the client.
    fn send_all(output: &ClientOutput) {
        for number in 0..PIECES {
            assert!(output.send(&piece(number)), "the client is there");
            // As a board does, which leaves the port's thread time to fill whatever room there is.
            thread::sleep(Duration::from_micros(100));
        }
    }

    fn piece(number: u32) -> Vec<u8> {
        let mut piece = vec![0; PIECE];
        piece[..4].copy_from_slice(&number.to_le_bytes());
        piece
    }

    /// Sends the last piece until the client, which reads again, has it: how many pieces the client has heard by then.
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

    /// A client that does not read holds up nobody and takes bounded room; when it reads again, it hears what is new.
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
