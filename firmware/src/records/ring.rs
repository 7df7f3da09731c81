//! Blocks of records in RAM: the newest blocks for the stream, and the blocks of the last seconds for the look-back.

use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, Ordering};

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_sync::signal::Signal;

use super::codec::RecordBlock;

/// Number of blocks of the look-back: at least the last 2 s.
const LOOK_BACK_BLOCKS: usize = 200;
/// Number of blocks that may wait to be sent: a tenth of a second.
const STREAM_BLOCKS: usize = 8;

/// The newest `N` blocks, each at the place given by its number.
#[derive(Debug)]
struct Ring<const N: usize> {
    blocks: [RecordBlock; N],
}

impl<const N: usize> Ring<N> {
    const fn new() -> Self {
        Self {
            blocks: [const { RecordBlock::empty() }; N],
        }
    }

    fn push(&mut self, block: &RecordBlock) {
        if let Some(slot) = self.blocks.get_mut(block.number as usize % N) {
            slot.number = block.number;
            slot.bytes.clear();
            // The places are as long as the blocks.
            let _ = slot.bytes.extend_from_slice(&block.bytes);
        }
    }

    fn clear(&mut self) {
        for block in &mut self.blocks {
            block.bytes.clear();
        }
    }

    /// The oldest block whose number is at least `number`.
    fn from(&self, number: u32) -> Option<&RecordBlock> {
        self.blocks
            .iter()
            .filter(|block| block.number >= number && !block.bytes.is_empty())
            .min_by_key(|block| block.number)
    }
}

#[derive(Debug)]
struct Rings {
    stream: Ring<STREAM_BLOCKS>,
    look_back: Ring<LOOK_BACK_BLOCKS>,
    frozen: bool,
}

/// Blocks of records, shared by the control task, which fills them, and the sending task.
#[allow(missing_debug_implementations)] // Signals have none.
pub struct RecordRings<M: RawMutex> {
    rings: Mutex<M, RefCell<Rings>>,
    streaming: AtomicBool,
    /// Raised with each block while the host wants the stream.
    pub ready: Signal<M, ()>,
}

impl<M: RawMutex> RecordRings<M> {
    /// No blocks.
    pub const fn new() -> Self {
        Self {
            rings: Mutex::new(RefCell::new(Rings {
                stream: Ring::new(),
                look_back: Ring::new(),
                frozen: false,
            })),
            streaming: AtomicBool::new(false),
            ready: Signal::new(),
        }
    }

    /// Calls `act` with the rings. Does nothing if they are in use, which never happens, because no task waits inside
    /// `act`.
    fn with<R>(&self, act: impl FnOnce(&mut Rings) -> R) -> Option<R> {
        self.rings
            .lock(|rings| rings.try_borrow_mut().ok().map(|mut rings| act(&mut rings)))
    }

    /// Adds a block.
    pub fn push(&self, block: &RecordBlock) {
        self.with(|rings| {
            rings.stream.push(block);
            if !rings.frozen {
                rings.look_back.push(block);
            }
        });
        if self.streaming.load(Ordering::Relaxed) {
            self.ready.signal(());
        }
    }

    /// Freezes the look-back until [`RecordRings::restart`].
    pub fn freeze(&self) {
        self.with(|rings| rings.frozen = true);
    }

    /// Restarts a frozen look-back, empty.
    pub fn restart(&self) {
        self.with(|rings| {
            if rings.frozen {
                rings.frozen = false;
                rings.look_back.clear();
            }
        });
    }

    /// Sets whether the host wants the stream.
    pub fn stream(&self, wanted: bool) {
        self.streaming.store(wanted, Ordering::Relaxed);
        if wanted {
            self.ready.signal(());
        }
    }

    /// The oldest stored block whose number is at least `number`.
    pub fn streamed_from(&self, number: u32) -> Option<RecordBlock> {
        self.with(|rings| {
            let candidates = [rings.stream.from(number), rings.look_back.from(number)];
            candidates
                .into_iter()
                .flatten()
                .min_by_key(|block| block.number)
                .cloned()
        })?
    }

    /// The oldest block of the look-back whose number is at least `number`, and whether the look-back is frozen.
    pub fn look_back_from(&self, number: u32) -> (bool, Option<RecordBlock>) {
        self.with(|rings| (rings.frozen, rings.look_back.from(number).cloned()))
            .unwrap_or_default()
    }
}

impl<M: RawMutex> Default for RecordRings<M> {
    fn default() -> Self {
        Self::new()
    }
}
