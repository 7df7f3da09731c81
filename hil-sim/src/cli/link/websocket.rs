//! A served board's WebSocket as a stream of bytes, as its TCP port is one.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use tungstenite::client::client_with_config;
use tungstenite::error::ProtocolError;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, HandshakeError, Message, WebSocket};

/// Time within which the other end greets.
const GREETING_TIME: Duration = Duration::from_secs(5);
/// Most bytes of one message of a board: it says some ten kilobytes in a go.
const MESSAGE_MAX: usize = 1 << 20;

/// The conversation with a served board.
pub struct WebSocketStream {
    socket: WebSocket<TcpStream>,
    /// What has come and has not been read yet.
    said: VecDeque<u8>,
}

impl WebSocketStream {
    /// Asks the other end of `stream` for a WebSocket; `address` is its HOST:PORT. Reads and writes wait no longer than
    /// `patience` from then on.
    ///
    /// # Errors
    /// In words: there is none, or the other end refuses.
    pub fn greet(stream: TcpStream, address: &str, patience: Duration) -> Result<Self, String> {
        let waits = |stream: &TcpStream, time| {
            let times = stream.set_read_timeout(Some(time));
            times.and_then(|()| stream.set_write_timeout(Some(time)))
        };
        let in_words = |error: io::Error| error.to_string();
        waits(&stream, GREETING_TIME).map_err(in_words)?;
        let config = WebSocketConfig::default()
            .write_buffer_size(0)
            .max_message_size(Some(MESSAGE_MAX))
            .max_frame_size(Some(MESSAGE_MAX));
        let greeted = client_with_config(format!("ws://{address}/"), stream, Some(config));
        let (socket, _) = greeted.map_err(|error| match error {
            HandshakeError::Failure(Error::Http(answer)) => format!("the other end refuses: {}", answer.status()),
            HandshakeError::Failure(error) => {
                format!("no WebSocket ({error}): `hil-sim serve --websocket` serves a board at one")
            }
            HandshakeError::Interrupted(_) => "whoever listens there does not answer as a WebSocket does".to_owned(),
        })?;
        waits(socket.get_ref(), patience).map_err(in_words)?;
        Ok(Self {
            socket,
            said: VecDeque::new(),
        })
    }
}

impl Read for WebSocketStream {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
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
            // Nothing yet, which is not the end.
            0 => Err(ErrorKind::WouldBlock.into()),
            length => Ok(length),
        }
    }
}

impl Write for WebSocketStream {
    /// Takes bytes whole, as one message: what the connection has no room for yet waits for the next write.
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self.socket.send(Message::binary(bytes.to_vec())) {
            Ok(()) => Ok(bytes.len()),
            Err(Error::Io(error)) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                Ok(bytes.len())
            }
            Err(Error::Io(error)) => Err(error),
            Err(Error::ConnectionClosed | Error::AlreadyClosed) => Err(ErrorKind::ConnectionReset.into()),
            Err(error) => Err(io::Error::other(error.to_string())),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
