//! The host's end of the link.

use std::collections::VecDeque;

use rigless::chip::Timeline;
use rigless::chip::uart::Peer;
use rigless::time::VirtualNanos;

/// The debugger's virtual COM port: bytes that the host has sent, bytes that the board has sent.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct LinkLine {
    to_board: VecDeque<u8>,
    from_board: Vec<u8>,
}

rigless::store!(LinkLine);

impl LinkLine {
    /// Queues bytes. They reach the board at the line's rate, starting at the emulator's next
    /// stop.
    pub fn send(&mut self, bytes: &[u8]) {
        self.to_board.extend(bytes);
    }

    /// Number of queued bytes that have not been sent.
    pub fn pending(&self) -> usize {
        self.to_board.len()
    }

    /// Takes the bytes that the board has sent since the last call.
    pub fn take(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.from_board)
    }
}

impl Peer for LinkLine {
    fn receive(&mut self, word: u16, _: &mut Timeline<'_, '_>) {
        self.from_board.push(word as u8);
    }

    fn transmit(&mut self, _: VirtualNanos) -> Option<u16> {
        self.to_board.pop_front().map(u16::from)
    }
}
