//! A flash that stays readable after a power cut in the middle of a word.

use embedded_storage_async::nor_flash::{ErrorType, MultiwriteNorFlash, NorFlash, ReadNorFlash};

/// A flash whose unreadable words read as zeros.
///
/// After a power cut in the middle of a word, the flash's error correction may no longer restore that word.
/// The store must see such a word as written and wrong, which the store's checksums find, and not as a flash
/// that failed.
pub(super) struct Tolerant<F>(pub(super) F);

/// Bytes that are read at once in the search for an unreadable word.
const READ_PIECE: usize = 32;

impl<F: ErrorType> ErrorType for Tolerant<F> {
    type Error = F::Error;
}

impl<F: NorFlash> ReadNorFlash for Tolerant<F> {
    /// One word: the store then reads its page markers as whole words, and takes a marker that a power cut
    /// left half written as written. Otherwise the store would program the word again, which no flash with
    /// error correction accepts.
    const READ_SIZE: usize = F::WRITE_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        if self.0.read(offset, bytes).await.is_ok() {
            return Ok(());
        }
        let mut at = offset as usize;
        let mut rest = bytes;
        while !rest.is_empty() {
            // Up to the next word's boundary, so that no good word is lost with a bad one.
            let length = rest.len().min(READ_PIECE - at % READ_PIECE);
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
