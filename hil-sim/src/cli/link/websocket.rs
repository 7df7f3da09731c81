//! A served board's WebSocket as a stream of bytes, like its TCP port.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use tungstenite::client::client_with_config;
use tungstenite::error::ProtocolError;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, HandshakeError, Message, WebSocket};

/// Time within which the other end must complete the handshake.
const GREETING_TIME: Duration = Duration::from_secs(5);
/// Largest message from a board, bytes: a board sends some ten kilobytes in a go.
const BOARD_MESSAGE_MAX: usize = 1 << 20;
/// Most bytes that wait for a board that does not read. A second of orders is a tenth of this size, and older orders
/// are useless.
const HOST_OUTPUT_MAX: usize = 1 << 16;

/// The conversation with a served board.
pub struct WebSocketStream<S = TcpStream> {
    socket: WebSocket<S>,
    /// Bytes that have arrived and have not been read yet.
    said: VecDeque<u8>,
    /// Whether the connection had no room for the end of the written bytes.
    unwritten: bool,
}

impl WebSocketStream {
    /// Asks the other end of `stream` for a WebSocket; `address` is its HOST:PORT. Reads and writes wait no longer than
    /// `patience` from then on.
    ///
    /// # Errors
    /// A message: the other end speaks no WebSocket, or refuses.
    pub fn greet(stream: TcpStream, address: &str, patience: Duration) -> Result<Self, String> {
        let waits = |stream: &TcpStream, time| {
            let times = stream.set_read_timeout(Some(time));
            times.and_then(|()| stream.set_write_timeout(Some(time)))
        };
        let in_words = |error: io::Error| error.to_string();
        waits(&stream, GREETING_TIME).map_err(in_words)?;
        let greeted = client_with_config(format!("ws://{address}/"), stream, Some(config()));
        let (socket, _) = greeted.map_err(|error| match error {
            HandshakeError::Failure(Error::Http(answer)) => format!("the other end refuses: {}", answer.status()),
            HandshakeError::Failure(error) => {
                format!("no WebSocket ({error}): `hil-sim serve --websocket` serves a board at one")
            }
            HandshakeError::Interrupted(_) => "whoever listens there does not answer as a WebSocket does".to_owned(),
        })?;
        waits(socket.get_ref(), patience).map_err(in_words)?;
        Ok(Self::new(socket))
    }
}

/// Limits of a board's message, and of the bytes that wait for the board.
fn config() -> WebSocketConfig {
    WebSocketConfig::default()
        .write_buffer_size(0)
        .max_write_buffer_size(HOST_OUTPUT_MAX)
        .max_message_size(Some(BOARD_MESSAGE_MAX))
        .max_frame_size(Some(BOARD_MESSAGE_MAX))
}

impl<S: Read + Write> WebSocketStream<S> {
    fn new(socket: WebSocket<S>) -> Self {
        Self {
            socket,
            said: VecDeque::new(),
            unwritten: false,
        }
    }
}

impl<S: Read + Write> Read for WebSocketStream<S> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        // Waiting bytes are sent even if nothing more is written. A connection without room is still read.
        match self.flush() {
            Err(error) if !is_passing(&error) => return Err(error),
            _ => {}
        }
        if self.said.is_empty() {
            match self.socket.read() {
                Ok(Message::Binary(said)) => self.said.extend(&said),
                // The library answers a ping.
                Ok(Message::Ping(_) | Message::Pong(_) | Message::Frame(_)) => {}
                Ok(Message::Close(_))
                | Err(
                    Error::ConnectionClosed
                    | Error::AlreadyClosed
                    | Error::Protocol(ProtocolError::ResetWithoutClosingHandshake),
                ) => return Ok(0),
                Err(Error::Io(error)) => return Err(error),
                Ok(Message::Text(_)) => return Err(ErrorKind::InvalidData.into()),
                Err(error) => return Err(io::Error::new(ErrorKind::InvalidData, error.to_string())),
            }
        }
        match self.said.read(bytes)? {
            // No bytes yet, which is not the end of the stream.
            0 => Err(ErrorKind::WouldBlock.into()),
            length => Ok(length),
        }
    }
}

