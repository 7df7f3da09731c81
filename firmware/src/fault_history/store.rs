//! The store of faults: a log that takes one word of the flash for each fault.
//!
//! A word is either completely programmed or fails its checksum, so a power cut loses only the fault that was being
//! written. The log uses the sectors in turn and erases a sector only when it reaches the sector's start. At that time
//! the previous sector is full and contains every fault that must be kept.

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
/// Largest number of words that one fault may waste because they do not read back as written.
const WRITE_ATTEMPTS: u8 = 4;

/// A fault was not stored: the flash fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultNotStored;

/// The store of the last faults.
#[derive(Debug)]
pub struct FaultStore<F> {
    pub(super) flash: F,
    /// End of the newest fault; `None` before the flash has been read.
    end: Option<u32>,
}

impl<F: NorFlash> FaultStore<F> {
    /// A store that takes the whole of `flash`.
    ///
    /// # Errors
    /// Returns the flash if it has less than two sectors, if a sector has room for less than twice the number of kept
    /// faults, or if a fault does not occupy whole words.
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

    /// The last stored faults, the oldest first. Unreadable faults are left out.
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

    /// Stores a fault. The store erases the flash only when the log reaches the start of a sector.
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

    /// The first erased word behind the newest fault. Erases the next sector if this sector is full.
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

/// Adds a fault to the ordered list of the newest faults; drops the oldest fault if there is no room.
fn keep(newest: &mut heapless::Vec<FaultEntry, FAULTS_KEPT>, entry: FaultEntry) {
    let place = newest.partition_point(|kept| kept.number < entry.number);
    // A word that did not read back when it was written may be readable later, so a fault may occur twice.
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

/// The fault in a word; `None` if the word contains no fault.
fn decode(word: &[u8; WORD]) -> Option<FaultEntry> {
    let (checked, checksum) = word.split_at_checked(CHECKED)?;
    // The mark is checked first, because most words are erased and need no checksum.
    let entry = checked.strip_prefix(&HISTORY_MARK)?;
    if checksum != CHECKSUM.checksum(checked).to_le_bytes() {
        return None;
    }
    postcard::from_bytes(entry).ok()
}
