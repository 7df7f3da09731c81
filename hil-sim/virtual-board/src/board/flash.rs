//! The virtual board's flash: the drive board's sectors for parameters, faults and updates, in memory.

use std::cell::RefCell;
use std::ops::Range;
use std::rc::Rc;

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use firmware::drive_board::{ARRIVED_SECTORS, FLASH_SECTOR_BYTES, FLASH_WORD_BYTES, PARAMETER_SECTORS};
use firmware::parameters::ParameterStore;
use model::vehicle::Vehicle;

/// Bytes of a store's flash.
const CAPACITY: usize = PARAMETER_SECTORS * FLASH_SECTOR_BYTES;

/// An access that the flash refuses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refused(NorFlashErrorKind);

impl NorFlashError for Refused {
    fn kind(&self) -> NorFlashErrorKind {
        self.0
    }
}

/// The flash. Clones share their contents, so the flash outlives a board that is switched off.
#[derive(Debug, Clone)]
pub struct VirtualFlash(Rc<RefCell<FlashCells>>);

#[derive(Debug)]
struct FlashCells {
    bytes: Vec<u8>,
    /// Bytes that are neither programmed nor erased.
    failing: Range<usize>,
}

impl VirtualFlash {
    /// An erased flash.
    pub fn erased() -> Self {
        Self::of(CAPACITY)
    }

    /// An erased area for an image.
    pub fn for_an_image() -> Self {
        Self::of(ARRIVED_SECTORS * FLASH_SECTOR_BYTES)
    }

    fn of(capacity: usize) -> Self {
        Self(Rc::new(RefCell::new(FlashCells {
            bytes: vec![0xFF; capacity],
            failing: 0..0,
        })))
    }

    /// From now on the flash refuses to program or erase these bytes, as a worn or protected one; none for an empty range.
    /// For tests.
    pub fn set_failing(&self, bytes: Range<usize>) {
        self.0.borrow_mut().failing = bytes;
    }

    /// A flash whose newest stored set is `vehicle`; `None` if the set does not fit.
    pub fn holding(vehicle: &Vehicle<f32>) -> Option<Self> {
        let flash = Self::erased();
        let mut store = ParameterStore::new(flash.clone()).ok()?;
        // The virtual flash never waits.
        embassy_futures::block_on(store.store(vehicle)).ok()?;
        Some(flash)
    }

    /// The contents, from the start of the flash.
    pub fn contents(&self) -> Vec<u8> {
        self.0.borrow().bytes.clone()
    }

    /// Overwrites the contents from the start of the flash, as a fault or another firmware would.
    pub fn overwrite(&self, bytes: &[u8]) {
        for (slot, byte) in self.0.borrow_mut().bytes.iter_mut().zip(bytes) {
            *slot = *byte;
        }
    }
}

impl FlashCells {
    /// Whether these bytes can be programmed and erased.
    fn check(&self, bytes: &Range<usize>) -> Result<(), Refused> {
        if bytes.start.max(self.failing.start) < bytes.end.min(self.failing.end) {
            return Err(Refused(NorFlashErrorKind::Other));
        }
        Ok(())
    }
}

/// The byte range of an access, if the access lies within `capacity` and is aligned to its unit.
fn range(capacity: usize, offset: u32, length: usize, unit: usize) -> Result<Range<usize>, Refused> {
    let from = offset as usize;
    if from + length > capacity {
        return Err(Refused(NorFlashErrorKind::OutOfBounds));
    }
    if !from.is_multiple_of(unit) || !length.is_multiple_of(unit) {
        return Err(Refused(NorFlashErrorKind::NotAligned));
    }
    Ok(from..from + length)
}

impl ErrorType for VirtualFlash {
    type Error = Refused;
}

impl ReadNorFlash for VirtualFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refused> {
        let range = range(self.capacity(), offset, bytes.len(), Self::READ_SIZE)?;
        bytes.copy_from_slice(&self.0.borrow().bytes[range]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.borrow().bytes.len()
    }
}

impl NorFlash for VirtualFlash {
    const WRITE_SIZE: usize = FLASH_WORD_BYTES;
    const ERASE_SIZE: usize = FLASH_SECTOR_BYTES;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refused> {
        let range = range(self.capacity(), offset, bytes.len(), Self::WRITE_SIZE)?;
        let mut flash = self.0.borrow_mut();
        flash.check(&range)?;
        for (slot, byte) in flash.bytes[range].iter_mut().zip(bytes) {
            // Programming only clears bits.
            *slot &= byte;
        }
        Ok(())
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Refused> {
        let length = to.checked_sub(from).ok_or(Refused(NorFlashErrorKind::OutOfBounds))?;
        let range = range(self.capacity(), from, length as usize, Self::ERASE_SIZE)?;
        let mut flash = self.0.borrow_mut();
        flash.check(&range)?;
        flash.bytes[range].fill(0xFF);
        Ok(())
    }
}
