//! The store: one set of parameters in a power-fail-safe key-value store on a flash.
//!
//! A set occupies three or four items: two places for sets alternate, and two copies of a receipt identify the set in
//! force by its sequence number and checksum. The receipts are written after the set, so an incompletely written set
//! is never in force. To read the receipts, the store searches the whole flash instead of asking the key-value store.
//! Even when damage hides the newest set, its receipt then shows that the set is missing, and the store does not use
//! an older set instead.

use embedded_storage_async::nor_flash::{NorFlash, ReadNorFlash};
use model::vehicle::Vehicle;
use sequential_storage::cache::key_pointers::ArrayKeyPointers;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use super::encoding::{SET_MAX, StoredSet, decode, encode, read_by_name};
use super::numbered::{drivable, number_of};
use super::tolerant_flash::Tolerant;
use crate::image::CHECKSUM;

/// Key of the only item of a store of version 0.1.
pub(super) const VERSION_1: u8 = 1;
/// Keys of the places for sets of even and of odd sequence numbers.
const PLACES: [u8; 2] = [2, 3];
/// Keys of the receipt's copies.
const RECEIPTS: [u8; 2] = [4, 5];
/// Bytes of a receipt: mark, sequence number and checksum of the set, checksum of the receipt.
const RECEIPT: usize = 16;
/// First bytes of a receipt.
const RECEIPT_MARK: [u8; 4] = *b"RCPT";
/// Bytes that the search for receipts reads at once, and by how many the next piece overlaps: a multiple of any
/// flash's word, and enough for a receipt.
const SCANNED_PIECE: usize = 1024;
const OVERLAP: usize = 32;
/// Number of attempts to write a set that does not read back. Each attempt uses new words of the flash.
const STORE_ATTEMPTS: u8 = 3;

/// Where the vehicle's parameters came from at boot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BootOutcome {
    /// The stored set.
    Stored,
    /// The stored set, which firmware with other parameters wrote, read by the parameters' names.
    Migrated {
        /// Number of parameters that the set does not contain; they have their built-in values.
        as_built_in: u16,
        /// Number of the set's values that belong to no parameter of this firmware.
        dropped: u16,
    },
    /// The built-in set: nothing was ever stored, or the flash was erased.
    NothingStored,
    /// The built-in set, because the stored data cannot be believed. The vehicle must not arm before a set is stored.
    NotBelieved(Disbelief),
}

/// Why the stored data are not believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Disbelief {
    /// The set in force cannot be read: the flash is damaged or contains other data.
    Unreadable,
    /// The value of the parameter of this number is out of its range in this firmware.
    OutOfRange(u16),
    /// The set is inconsistent in this firmware; the number of a parameter that contradicts another.
    Inconsistent(u16),
}

/// The vehicle to boot with, and its origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Booted {
    /// The vehicle.
    pub vehicle: Vehicle<f32>,
    /// Where its parameters came from.
    pub outcome: BootOutcome,
}

/// A set was not stored, because it does not read back. The previous set is still stored, unless the whole flash
/// fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotStored;

/// The set in force, as a receipt names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Receipt {
    sequence: u32,
    checksum: u32,
}

impl Receipt {
    fn of(sequence: u32, set: &[u8]) -> Self {
        Self {
            sequence,
            checksum: CHECKSUM.checksum(set),
        }
    }

    fn bytes(self) -> [u8; RECEIPT] {
        let mut bytes = [0; RECEIPT];
        let checksum = self.own_checksum();
        let words = [
            RECEIPT_MARK,
            self.sequence.to_le_bytes(),
            self.checksum.to_le_bytes(),
            checksum.to_le_bytes(),
        ];
        for (slot, word) in bytes.chunks_exact_mut(4).zip(words) {
            slot.copy_from_slice(&word);
        }
        bytes
    }

    fn own_checksum(self) -> u32 {
        let mut digest = CHECKSUM.digest();
        digest.update(&RECEIPT_MARK);
        digest.update(&self.sequence.to_le_bytes());
        digest.update(&self.checksum.to_le_bytes());
        digest.finalize()
    }

