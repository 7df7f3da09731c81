//! The flash of the stores' tests: it loses power, corrupts words, and refuses what a real NOR flash refuses.

use std::vec;
use std::vec::Vec;

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

pub const FLASH_WORD: usize = crate::drive_board::FLASH_WORD_BYTES;
pub const PAGE: usize = 4096;
pub const PAGES: usize = 2;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trouble {
    /// The power is gone.
    Cut,
    /// Error correction cannot restore the word.
    Unreadable,
    /// The option bytes keep it from being written.
    Protected,
}

impl NorFlashError for Trouble {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// A NOR flash with 32-byte words, each programmed once between erasures, as the drive board's.
#[derive(Debug, Clone)]
pub struct TestFlash {
    pub bytes: Vec<u8>,
    /// Whether error correction can no longer restore each word.
    pub damaged: Vec<bool>,
    /// Words that read as erased and end damaged when they are programmed.
    pub worn: Vec<usize>,
    /// A word that can no longer be read once so many more words have been programmed.
    pub decays: Option<(usize, usize)>,
    /// Number of words that may still be programmed, or pages erased, before the power goes. After that the
    /// flash does nothing.
    pub power: usize,
    dead: bool,
    /// Bytes that are neither programmed nor erased.
    pub protected: core::ops::Range<usize>,
    /// Whether the word that a power cut hits ends damaged (as on the part) or half written, and the words of the page that it
    /// hits each by chance (as on the part) or half of them erased.
    pub damage_on_cut: bool,
    /// Seed of what a cut erasure leaves of its page's words.
    pub seed: u32,
    /// Whether a word that is programmed twice ends damaged, as on the part, or fails the test.
    pub damage_on_rewrite: bool,
}

impl TestFlash {
    pub fn new() -> Self {
        Self::with_pages(PAGES)
    }

    pub fn with_pages(pages: usize) -> Self {
        Self {
            bytes: vec![0xFF; PAGE * pages],
            damaged: vec![false; PAGE * pages / FLASH_WORD],
            worn: Vec::new(),
            decays: None,
            power: usize::MAX,
            dead: false,
            protected: 0..0,
            damage_on_cut: true,
            seed: 7,
            damage_on_rewrite: false,
        }
    }

    /// Whether the next operation still has power; uses up its share.
    fn powered(&mut self) -> bool {
        let powered = self.power > 0;
        self.power = self.power.saturating_sub(1);
        powered
    }

    /// One more word is programmed: another one may be lost by it.
    fn decay(&mut self) {
        match &mut self.decays {
            Some((0, word)) => {
                self.damaged[*word] = true;
                self.decays = None;
            }
            Some((words, _)) => *words -= 1,
            None => {}
        }
    }

    /// Each word as it was, erased, unreadable, or with some of its bits erased.
    fn erase_by_chance(&mut self, bytes: core::ops::Range<usize>) {
        // xorshift32, whose state is never 0.
        let mut state = self.seed.wrapping_mul(0x9E37_79B9) | 1;
        let mut chance = || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            state
        };
        for at in bytes.step_by(FLASH_WORD) {
            let word = &mut self.bytes[at..at + FLASH_WORD];
            match chance() >> 30 {
                0 => {}
                1 => {
                    word.fill(0xFF);
                    self.damaged[at / FLASH_WORD] = false;
                }
                2 => self.damaged[at / FLASH_WORD] = true,
                _ => word.iter_mut().for_each(|byte| *byte |= (chance() >> 24) as u8),
            }
        }
    }

    /// Brings the power back.
    pub fn revive(&mut self) {
        self.power = usize::MAX;
        self.dead = false;
    }
}

impl ErrorType for TestFlash {
    type Error = Trouble;
}

impl ReadNorFlash for TestFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Trouble> {
        if self.dead {
            return Err(Trouble::Cut);
        }
        let from = offset as usize;
        let words = from / FLASH_WORD..(from + bytes.len()).div_ceil(FLASH_WORD);
        if self.damaged[words].iter().any(|damaged| *damaged) {
            return Err(Trouble::Unreadable);
        }
        bytes.copy_from_slice(&self.bytes[from..from + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for TestFlash {
    const WRITE_SIZE: usize = FLASH_WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Trouble> {
        assert!(
            (offset as usize).is_multiple_of(FLASH_WORD) && bytes.len().is_multiple_of(FLASH_WORD),
            "aligned to words"
        );
        if self.dead {
            return Err(Trouble::Cut);
        }
        for (i, word) in bytes.chunks(FLASH_WORD).enumerate() {
            let at = offset as usize + i * FLASH_WORD;
            if self.protected.contains(&at) {
                return Err(Trouble::Protected);
            }
            let cut = !self.powered();
            let fresh = self.bytes[at..at + FLASH_WORD].iter().all(|b| *b == 0xFF);
            let spoilt = self.worn.contains(&(at / FLASH_WORD)) || (!fresh && self.damage_on_rewrite);
            if !cut && spoilt {
                self.damaged[at / FLASH_WORD] = true;
                continue;
            }
            assert!(
                cut || fresh,
                "a word is programmed once between erasures: {at:#x} holds {:02x?} and should get {word:02x?}",
                &self.bytes[at..at + FLASH_WORD]
            );
            if cut {
                self.dead = true;
                self.damaged[at / FLASH_WORD] |= self.damage_on_cut;
                self.bytes[at..at + FLASH_WORD / 2].copy_from_slice(&word[..FLASH_WORD / 2]);
                return Err(Trouble::Cut);
            }
            self.bytes[at..at + FLASH_WORD].copy_from_slice(word);
            self.decay();
        }
        Ok(())
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Trouble> {
        if self.dead {
            return Err(Trouble::Cut);
        }
        for page in (from as usize / PAGE)..(to as usize / PAGE) {
            let range = page * PAGE..(page + 1) * PAGE;
            if self.protected.contains(&range.start) {
                return Err(Trouble::Protected);
            }
            if !self.powered() {
                self.dead = true;
                if self.damage_on_cut {
                    self.erase_by_chance(range);
                } else {
                    self.bytes[range.start..range.start + PAGE / 2].fill(0xFF);
                }
                return Err(Trouble::Cut);
            }
            self.bytes[range.clone()].fill(0xFF);
            self.damaged[range.start / FLASH_WORD..range.end / FLASH_WORD].fill(false);
        }
        Ok(())
    }
}
