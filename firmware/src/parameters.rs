//! Stored parameters: the vehicle's numbers in flash, versioned, checked, and changed over the link.
//!
//! The whole set is one item of a power-fail-safe store: after a cut at any moment either the old or the
//! new set is there, never a mixture. A set is believed only if the store's checksum holds, its schema
//! (names and ranges of every field) is this firmware's, every value is in range and the set is
//! consistent; anything else gives the built-in vehicle and a line in the log.

use crc::{CRC_32_ISCSI, Crc};
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, Timer};
use embedded_storage_async::nor_flash::{ErrorType, MultiwriteNorFlash, NorFlash, ReadNorFlash};
use model::supervise::arming::Mode;
use model::supervise::codes::Blocker;
use model::vehicle::{NotSet, ParameterError, Vehicle, VehicleParameters};
use sequential_storage::cache::key_pointers::ArrayKeyPointers;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use crate::link::message::{ParameterAnswer, ParameterRequest};
use crate::topics::Topics;

/// Longest stored set, a multiple of any flash's word.
const SET_MAX: usize = 512;
/// Schema, number of values.
const HEADER: usize = 8;
/// Key of the set in the store.
const KEY: u8 = 1;
const HASH: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// Hash of the names and ranges of every parameter of a vehicle of this kind, in order.
pub fn schema(parameters: &VehicleParameters<f32>) -> u32 {
    let mut digest = HASH.digest();
    for (table, field) in (0..parameters.count()).filter_map(|number| parameters.field(number)) {
        digest.update(table.as_bytes());
        digest.update(field.name.as_bytes());
        digest.update(&field.min.to_le_bytes());
        digest.update(&field.max.to_le_bytes());
    }
    digest.finalize()
}

/// Number of the parameter that an error is about.
fn number_of(parameters: &VehicleParameters<f32>, error: &ParameterError) -> u16 {
    let (group, name) = match error {
        ParameterError::OutOfRange(out) => (out.group, out.field.name),
        ParameterError::Inconsistent { group, field, .. } | ParameterError::Unstable { group, field, .. } => {
            (*group, *field)
        }
    };
    parameters.number_of(group, name).unwrap_or(u16::MAX)
}

