//! The server's half of a WebSocket (RFC 6455), as far as a stream of bytes needs it: one handshake, binary frames,
//! ping, close. By hand: a package for it brings ten others, and each client has a thread for each direction.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Ipv6Addr, TcpStream};
use std::sync::mpsc::{Receiver, Sender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use super::ports::{ClientOutput, PortEvent, WAITING_MAX, next_client};
use super::sha1::{base64, sha1};

/// Most bytes of a question.
const QUESTION_MAX: usize = 8192;
/// Time within which a client asks its question.
const QUESTION_TIME: Duration = Duration::from_secs(5);
/// Most bytes of one frame of a client: orders are short.
const FRAME_MAX: u64 = 65_536;
/// What the standard appends to a client's key.
const APPENDIX: &str = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";

const CONTINUED: u8 = 0;
const BINARY: u8 = 2;
const CLOSE: u8 = 8;
const PING: u8 = 9;
const PONG: u8 = 10;

/// Serves one client from its question on, in threads of its own.
///
/// # Errors
/// Those of the socket.
pub fn serve_websocket(mut stream: TcpStream, events: Sender<PortEvent>) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let name = format!("websocket {}", stream.peer_addr()?);
    thread::spawn(move || {
        // A client that asks wrongly, or leaves, is told so by the answer, or is gone.
        if matches!(greet(&mut stream), Ok(true)) {
            let _ = converse(stream, name, &events);
        }
    });
    Ok(())
}

/// Reads the client's question and answers it; whether it is a client now.
fn greet(stream: &mut TcpStream) -> io::Result<bool> {
    stream.set_read_timeout(Some(QUESTION_TIME))?;
    let mut question = Vec::new();
    let mut byte = [0];
    while !question.ends_with(b"\r\n\r\n") {
        if question.len() == QUESTION_MAX || stream.read(&mut byte)? == 0 {
            return Ok(false);
        }
        question.push(byte[0]);
    }
    stream.set_read_timeout(None)?;
    let answer = answer(&String::from_utf8_lossy(&question));
    stream.write_all(answer.as_ref().unwrap_or_else(|refusal| refusal).as_bytes())?;
    Ok(answer.is_ok())
}

/// The answer to a question, or the refusal of one that is no WebSocket's or of a page from elsewhere.
fn answer(question: &str) -> Result<String, String> {
    let refusal = |status: &str, why: &str| {
        let length = why.len();
        format!(
            "HTTP/1.1 {status}\r\nContent-Type: text/plain\r\nContent-Length: {length}\r\nConnection: close\r\n\r\n{why}"
        )
    };
    let field = |name: &str| {
        let mut lines = question.lines().skip(1).filter_map(|line| line.split_once(':'));
        lines
            .find(|(found, _)| found.eq_ignore_ascii_case(name))
            .map(|(_, value)| value.trim())
    };
    if let Some(origin) = field("Origin")
        && !is_local(origin)
    {
        return Err(refusal(
            "403 Forbidden",
            "a page that is not from this machine drives no vehicle\n",
        ));
    }
    let asks = |name: &str, word: &str| {
        field(name).is_some_and(|value| value.split(',').any(|each| each.trim().eq_ignore_ascii_case(word)))
    };
    let key = field("Sec-WebSocket-Key").filter(|_| {
        question.starts_with("GET ")
            && asks("Upgrade", "websocket")
            && asks("Connection", "upgrade")
            && asks("Sec-WebSocket-Version", "13")
    });
    let Some(key) = key else {
        return Err(refusal("400 Bad Request", "a WebSocket of version 13 is served here\n"));
    };
    let accepted = base64(&sha1(format!("{key}{APPENDIX}").as_bytes()));
    Ok(format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accepted}\r\n\r\n"
    ))
}

/// Whether a page's origin is a server of this machine. What is no page has no origin.
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

/// Starts the two threads of a client.
fn converse(stream: TcpStream, name: String, events: &Sender<PortEvent>) -> io::Result<()> {
    let client = next_client();
    let (output, waiting) = sync_channel(WAITING_MAX);
    let writer = Arc::new(Mutex::new(stream.try_clone()?));
    if events
        .send(PortEvent::Came(client, name, ClientOutput::new(output)))
        .is_err()
    {
        return Ok(());
    }
    let out = writer.clone();
    thread::spawn(move || write_frames(&waiting, &out));
    let mut reader = FrameReader { from: stream };
    while let Ok(Some((kind, payload))) = reader.frame() {
        match kind {
            CONTINUED | BINARY => {
                if events.send(PortEvent::Said(client, payload)).is_err() {
                    break;
                }
            }
            PING => send(&writer, PONG, &payload)?,
            PONG => {}
            // A close, or what this server does not speak.
            _ => break,
        }
    }
    let _ = send(&writer, CLOSE, &[]);
    let _ = reader.from.shutdown(std::net::Shutdown::Both);
    let _ = events.send(PortEvent::Left(client));
    Ok(())
}

/// Writes what waits for a client until the client or the server is gone.
fn write_frames(waiting: &Receiver<Vec<u8>>, writer: &Mutex<TcpStream>) {
    while let Ok(bytes) = waiting.recv() {
        if send(writer, BINARY, &bytes).is_err() {
            return;
        }
    }
}

