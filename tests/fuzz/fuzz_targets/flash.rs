//! A small flash in memory, whose image a target can choose and change.

#![allow(dead_code)] // Each target uses part of it.

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

/// The size of the board's flash words, and sectors that fill soon.
pub const WORD: usize = 32;
pub const PAGE: usize = 4096;
pub const PAGES: usize = 2;

/// A flash of two sectors, in which programming clears bits and erasing sets them; clones are the same flash.
#[derive(Debug, Clone)]
pub struct Flash(Rc<RefCell<Vec<u8>>>);

impl Flash {
    pub fn erased() -> Self {
        Self::holding(vec![0xFF; PAGE * PAGES])
    }

    /// A flash with this image.
    pub fn holding(image: Vec<u8>) -> Self {
        Self(Rc::new(RefCell::new(image)))
    }

    /// The image of the flash.
    pub fn image(&self) -> Vec<u8> {
        self.0.borrow().clone()
    }

    /// Changes single bytes. Each edit has three bytes: two for the place, and the byte's new value.
    pub fn edit(&self, edits: &[u8]) {
        let mut image = self.0.borrow_mut();
        for edit in edits.chunks_exact(3) {
            let place = usize::from(u16::from_le_bytes([edit[0], edit[1]])) % image.len();
            image[place] = edit[2];
        }
    }
}

impl ErrorType for Flash {
    type Error = Infallible;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
        bytes.copy_from_slice(&self.0.borrow()[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.borrow().len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
        assert!((offset as usize).is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD));
        for (slot, byte) in self.0.borrow_mut()[offset as usize..][..bytes.len()]
            .iter_mut()
            .zip(bytes)
        {
            *slot &= byte;
        }
        Ok(())
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
        assert!((from as usize).is_multiple_of(PAGE) && (to as usize).is_multiple_of(PAGE));
        self.0.borrow_mut()[from as usize..to as usize].fill(0xFF);
        Ok(())
    }
}
