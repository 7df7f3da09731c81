//! The store of faults: a log that takes one word of the flash for each fault.
//!
//! A word is programmed whole or fails its checksum, so a power cut loses the fault that was being written and nothing
//! else. The log goes through the sectors in turn, and erases a sector only when it comes to its start: by then the
//! sector before it is full, and holds every fault that is remembered.

use embedded_storage_async::nor_flash::NorFlash;

use crate::drive_board::FLASH_WORD_BYTES;
use crate::fault_list::{FAULTS_KEPT, FaultEntry};
use crate::image::CHECKSUM;

/// Bytes of a fault in the flash.
pub(super) const WORD: usize = FLASH_WORD_BYTES;
/// First bytes of a fault.
const HISTORY_MARK: [u8; 4] = *b"FLT1";
/// Bytes in front of the checksum.
const CHECKED: usize = WORD - 4;
/// How many words that do not read back as written are left behind for one fault.
const WRITE_ATTEMPTS: u8 = 4;

/// A fault was not stored: the flash fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultNotStored;

/// The store of the last faults.
#[derive(Debug)]
pub struct FaultStore<F> {
    pub(super) flash: F,
    /// Where the newest fault ends; `None` before the flash was read.
    end: Option<u32>,
}

impl<F: NorFlash> FaultStore<F> {
    /// A store that takes the whole of `flash`.
    ///
    /// # Errors
    /// Returns the flash if it has less than two sectors, if a sector holds less than twice the faults that are
    /// remembered, or if a fault takes more or less than whole words of it.
    pub fn new(flash: F) -> Result<Self, F> {
        let fits = WORD.is_multiple_of(F::WRITE_SIZE)
            && F::ERASE_SIZE.is_multiple_of(WORD)
            && F::ERASE_SIZE >= 2 * FAULTS_KEPT * WORD
            && flash.capacity() >= 2 * F::ERASE_SIZE
            && flash.capacity().is_multiple_of(F::ERASE_SIZE);
        if fits {
            Ok(Self { flash, end: None })
        } else {
            Err(flash)
        }
    }

    /// The last stored faults, the oldest first. What cannot be read is left out.
    pub async fn load(&mut self) -> heapless::Vec<FaultEntry, FAULTS_KEPT> {
        let mut newest: heapless::Vec<FaultEntry, FAULTS_KEPT> = heapless::Vec::new();
        let mut end = 0;
        for offset in (0..self.flash.capacity()).step_by(WORD) {
            let Some(entry) = self.word(offset as u32).await.as_ref().and_then(decode) else {
                continue;
            };
            if newest.last().is_none_or(|last| last.number < entry.number) {
                end = (offset + WORD) as u32;
            }
            keep(&mut newest, entry);
        }
        self.end = Some(end);
        newest
    }

    /// Stores a fault. The flash is erased only where the log comes to the start of a sector.
    ///
    /// # Errors
    /// [`FaultNotStored`] if the fault does not read back.
    pub async fn store(&mut self, entry: &FaultEntry) -> Result<(), FaultNotStored> {
        if self.end.is_none() {
            self.load().await;
        }
        let word = encode(entry).ok_or(FaultNotStored)?;
        let mut attempts = 0;
        while attempts < WRITE_ATTEMPTS {
            let at = self.next_erased().await?;
            let written = self.flash.write(at, &word).await.is_ok();
            self.end = Some(at + WORD as u32);
            if written && self.word(at).await == Some(word) {
                return Ok(());
            }
            attempts += 1;
        }
        Err(FaultNotStored)
    }

    /// The first erased word behind the newest fault. Erases the next sector if there is none left in this one.
    async fn next_erased(&mut self) -> Result<u32, FaultNotStored> {
        let sector = F::ERASE_SIZE as u32;
        let mut at = self.end.unwrap_or_default();
        // The first word of a sector is erased with its sector, unless the log has not begun.
        while at == 0 || !at.is_multiple_of(sector) {
            if self.word(at).await == Some([0xFF; WORD]) {
                return Ok(at);
            }
            at += WORD as u32;
        }
        let start = if at as usize >= self.flash.capacity() { 0 } else { at };
        self.flash
            .erase(start, start + sector)
            .await
            .map_err(|_| FaultNotStored)?;
        Ok(start)
    }

    /// One word; `None` if it cannot be read.
    async fn word(&mut self, offset: u32) -> Option<[u8; WORD]> {
        let mut word = [0; WORD];
        self.flash.read(offset, &mut word).await.ok()?;
        Some(word)
    }
}

/// Adds a fault to the newest ones, which are in order; the oldest one goes if there is no room.
fn keep(newest: &mut heapless::Vec<FaultEntry, FAULTS_KEPT>, entry: FaultEntry) {
    let place = newest.partition_point(|kept| kept.number < entry.number);
    // A word that did not read back when it was written may be readable later: the fault is there twice.
    if newest.get(place).is_some_and(|kept| kept.number == entry.number) {
        return;
    }
    if !newest.is_full() {
        // There is room.
        let _ = newest.insert(place, entry);
    } else if let Some(place) = place.checked_sub(1) {
        newest.remove(0);
        let _ = newest.insert(place, entry);
    }
}

/// A fault as a word of the flash; `None` if it does not fit, which a test excludes.
fn encode(entry: &FaultEntry) -> Option<[u8; WORD]> {
    let mut word = [0; WORD];
    let (checked, checksum) = word.split_at_mut_checked(CHECKED)?;
    let (mark, rest) = checked.split_at_mut_checked(HISTORY_MARK.len())?;
    mark.copy_from_slice(&HISTORY_MARK);
    postcard::to_slice(entry, rest).ok()?;
    checksum.copy_from_slice(&CHECKSUM.checksum(checked).to_le_bytes());
    Some(word)
}

/// The fault that a word holds; `None` if it holds none.
fn decode(word: &[u8; WORD]) -> Option<FaultEntry> {
    let (checked, checksum) = word.split_at_checked(CHECKED)?;
    // The mark first: most words are erased, and need no checksum.
    let entry = checked.strip_prefix(&HISTORY_MARK)?;
    if checksum != CHECKSUM.checksum(checked).to_le_bytes() {
        return None;
    }
    postcard::from_bytes(entry).ok()
}
