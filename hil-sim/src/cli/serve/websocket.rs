//! Clients over WebSockets. Their binary messages form a stream of bytes, as over TCP.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Ipv6Addr, TcpStream};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::thread;
use std::time::Duration;

use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::{HeaderValue, StatusCode, header};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, HandshakeError, Message, WebSocket, accept_hdr_with_config};

use super::ports::{ClientOutput, PortEvent, WAITING_MAX, next_client};

/// Time within which a client must send its request.
const QUESTION_TIME: Duration = Duration::from_secs(5);
/// Longest wait of a client's thread for the client's bytes, or for room for the board's bytes, before the thread
/// serves the other direction.
const READ_PATIENCE: Duration = Duration::from_millis(2);
/// Largest message from a client, bytes: orders are short.
const MESSAGE_MAX: usize = 65_536;
/// Most bytes that wait for a client that does not read.
const OUTPUT_MAX: usize = 1 << 20;

/// The answer to a request that is not for a WebSocket.
const NOT_A_WEBSOCKET: &str = "HTTP/1.1 400 Bad Request\r\nContent-Type: text/plain\r\nConnection: close\r\n\r\n\
                               a WebSocket of version 13 is served here\n";

/// Serves one client in its own thread, starting with the request.
///
/// # Errors
/// The socket's errors.
pub fn serve_websocket(stream: TcpStream, events: SyncSender<PortEvent>) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(QUESTION_TIME))?;
    let name = format!("websocket {}", stream.peer_addr()?);
    let mut refusal = stream.try_clone()?;
    thread::spawn(move || {
        // A client with a wrong request receives an error answer. A client that has left needs none.
        if let Some(socket) = greet(stream, &mut refusal) {
            let _ = converse(socket, name, &events);
        }
    });
    Ok(())
}

/// Answers a client's request. Returns the conversation if the request is for a WebSocket. Writes a refusal to
/// `refusal` for any other request.
fn greet<S: Read + Write>(stream: S, refusal: &mut impl Write) -> Option<WebSocket<S>> {
    let config = WebSocketConfig::default()
        .read_buffer_size(4096)
        .write_buffer_size(0)
        .max_write_buffer_size(OUTPUT_MAX)
        .max_message_size(Some(MESSAGE_MAX))
        .max_frame_size(Some(MESSAGE_MAX));
    match accept_hdr_with_config(stream, only_local_pages, Some(config)) {
        Ok(socket) => Some(socket),
        // A page from another machine already has its answer. A client that sends no request in time gets none.
        Err(HandshakeError::Failure(Error::Http(_) | Error::Io(_)) | HandshakeError::Interrupted(_)) => None,
        Err(HandshakeError::Failure(_)) => {
            // The client may have left.
            let _ = refusal.write_all(NOT_A_WEBSOCKET.as_bytes());
            None
        }
    }
}

/// Refuses a page that is not from this machine. A client that is not a page has no origin.
#[allow(clippy::result_large_err)] // The library's type.
fn only_local_pages(request: &Request, response: Response) -> Result<Response, ErrorResponse> {
    let origin = request.headers().get(header::ORIGIN);
    if origin.is_none_or(|origin| origin.to_str().is_ok_and(is_local)) {
        return Ok(response);
    }
    let mut refusal = ErrorResponse::new(Some(
        "a page that is not from this machine drives no vehicle\n".to_owned(),
    ));
    *refusal.status_mut() = StatusCode::FORBIDDEN;
    refusal
        .headers_mut()
        .insert(header::CONTENT_TYPE, HeaderValue::from_static("text/plain"));
    Err(refusal)
}

/// Whether a page's origin is a server of this machine.
fn is_local(origin: &str) -> bool {
    let Some(host) = origin
        .strip_prefix("http://")
        .or_else(|| origin.strip_prefix("https://"))
    else {
        return false;
    };
    is_local_host(host)
}

