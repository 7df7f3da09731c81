//! The store of faults: a place for each, and the newest one replaces the oldest.

use embedded_storage_async::nor_flash::NorFlash;
use sequential_storage::cache::key_pointers::ArrayKeyPointers;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use crate::fault_list::{FAULTS_KEPT, FaultEntry};
use crate::parameters::Tolerant;

/// Longest stored entry, bytes.
const ENTRY_MAX: usize = 24;
/// Room for an entry and what the store writes around it, a multiple of any flash's word.
const BUFFER: usize = 128;

/// Remembers where the newest item of each place is: moving to the next page asks for each.
type WhereNewest = Cache<Uncached, Uncached, ArrayKeyPointers<u8, FAULTS_KEPT>, u8>;

/// The store of the last faults.
pub struct FaultStore<F: NorFlash> {
    map: MapStorage<u8, Tolerant<F>, WhereNewest>,
    buffer: [u8; BUFFER],
}

impl<F: NorFlash> FaultStore<F> {
    /// A store that takes the whole of `flash`, which needs at least two erasable pages.
    ///
    /// # Errors
    /// Returns the flash if it cannot hold a store.
    pub fn new(flash: F) -> Result<Self, F> {
        let pages = flash.capacity() / F::ERASE_SIZE;
        match MapConfig::try_new(0..(pages * F::ERASE_SIZE) as u32) {
            Ok(config) => Ok(Self {
                map: MapStorage::new(
                    Tolerant(flash),
                    config,
                    Cache::new(Uncached, Uncached, ArrayKeyPointers::new()),
                ),
                buffer: [0; BUFFER],
            }),
            Err(_) => Err(flash),
        }
    }

    /// The stored faults, the oldest first. What cannot be read is left out.
    pub async fn load(&mut self) -> heapless::Vec<FaultEntry, FAULTS_KEPT> {
        let mut entries = heapless::Vec::new();
        for place in 0..FAULTS_KEPT as u8 {
            let stored = self.map.fetch_item::<&[u8]>(&mut self.buffer, &place).await;
            if let Ok(Some(bytes)) = stored
                && let Ok(entry) = postcard::from_bytes::<FaultEntry>(bytes)
                && place_of(&entry) == place
            {
                // As many places as there is room.
                let _ = entries.push(entry);
            }
        }
        entries.sort_unstable_by_key(|entry| entry.number);
        entries
    }

    /// Stores a fault. A flash that holds no sound store is erased first: what it held cannot be read.
    ///
    /// # Errors
    /// `()` if the flash fails.
    #[allow(clippy::result_unit_err)] // The flash fails in one way only.
    pub async fn store(&mut self, entry: &FaultEntry) -> Result<(), ()> {
        let mut bytes = [0; ENTRY_MAX];
        let bytes: &[u8] = postcard::to_slice(entry, &mut bytes).map_err(|_| ())?;
        let place = place_of(entry);
        if self.map.store_item(&mut self.buffer, &place, &bytes).await.is_ok() {
            return Ok(());
        }
        self.map.erase_all().await.map_err(|_| ())?;
        self.map
            .store_item(&mut self.buffer, &place, &bytes)
            .await
            .map_err(|_| ())
    }
}

/// The place of a fault in the store.
fn place_of(entry: &FaultEntry) -> u8 {
    (entry.number % FAULTS_KEPT as u32) as u8
}
