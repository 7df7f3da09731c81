//! A flash in which a word that lost its power halfway is an unsound word, and no failure of the flash.

use embedded_storage_async::nor_flash::{ErrorType, MultiwriteNorFlash, NorFlash, ReadNorFlash};

/// A flash whose unreadable places read as zeros.
///
/// A power cut in the middle of a word can leave it beyond its error correction. The store must see
/// such a word as written and wrong, which its checksums find, and not as a flash that has failed.
pub(super) struct Tolerant<F>(pub(super) F);

/// Largest piece in which an unreadable place is looked for.
const PIECE: usize = 32;

impl<F: ErrorType> ErrorType for Tolerant<F> {
    type Error = F::Error;
}

impl<F: NorFlash> ReadNorFlash for Tolerant<F> {
    /// A word: the store then judges its page markers by whole words, and sees one that was cut halfway
    /// as written, where it would otherwise program it again, which no flash with error correction takes.
    const READ_SIZE: usize = F::WRITE_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        if self.0.read(offset, bytes).await.is_ok() {
            return Ok(());
        }
        let mut at = offset as usize;
        let mut rest = bytes;
        while !rest.is_empty() {
            // Up to the next word's boundary, so that a good word is not lost with a bad one.
            let length = rest.len().min(PIECE - at % PIECE);
            let Some((piece, after)) = rest.split_at_mut_checked(length) else {
                break;
            };
            if self.0.read(at as u32, piece).await.is_err() {
                piece.fill(0);
            }
            at += length;
            rest = after;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<F: NorFlash> NorFlash for Tolerant<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), F::Error> {
        self.0.erase(from, to).await
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), F::Error> {
        self.0.write(offset, bytes).await
    }
}

impl<F: MultiwriteNorFlash> MultiwriteNorFlash for Tolerant<F> {}