/// Whether a host, with or without a port, is this machine by its loopback names.
pub fn is_local_host(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if !port.is_empty() && port.bytes().all(|digit| digit.is_ascii_digit()) => name,
        _ => host,
    };
    name.eq_ignore_ascii_case("localhost")
        || name.parse::<Ipv4Addr>().is_ok_and(|address| address.is_loopback())
        || name
            .strip_prefix('[')
            .and_then(|name| name.strip_suffix(']'))
            .and_then(|name| name.parse::<Ipv6Addr>().ok())
            .is_some_and(|address| address.is_loopback())
}

/// Carries bytes in both directions until client or server ends.
fn converse(mut socket: WebSocket<TcpStream>, name: String, events: &SyncSender<PortEvent>) -> io::Result<()> {
    socket.get_ref().set_read_timeout(Some(READ_PATIENCE))?;
    socket.get_ref().set_write_timeout(Some(READ_PATIENCE))?;
    let client = next_client();
    let (output, waiting) = sync_channel(WAITING_MAX);
    let mut told = events.send(PortEvent::Came(client, name, ClientOutput::new(output)));
    while told.is_ok() && write_waiting(&mut socket, &waiting) {
        match read(&mut socket) {
            Said::Bytes(bytes) => told = events.send(PortEvent::Said(client, bytes)),
            Said::Nothing => {}
            Said::Goodbye => break,
        }
    }
    let _ = socket.close(None);
    let _ = events.send(PortEvent::Left(client));
    Ok(())
}

/// Writes the waiting output of a client, as far as the client accepts it; returns whether client and server are
/// still connected. Output for which the client has no room keeps waiting, in bounded room, and is sent first
/// when the client reads again.
fn write_waiting<S: Read + Write>(socket: &mut WebSocket<S>, waiting: &Receiver<Vec<u8>>) -> bool {
    loop {
        // A full buffer accepts nothing and does not write by itself.
        match socket.flush() {
            Ok(()) => {}
            Err(error) if is_passing(&error) => return true,
            Err(_) => return false,
        }
        let bytes = match waiting.try_recv() {
            Ok(bytes) => bytes,
            Err(TryRecvError::Empty) => return true,
            Err(TryRecvError::Disconnected) => return false,
        };
        match socket.send(Message::binary(bytes)) {
            // Output of a go that is larger than the buffer is lost.
            Ok(()) | Err(Error::WriteBufferFull(_)) => {}
            Err(error) if is_passing(&error) => {}
            Err(_) => return false,
        }
    }
}

/// A client's input in its turn.
#[derive(Debug, PartialEq, Eq)]
enum Said {
    Bytes(Vec<u8>),
    Nothing,
    /// The client has left, or uses another protocol.
    Goodbye,
}

fn read<S: Read + Write>(socket: &mut WebSocket<S>) -> Said {
    match socket.read() {
        Ok(Message::Binary(bytes)) => Said::Bytes(bytes.to_vec()),
        // The library answers a ping, and a close at the next turn.
        Ok(Message::Ping(_) | Message::Pong(_) | Message::Close(_) | Message::Frame(_)) => Said::Nothing,
        Err(error) if is_passing(&error) => Said::Nothing,
        Ok(Message::Text(_)) | Err(_) => Said::Goodbye,
    }
}

/// Whether an access only timed out.
fn is_passing(error: &Error) -> bool {
    matches!(error, Error::Io(error)
        if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted))
}

#[cfg(test)]
mod tests {
    use tungstenite::protocol::Role;

    use super::*;

    /// A wire in memory: what the client sends, and what it receives.
    #[derive(Debug, Default)]
    struct MemoryWire {
        said: io::Cursor<Vec<u8>>,
        told: Vec<u8>,
    }