fn send(writer: &Mutex<TcpStream>, kind: u8, payload: &[u8]) -> io::Result<()> {
    let bytes = frame(kind, payload);
    writer.lock().unwrap_or_else(PoisonError::into_inner).write_all(&bytes)
}

/// A whole frame of the server: not masked.
fn frame(kind: u8, payload: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0x80 | kind];
    match payload.len() {
        length @ 0..126 => bytes.push(length as u8),
        length @ 126..65_536 => {
            bytes.push(126);
            bytes.extend((length as u16).to_be_bytes());
        }
        length => {
            bytes.push(127);
            bytes.extend((length as u64).to_be_bytes());
        }
    }
    bytes.extend(payload);
    bytes
}

/// Reads a client's frames.
struct FrameReader<R> {
    from: R,
}

impl<R: Read> FrameReader<R> {
    /// The next frame: its kind and its bytes; `None` when the client has closed its end.
    ///
    /// # Errors
    /// The wire's, and [`ErrorKind::InvalidData`] for a frame that the standard forbids a client or that is too long.
    fn frame(&mut self) -> io::Result<Option<(u8, Vec<u8>)>> {
        let mut head = [0; 2];
        match self.from.read_exact(&mut head) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Ok(None),
            other => other?,
        }
        let [first, second] = head;
        let (kind, masked) = (first & 0x0F, second & 0x80 != 0);
        let length = match second & 0x7F {
            126 => u64::from(u16::from_be_bytes(self.take()?)),
            127 => u64::from_be_bytes(self.take()?),
            short => u64::from(short),
        };
        let control_is_short = kind < CLOSE || (length < 126 && first & 0x80 != 0);
        if !masked || first & 0x70 != 0 || length > FRAME_MAX || !control_is_short {
            return Err(ErrorKind::InvalidData.into());
        }
        let mask: [u8; 4] = self.take()?;
        let mut payload = vec![0; length as usize];
        self.from.read_exact(&mut payload)?;
        for (byte, mask) in payload.iter_mut().zip(mask.iter().cycle()) {
            *byte ^= mask;
        }
        Ok(Some((kind, payload)))
    }

    fn take<const N: usize>(&mut self) -> io::Result<[u8; N]> {
        let mut bytes = [0; N];
        self.from.read_exact(&mut bytes)?;
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The question of RFC 6455, section 1.2, with this origin.
    fn question(origin: &str) -> String {
        format!(
            "GET /chat HTTP/1.1\r\nHost: 127.0.0.1:5761\r\nUpgrade: websocket\r\nConnection: keep-alive, Upgrade\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n{origin}Sec-WebSocket-Version: 13\r\n\r\n"
        )
    }

    #[test]
    fn the_answer_is_the_standards_example() {
        let answer = answer(&question("")).expect("good");
        assert!(
            answer.contains("Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n"),
            "{answer}"
        );
    }

    #[test]
    fn only_pages_of_this_machine_are_let_in() {
        for origin in [
            "http://localhost:5780",
            "http://127.0.0.1:1",
            "https://LOCALHOST",
            "http://[::1]:5780",
        ] {
            assert!(answer(&question(&format!("Origin: {origin}\r\n"))).is_ok(), "{origin}");
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
            let refusal = answer(&question(&format!("origin: {origin}\r\n"))).expect_err(origin);
            assert!(refusal.starts_with("HTTP/1.1 403 "), "{refusal}");
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
            let refusal = answer(&good.replacen(part, other, 1)).expect_err(part);
            assert!(refusal.starts_with("HTTP/1.1 400 "), "{refusal}");
        }
    }

    fn masked(first: u8, payload: &[u8]) -> Vec<u8> {
        let mut bytes = frame(first & 0x0F, payload);
        bytes[0] = first;
        bytes[1] |= 0x80;
        let mask = [1, 2, 3, 4];
        let head = bytes.len() - payload.len();
        let coded: Vec<u8> = payload
            .iter()
            .zip(mask.iter().cycle())
            .map(|(byte, mask)| byte ^ mask)
            .collect();
        [&bytes[..head], &mask, &coded].concat()
    }

    #[test]
    fn frames_of_every_length_come_through() {
        for length in [0, 1, 125, 126, 127, 65_535, 65_536] {
            let payload: Vec<u8> = (0..length).map(|n| n as u8).collect();
            let wire = masked(0x80 | BINARY, &payload);
            let mut reader = FrameReader { from: &wire[..] };
            assert_eq!(reader.frame().expect("good"), Some((BINARY, payload)), "{length}");
            assert_eq!(reader.frame().expect("ended"), None);
        }
    }

    #[test]
    fn what_the_standard_forbids_ends_the_conversation() {
        let wrong = [
            frame(BINARY, b"not masked"),
            masked(0xC0 | BINARY, b"a reserved bit"),
            masked(PING, b"a ping in parts"),
            masked(0x80 | PING, &[0; 126]),
            masked(0x80 | BINARY, &vec![0; FRAME_MAX as usize + 1]),
        ];
        for wire in &wrong {
            let mut reader = FrameReader { from: &wire[..] };
            assert_eq!(reader.frame().expect_err("wrong").kind(), ErrorKind::InvalidData);
        }
        // A length that nobody can have is refused before there is room for it.
        let huge = [0x82, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF];
        assert!(FrameReader { from: &huge[..] }.frame().is_err());
        let cut = masked(0x80 | BINARY, b"cut off");
        assert!(FrameReader { from: &cut[..9] }.frame().is_err());
    }
}