    /// The receipt whose item starts with these bytes of the flash: its key and its value.
    fn read(item: &[u8]) -> Option<Self> {
        let (key, value) = item.split_first()?;
        let (sequence, rest) = value.strip_prefix(&RECEIPT_MARK)?.split_first_chunk::<4>()?;
        let (checksum, rest) = rest.split_first_chunk::<4>()?;
        let receipt = Self {
            sequence: u32::from_le_bytes(*sequence),
            checksum: u32::from_le_bytes(*checksum),
        };
        let sound = RECEIPTS.contains(key) && rest.first_chunk() == Some(&receipt.own_checksum().to_le_bytes());
        sound.then_some(receipt)
    }

    /// Key of the place of the receipt's set.
    fn place(self) -> u8 {
        let [even, odd] = PLACES;
        if self.sequence.is_multiple_of(2) { even } else { odd }
    }
}

/// The contents of the flash.
#[allow(clippy::large_enum_variant)] // There is no heap to put the set on.
enum Content {
    /// Nothing: every word is erased.
    Nothing,
    /// A set, and its receipt if its format has one.
    Set(StoredSet, Option<Receipt>),
    /// Data whose set in force is unreadable, and the set's receipt if that is readable.
    Unreadable(Option<Receipt>),
}

/// Caches the place of the newest item of each key. When the store moves to the next page, it asks for that place at
/// every old item. Without the cache each question reads a whole page, and moving a full page takes seconds.
type WhereNewest = Cache<Uncached, Uncached, ArrayKeyPointers<u8, 4>, u8>;

/// The items in a flash.
type Items<'a, F> = MapStorage<u8, &'a mut Tolerant<F>, WhereNewest>;

/// The store of one set of parameters.
pub struct ParameterStore<F: NorFlash> {
    pub(super) flash: Tolerant<F>,
    buffer: [u8; SET_MAX + 64],
}

impl<F: NorFlash> ParameterStore<F> {
    /// A store that takes the whole of `flash`, which needs at least two erasable pages.
    ///
    /// # Errors
    /// Returns the flash if it cannot hold a store.
    pub fn new(flash: F) -> Result<Self, F> {
        let mut store = Self {
            flash: Tolerant(flash),
            buffer: [0; SET_MAX + 64],
        };
        if store.map().is_some() {
            Ok(store)
        } else {
            Err(store.flash.0)
        }
    }

    /// The items in the flash, as a boot finds them (nothing is remembered from one call to the next), and the
    /// buffer.
    fn map(&mut self) -> Option<(Items<'_, F>, &mut [u8])> {
        let pages = self.flash.capacity() / F::ERASE_SIZE;
        let config = MapConfig::try_new(0..(pages * F::ERASE_SIZE) as u32).ok()?;
        let cache = Cache::new(Uncached, Uncached, ArrayKeyPointers::new());
        Some((MapStorage::new(&mut self.flash, config, cache), &mut self.buffer))
    }

    /// The newest readable item of a key.
    async fn item(&mut self, key: u8) -> Option<&[u8]> {
        let (mut map, buffer) = self.map()?;
        map.fetch_item(buffer, &key).await.ok()?
    }

    pub(super) async fn put(&mut self, key: u8, bytes: &[u8]) {
        if let Some((mut map, buffer)) = self.map() {
            // Reading the item shows later whether it was stored.
            let _ = map.store_item(buffer, &key, &bytes).await;
        }
    }

    /// Searches the whole flash. Returns the newest receipt, and whether every byte is erased.
    async fn search(&mut self) -> (Option<Receipt>, bool) {
        let capacity = self.flash.capacity();
        let (mut newest, mut erased, mut at) = (None::<Receipt>, true, 0);
        loop {
            let length = SCANNED_PIECE.min(capacity.saturating_sub(at));
            let Some(piece) = self.buffer.get_mut(..length) else {
                break;
            };
            if self.flash.read(at as u32, piece).await.is_err() {
                erased = false;
            } else if !is_erased(piece) {
                erased = false;
                // An item's contents start with a word.
                let items = piece.windows(1 + RECEIPT).step_by(F::WRITE_SIZE);
                for receipt in items.filter_map(Receipt::read) {
                    if newest.is_none_or(|newest| newest.sequence < receipt.sequence) {
                        newest = Some(receipt);
                    }
                }
            }
            if length < SCANNED_PIECE || at + length >= capacity {
                break;
            }
            at += SCANNED_PIECE - OVERLAP;
        }
        (newest, erased)
    }