impl<S: Read + Write> Write for WebSocketStream<S> {
    /// Takes all bytes as one message. The next flush, read or write sends the bytes for which the connection had no
    /// room.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // A full buffer accepts nothing and does not write by itself.
        let _ = self.flush();
        match self.socket.send(Message::binary(bytes.to_vec())) {
            Ok(()) => Ok(bytes.len()),
            Err(Error::WriteBufferFull(_)) => Err(ErrorKind::WouldBlock.into()),
            Err(error) => match in_io(error) {
                error if is_passing(&error) => {
                    self.unwritten = true;
                    Ok(bytes.len())
                }
                error => Err(error),
            },
        }
    }

    /// Writes the waiting bytes, as far as the connection has room.
    fn flush(&mut self) -> io::Result<()> {
        if self.unwritten {
            self.socket.flush().map_err(in_io)?;
            self.unwritten = false;
        }
        Ok(())
    }
}

/// A failed access as an I/O error.
fn in_io(error: Error) -> io::Error {
    match error {
        Error::Io(error) => error,
        Error::ConnectionClosed | Error::AlreadyClosed => ErrorKind::ConnectionReset.into(),
        error => io::Error::other(error.to_string()),
    }
}

/// Whether an access only timed out.
fn is_passing(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
}

#[cfg(test)]
mod tests {
    use tungstenite::protocol::Role;

    use super::*;

    /// A connection that accepts this many more bytes, and sends nothing.
    struct Narrow {
        room: usize,
        taken: Vec<u8>,
    }

    impl Read for Narrow {
        fn read(&mut self, _bytes: &mut [u8]) -> io::Result<usize> {
            Err(ErrorKind::WouldBlock.into())
        }
    }

    impl Write for Narrow {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let length = bytes.len().min(self.room);
            if length == 0 {
                return Err(ErrorKind::WouldBlock.into());
            }
            self.room -= length;
            self.taken.extend(&bytes[..length]);
            Ok(length)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn narrow(room: usize) -> WebSocketStream<Narrow> {
        let taken = Vec::new();
        WebSocketStream::new(WebSocket::from_raw_socket(
            Narrow { room, taken },
            Role::Client,
            Some(config()),
        ))
    }

    /// The messages that the other end has received.
    fn heard(stream: &WebSocketStream<Narrow>) -> Vec<Vec<u8>> {
        let taken = io::Cursor::new(stream.socket.get_ref().taken.clone());
        let mut other = WebSocket::from_raw_socket(taken, Role::Server, None);
        let messages = std::iter::from_fn(|| other.read().ok());
        messages.map(|message| message.into_data().to_vec()).collect()
    }

    #[test]
    fn what_had_no_room_goes_out_without_a_further_write() {
        for by_read in [false, true] {
            let mut stream = narrow(5);
            stream.write_all(b"disarm").expect("taken");
            assert!(stream.flush().is_err(), "there is no room");
            assert!(heard(&stream).is_empty());
            stream.socket.get_mut().room = 100;
            if by_read {
                assert!(stream.read(&mut [0; 8]).is_err(), "nothing is said");
            } else {
                stream.flush().expect("there is room");
            }
            assert_eq!(heard(&stream), [b"disarm"]);
        }
    }

    #[test]
    fn a_board_that_does_not_read_gets_no_more_than_the_bound_and_hears_again() {
        let mut stream = narrow(0);
        let mut taken = 0;
        for _ in 0..10_000 {
            match stream.write(&[7; 100]) {
                Ok(length) => taken += length,
                Err(error) => assert_eq!(error.kind(), ErrorKind::WouldBlock),
            }
        }
        assert!((HOST_OUTPUT_MAX / 2..=HOST_OUTPUT_MAX).contains(&taken), "{taken}");
        stream.socket.get_mut().room = usize::MAX;
        stream.write_all(b"newest").expect("taken");
        let heard = heard(&stream);
        assert_eq!(heard.last().map(Vec::as_slice), Some(&b"newest"[..]));
        assert_eq!(heard.len(), taken / 100 + 1);
    }
}
