//! The store: one set of parameters in a power-fail-safe key-value store on a flash.

use embedded_storage_async::nor_flash::NorFlash;
use model::vehicle::{Vehicle, VehicleParameters};
use sequential_storage::cache::key_pointers::ArrayKeyPointers;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use super::numbered::{drivable, schema};
use super::tolerant_flash::Tolerant;

/// Longest stored set in bytes, a multiple of any flash's word.
pub(super) const SET_MAX: usize = 512;
/// Bytes in front of the values: the schema and the number of values, 4 bytes each.
pub(super) const HEADER: usize = 8;
/// Key of the set in the store.
const KEY: u8 = 1;

/// Encodes a set and returns its length in bytes; `None` if the set does not fit.
pub(super) fn encode(parameters: &VehicleParameters<f32>, bytes: &mut [u8; SET_MAX]) -> Option<usize> {
    let (header, values) = bytes.split_at_mut_checked(HEADER)?;
    header.get_mut(..4)?.copy_from_slice(&schema(parameters).to_le_bytes());
    header
        .get_mut(4..)?
        .copy_from_slice(&u32::from(parameters.count()).to_le_bytes());
    let mut slots = values.chunks_exact_mut(4);
    for number in 0..parameters.count() {
        slots.next()?.copy_from_slice(&parameters.value(number)?.to_le_bytes());
    }
    Some(HEADER + 4 * usize::from(parameters.count()))
}

/// Decodes a set for a vehicle of the kind of `like`; `None` if the schema or the length differs, or a value
/// is out of range.
pub(super) fn decode(bytes: &[u8], like: &VehicleParameters<f32>) -> Option<VehicleParameters<f32>> {
    let (header, values) = bytes.split_at_checked(HEADER)?;
    let (schema_bytes, count_bytes) = header.split_at_checked(4)?;
    let count = like.count();
    if schema_bytes != schema(like).to_le_bytes()
        || count_bytes != u32::from(count).to_le_bytes()
        || values.len() != 4 * usize::from(count)
    {
        return None;
    }
    let mut parameters = *like;
    for (number, bytes) in (0..count).zip(values.chunks_exact(4)) {
        let value = f32::from_le_bytes(bytes.try_into().ok()?);
        parameters.set(number, value).ok()?;
    }
    Some(parameters)
}

/// Why there is no stored set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoSet {
    /// Nothing was ever stored, or the flash was erased.
    Absent,
    /// The flash holds something that is no valid set of this firmware.
    Corrupt,
}

/// Remembers where the newest set is. A store that moves to the next page asks for that place at every old
/// set it meets; without the cache each question reads a whole page, and moving a full page takes seconds.
type WhereNewest = Cache<Uncached, Uncached, ArrayKeyPointers<u8, 1>, u8>;

/// The store of one set of parameters.
pub struct ParameterStore<F: NorFlash> {
    pub(super) map: MapStorage<u8, Tolerant<F>, WhereNewest>,
    buffer: [u8; SET_MAX + 64],
}

impl<F: NorFlash> ParameterStore<F> {
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
                buffer: [0; SET_MAX + 64],
            }),
            Err(_) => Err(flash),
        }
    }

    /// Loads the stored vehicle, of the kind of `like`.
    ///
    /// # Errors
    /// [`NoSet`]: nothing is stored, or nothing valid.
    pub async fn load(&mut self, like: &VehicleParameters<f32>) -> Result<Vehicle<f32>, NoSet> {
        let bytes: &[u8] = match self.map.fetch_item(&mut self.buffer, &KEY).await {
            Ok(Some(bytes)) => bytes,
            Ok(None) => return Err(NoSet::Absent),
            Err(_) => return Err(NoSet::Corrupt),
        };
        let parameters = decode(bytes, like).ok_or(NoSet::Corrupt)?;
        drivable(&parameters).map_err(|_| NoSet::Corrupt)
    }

    /// Stores a vehicle. A flash that holds no sound store is erased first.
    ///
    /// # Errors
    /// `()` if the flash fails; the set stored before stays.
    #[allow(clippy::result_unit_err)] // The flash fails in one way only.
    pub async fn store(&mut self, vehicle: &Vehicle<f32>) -> Result<(), ()> {
        let mut bytes = [0; SET_MAX];
        let length = encode(vehicle.parameters(), &mut bytes).ok_or(())?;
        let set = bytes.get(..length).ok_or(())?;
        if self.map.store_item(&mut self.buffer, &KEY, &set).await.is_ok() {
            return Ok(());
        }
        // The store repairs what a power cut leaves. Erasing everything loses nothing only if the store finds
        // no set.
        if let Ok(Some(_)) = self.map.fetch_item::<&[u8]>(&mut self.buffer, &KEY).await {
            return Err(());
        }
        self.map.erase_all().await.map_err(|_| ())?;
        self.map.store_item(&mut self.buffer, &KEY, &set).await.map_err(|_| ())
    }
}