    /// The contents of the flash.
    async fn content(&mut self) -> Content {
        let (receipt, erased) = self.search().await;
        if erased {
            return Content::Nothing;
        }
        let Some(receipt) = receipt else {
            let set = self.item(VERSION_1).await.and_then(decode);
            return match set.filter(|set| !set.present_format) {
                Some(set) => Content::Set(set, None),
                None => Content::Unreadable(None),
            };
        };
        let set = self.item(receipt.place()).await;
        let set = set.filter(|set| Receipt::of(receipt.sequence, set) == receipt);
        match set.and_then(decode) {
            Some(set) if set.sequence == receipt.sequence => Content::Set(set, Some(receipt)),
            _ => Content::Unreadable(Some(receipt)),
        }
    }

    /// Loads the vehicle to drive with: the stored one, or `built_in`. The flash is unchanged, except for repairs
    /// after a power cut.
    pub async fn load(&mut self, built_in: &Vehicle<f32>) -> Booted {
        let not_believed = |why| Booted {
            vehicle: *built_in,
            outcome: BootOutcome::NotBelieved(why),
        };
        let stored = match self.content().await {
            Content::Nothing => {
                return Booted {
                    vehicle: *built_in,
                    outcome: BootOutcome::NothingStored,
                };
            }
            Content::Unreadable(_) => return not_believed(Disbelief::Unreadable),
            Content::Set(stored, _) => stored,
        };
        let read = match read_by_name(&stored, built_in.parameters()) {
            Ok(read) => read,
            Err(number) => return not_believed(Disbelief::OutOfRange(number)),
        };
        let outcome = if stored.present_format && read.as_built_in == 0 && read.dropped == 0 {
            BootOutcome::Stored
        } else {
            BootOutcome::Migrated {
                as_built_in: read.as_built_in,
                dropped: read.dropped,
            }
        };
        match drivable(&read.parameters) {
            Ok(vehicle) => Booted { vehicle, outcome },
            Err(error) => not_believed(Disbelief::Inconsistent(number_of(&read.parameters, &error))),
        }
    }

    /// Stores a vehicle, and reads it back as the next boot will. A flash without a readable set is erased if the set
    /// does not read back otherwise.
    ///
    /// # Errors
    /// [`NotStored`] if the set does not read back.
    pub async fn store(&mut self, vehicle: &Vehicle<f32>) -> Result<(), NotStored> {
        let (before, has_set) = match self.content().await {
            Content::Nothing => (None, false),
            Content::Unreadable(receipt) => (receipt, false),
            Content::Set(_, receipt) => (receipt, true),
        };
        let sequence = before.map_or(0, |receipt| receipt.sequence).wrapping_add(1);
        let mut bytes = [0; SET_MAX];
        let length = encode(vehicle.parameters(), sequence, &mut bytes).ok_or(NotStored)?;
        let set = bytes.get(..length).ok_or(NotStored)?;
        for _ in 0..STORE_ATTEMPTS {
            if self.write(sequence, set).await {
                return Ok(());
            }
        }
        if has_set {
            return Err(NotStored);
        }
        let (mut map, _) = self.map().ok_or(NotStored)?;
        map.erase_all().await.map_err(|_| NotStored)?;
        if self.write(sequence, set).await {
            Ok(())
        } else {
            Err(NotStored)
        }
    }

    /// Writes a set and its receipts once. Returns whether the next boot will find them.
    pub(super) async fn write(&mut self, sequence: u32, set: &[u8]) -> bool {
        let receipt = Receipt::of(sequence, set);
        self.put(receipt.place(), set).await;
        if self.item(receipt.place()).await != Some(set) {
            return false;
        }
        for key in RECEIPTS {
            self.put(key, &receipt.bytes()).await;
        }
        // The receipts may have moved the store to another page.
        self.search().await.0 == Some(receipt) && self.item(receipt.place()).await == Some(set)
    }
}

/// Whether bytes of the flash are erased.
fn is_erased(bytes: &[u8]) -> bool {
    // Eight bytes at a time, because a boot with an empty flash searches the whole flash.
    let (eights, rest) = bytes.as_chunks::<8>();
    eights.iter().all(|eight| *eight == [0xFF; 8]) && rest.iter().all(|byte| *byte == 0xFF)
}
