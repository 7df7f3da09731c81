//! The emulated board's host link as a wire of the host's tool.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;

use board_emulator::board::DriveBoard;
use board_emulator::run::Emulation;
use board_emulator::time::{Instant, MS};
use hil_sim::cli::link::wire::Wire;

/// How long one read of the tool waits, ms.
const READ_MS: u64 = 5;

/// The emulated board's host link; clones are ends of the same link.
#[derive(Clone)]
pub struct EmulatedWire {
    emulation: Rc<RefCell<Emulation>>,
    /// Bytes that have arrived and that the tool has not read yet.
    waiting: Vec<u8>,
}

impl EmulatedWire {
    pub fn new(emulation: Emulation) -> Self {
        Self {
            emulation: Rc::new(RefCell::new(emulation)),
            waiting: Vec::new(),
        }
    }

    /// Acts on the board at the run's present instant.
    pub fn act(&self, act: impl FnOnce(&mut DriveBoard, Instant) + Send + 'static) {
        let acted = self.emulation.borrow_mut().at(move |stopped| {
            let (board, now) = stopped.board_now();
            act(board, now);
        });
        acted.expect("it runs");
    }

    /// The board again, once no other end is left.
    pub fn into_board(self) -> Emulation {
        let emulation = Rc::into_inner(self.emulation).expect("the other ends are gone");
        emulation.into_inner()
    }
}

impl Wire for EmulatedWire {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.emulation.borrow_mut().send(bytes).map_err(io::Error::other)
    }

    fn receive(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if self.waiting.is_empty() {
            let mut emulation = self.emulation.borrow_mut();
            emulation.run_for(READ_MS * MS).map_err(io::Error::other)?;
            self.waiting = emulation.receive();
        }
        let length = bytes.len().min(self.waiting.len());
        for (slot, byte) in bytes.iter_mut().zip(self.waiting.drain(..length)) {
            *slot = byte;
        }
        Ok(length)
    }

    fn now_us(&self) -> u64 {
        self.emulation.borrow().now() * 1000 / MS
    }
}