    impl Read for MemoryWire {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            self.said.read(bytes)
        }
    }

    impl Write for MemoryWire {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.told.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// The request of RFC 6455, section 1.2, with this origin.
    fn question(origin: &str) -> String {
        format!(
            "GET /chat HTTP/1.1\r\nHost: 127.0.0.1:5761\r\nUpgrade: websocket\r\nConnection: keep-alive, Upgrade\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n{origin}Sec-WebSocket-Version: 13\r\n\r\n"
        )
    }

    /// The answer to a request, and whether a conversation begins.
    fn answer(question: &str) -> (String, bool) {
        let mut wire = MemoryWire {
            said: io::Cursor::new(question.as_bytes().to_vec()),
            told: Vec::new(),
        };
        let mut refusal = Vec::new();
        let begins = greet(&mut wire, &mut refusal).is_some();
        (String::from_utf8([wire.told, refusal].concat()).expect("text"), begins)
    }

    #[test]
    fn the_answer_is_the_standards_example() {
        let (answer, begins) = answer(&question(""));
        assert!(begins && answer.starts_with("HTTP/1.1 101 "), "{answer}");
        let accepted = "sec-websocket-accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n";
        assert!(answer.to_lowercase().contains(&accepted.to_lowercase()), "{answer}");
    }

    #[test]
    fn only_pages_of_this_machine_are_let_in() {
        for origin in [
            "http://localhost:5780",
            "http://127.0.0.1:1",
            "https://LOCALHOST",
            "http://[::1]:5780",
        ] {
            assert!(answer(&question(&format!("Origin: {origin}\r\n"))).1, "{origin}");
        }
        for origin in [
            "http://example.com",
            "http://127.0.0.1.example.com",
            "http://localhost.example.com:5780",
            "http://example.com:80#localhost",
            "null",
            "file://",
            "http://10.0.0.1",
            "",
        ] {
            let (refusal, begins) = answer(&question(&format!("origin: {origin}\r\n")));
            assert!(!begins && refusal.starts_with("HTTP/1.1 403 "), "{origin}: {refusal}");
        }
    }

    #[test]
    fn what_is_no_websocket_is_told() {
        let good = question("");
        for (part, other) in [
            ("GET", "POST"),
            ("websocket", "h2c"),
            ("Upgrade\r\n", "close\r\n"),
            ("13", "8"),
            ("Key", "Kay"),
        ] {
            let (refusal, begins) = answer(&good.replacen(part, other, 1));
            assert!(!begins && refusal.starts_with("HTTP/1.1 400 "), "{part}: {refusal}");
        }
    }

    /// The server's inputs from a client's bytes.
    fn heard(bytes: &[u8]) -> Vec<Said> {
        let mut wire = MemoryWire {
            said: io::Cursor::new(question("").into_bytes()),
            told: Vec::new(),
        };
        let mut socket = greet(&mut wire, &mut Vec::new()).expect("a conversation");
        socket.get_mut().said = io::Cursor::new(bytes.to_vec());
        let mut heard = Vec::new();
        while heard.last() != Some(&Said::Goodbye) {
            heard.push(read(&mut socket));
        }
        heard
    }

    /// A message as a client writes it.
    fn masked(message: Message) -> Vec<u8> {
        let mut client = WebSocket::from_raw_socket(MemoryWire::default(), Role::Client, None);
        client.send(message).expect("written");
        client.into_inner().told
    }

    #[test]
    fn messages_of_every_length_come_through() {
        for length in [0, 1, 125, 126, 127, 65_535, MESSAGE_MAX] {
            let payload: Vec<u8> = (0..length).map(|n| n as u8).collect();
            let heard = heard(&masked(Message::binary(payload.clone())));
            assert_eq!(heard, [Said::Bytes(payload), Said::Goodbye], "{length}");
        }
        let ping = masked(Message::Ping(vec![1, 2, 3].into()));
        assert_eq!(heard(&ping), [Said::Nothing, Said::Goodbye]);
    }

    #[test]
    fn what_is_forbidden_or_too_long_ends_the_conversation() {
        let mut unmasked = masked(Message::binary(b"no mask".to_vec()));
        unmasked[1] &= 0x7F;
        for bytes in [
            unmasked,
            masked(Message::text("no bytes")),
            masked(Message::binary(vec![0; MESSAGE_MAX + 1])),
            // An impossible length is refused before memory is reserved for it.
            vec![0x82, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0, 0],
        ] {
            assert_eq!(heard(&bytes), [Said::Goodbye], "{bytes:?}");
        }
    }
}
