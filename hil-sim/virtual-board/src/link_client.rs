//! The host's end of the link: messages out, statuses in. Knows frames, not wires: the bytes travel over
//! the virtual board's line, the emulated board's USART or a serial port alike.

use firmware::protocol::frame::{Decoder, Received, encode};
use firmware::protocol::message::{BoardMessage, BoardStatus, HostMessage, ParameterAnswer};

/// The host's end of the link.
#[derive(Debug, Default)]
pub struct LinkClient {
    decoder: Decoder,
    /// The newest status of vehicle and board.
    pub status: Option<BoardStatus>,
    /// Protocol version that the board reported.
    pub protocol: Option<u16>,
    /// Answers to parameter requests, in order, until taken.
    pub parameter_answers: Vec<ParameterAnswer>,
    /// Good messages received.
    pub messages: u64,
    /// Frames that could not be read.
    pub bad_frames: u64,
}

impl LinkClient {
    /// The bytes of one message to the board.
    ///
    /// # Panics
    /// Never: every host message fits a frame (a test of this module proves it).
    pub fn encode(message: &HostMessage) -> Vec<u8> {
        encode(message).expect("host messages are short").to_vec()
    }

    /// Takes bytes from the board.
    pub fn receive(&mut self, bytes: &[u8]) {
        for byte in bytes {
            match self.decoder.push(*byte) {
                Received::Nothing => {}
                Received::Bad | Received::Overlong => self.bad_frames += 1,
                Received::Message(message) => {
                    self.messages += 1;
                    match message {
                        BoardMessage::Status(status) => self.status = Some(status),
                        BoardMessage::Identity { protocol } => self.protocol = Some(protocol),
                        BoardMessage::Parameters(answer) => self.parameter_answers.push(answer),
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::command::Request;

    #[test]
    fn every_host_message_fits_a_frame() {
        for message in [
            HostMessage::Identify,
            HostMessage::Drive {
                speed_m_s: f32::MAX,
                yaw_rate_rad_s: f32::MIN,
            },
            HostMessage::Request(Request::ClearFaults),
        ] {
            assert!(LinkClient::encode(&message).len() < 20);
        }
    }
}