/// Encodes a set; its length.
fn encode(parameters: &VehicleParameters<f32>, bytes: &mut [u8; SET_MAX]) -> Option<usize> {
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

/// Decodes a set for a vehicle of the kind of `like`; `None` if the schema or the length is another.
fn decode(bytes: &[u8], like: &VehicleParameters<f32>) -> Option<VehicleParameters<f32>> {
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
    /// Nothing was ever stored, or it was erased.
    Absent,
    /// What is there cannot be believed.
    Corrupt,
}

/// Remembers where the newest set is. A store that moves to the next page asks it of every old set it
/// meets; without this each question reads a whole page, which for a full one takes seconds.
type WhereNewest = Cache<Uncached, Uncached, ArrayKeyPointers<u8, 1>, u8>;

/// The store.
pub struct ParameterStore<F: NorFlash> {
    map: MapStorage<u8, Tolerant<F>, WhereNewest>,
    buffer: [u8; SET_MAX + 64],
}

impl<F: NorFlash> ParameterStore<F> {
    /// The store in the whole of `flash`, at least two of its erasable pages.
    ///
    /// # Errors
    /// The flash back, if it cannot hold a store.
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

    /// The stored vehicle, of the kind of `like`.
    ///
    /// # Errors
    /// [`NoSet`]: absent, or not to be believed.
    pub async fn load(&mut self, like: &VehicleParameters<f32>) -> Result<Vehicle<f32>, NoSet> {
        let bytes: &[u8] = match self.map.fetch_item(&mut self.buffer, &KEY).await {
            Ok(Some(bytes)) => bytes,
            Ok(None) => return Err(NoSet::Absent),
            Err(_) => return Err(NoSet::Corrupt),
        };
        let parameters = decode(bytes, like).ok_or(NoSet::Corrupt)?;
        Vehicle::new(parameters).map_err(|_| NoSet::Corrupt)
    }

    /// Stores a vehicle. A flash that holds no sound store is erased first.
    ///
    /// # Errors
    /// `()` if the flash fails.
    #[allow(clippy::result_unit_err)] // There is one way to fail, and nothing to tell of it.
    pub async fn store(&mut self, vehicle: &Vehicle<f32>) -> Result<(), ()> {
        let mut bytes = [0; SET_MAX];
        let length = encode(vehicle.parameters(), &mut bytes).ok_or(())?;
        let set = bytes.get(..length).ok_or(())?;
        if self.map.store_item(&mut self.buffer, &KEY, &set).await.is_ok() {
            return Ok(());
        }
        // The store repairs what a power cut leaves. Only where it finds no set is there nothing to lose
        // by starting anew.
        if let Ok(Some(_)) = self.map.fetch_item::<&[u8]>(&mut self.buffer, &KEY).await {
            return Err(());
        }
        self.map.erase_all().await.map_err(|_| ())?;
        self.map.store_item(&mut self.buffer, &KEY, &set).await.map_err(|_| ())
    }
}

/// Says in the log where the vehicle's numbers come from, and gives them.
pub async fn boot<F: NorFlash>(store: &mut ParameterStore<F>, built_in: &Vehicle<f32>) -> Vehicle<f32> {
    match store.load(built_in.parameters()).await {
        Ok(vehicle) => {
            info!("parameters: stored set");
            vehicle
        }
        Err(NoSet::Absent) => {
            info!("parameters: nothing stored, built-in set");
            *built_in
        }
        Err(NoSet::Corrupt) => {
            warning!("parameters: stored set is corrupt or of another firmware, built-in set");
            *built_in
        }
    }
}

/// How long the control task may take to see that arming is blocked.
const BLOCK_TIMEOUT: Duration = Duration::from_millis(20);

/// Answers requests for ever. `vehicle` is the set in force, `built_in` the one of the build.
pub async fn run<M: RawMutex, F: NorFlash>(
    topics: &Topics<M>,
    mut store: ParameterStore<F>,
    vehicle: Vehicle<f32>,
    built_in: Vehicle<f32>,
) -> ! {
    let mut staged = *vehicle.parameters();
    loop {
        let answer = match topics.parameter_requests.receive().await {
            ParameterRequest::Read { number } => match staged.value(number) {
                Some(value) => ParameterAnswer::Value {
                    number,
                    count: staged.count(),
                    value,
                    schema: schema(&staged),
                },
                None => ParameterAnswer::NoSuchNumber,
            },
            ParameterRequest::Write { number, value } => match staged.set(number, value) {
                Ok(()) => ParameterAnswer::Value {
                    number,
                    count: staged.count(),
                    value,
                    schema: schema(&staged),
                },
                Err(NotSet::NoSuchNumber) => ParameterAnswer::NoSuchNumber,
                Err(NotSet::OutOfRange(out)) => ParameterAnswer::OutOfRange {
                    min: out.field.min as f32,
                    max: out.field.max as f32,
                },
            },
            ParameterRequest::Defaults => {
                staged = *built_in.parameters();
                ParameterAnswer::DefaultsReady
            }
            ParameterRequest::Store => match Vehicle::new(staged) {
                Err(error) => ParameterAnswer::Inconsistent {
                    number: number_of(&staged, &error),
                },
                Ok(vehicle) => keep(topics, &mut store, &vehicle).await,
            },
        };
        topics.parameter_answers.send(answer).await;
    }
}

/// Blocks arming, stores the set, puts it in force, and unblocks.
async fn keep<M: RawMutex, F: NorFlash>(
    topics: &Topics<M>,
    store: &mut ParameterStore<F>,
    vehicle: &Vehicle<f32>,
) -> ParameterAnswer {
    let since = Instant::now();
    topics.parameters_pending.publish(since, true);
    let answer = if blocked(topics, since).await {
        if store.store(vehicle).await.is_ok() {
            topics.new_vehicle.signal(*vehicle);
            info!("parameters: stored");
            ParameterAnswer::Stored
        } else {
            warning!("parameters: the flash failed");
            ParameterAnswer::FlashFailed
        }
    } else {
        ParameterAnswer::Armed
    };
    topics.parameters_pending.publish(Instant::now(), false);
    answer
}

/// Waits until a tick after `since` says that the vehicle is disarmed and that arming is blocked.
async fn blocked<M: RawMutex>(topics: &Topics<M>, since: Instant) -> bool {
    while Instant::now().saturating_duration_since(since) < BLOCK_TIMEOUT {
        if let Some(status) = topics.status.latest()
            && status.at > since
        {
            let t = status.value;
            return t.mode == Mode::Disarmed && t.blockers.contains(Blocker::Parameters);
        }
        Timer::after(Duration::from_millis(1)).await;
    }
    false
}

/// A flash whose unreadable places read as zeros.
///
/// A power cut in the middle of a word can leave it beyond its error correction. The store must see
/// such a word as written and wrong, which its checksums find, and not as a flash that has failed.
struct Tolerant<F>(F);

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

#[cfg(test)]
mod tests;
