//! A flash that several stores share: each store has its own sectors, and their accesses take turns.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_sync::mutex::Mutex;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// Why an access failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RegionError<E> {
    /// The access does not lie in the region.
    Bounds,
    /// The flash failed.
    Flash(E),
}

impl<E: NorFlashError> NorFlashError for RegionError<E> {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Bounds => NorFlashErrorKind::OutOfBounds,
            Self::Flash(error) => error.kind(),
        }
    }
}

/// Some consecutive sectors of a shared flash. Reads also take turns with writes, because reading a bank that is being
/// erased may stop the core until the erase is over.
#[allow(missing_debug_implementations)] // A mutex that waits has none.
pub struct FlashRegion<'a, M: RawMutex, F> {
    flash: &'a Mutex<M, F>,
    /// Offset from the start of the flash.
    offset: u32,
    length: u32,
}

impl<'a, M: RawMutex, F: NorFlash> FlashRegion<'a, M, F> {
    /// The region of `sectors` sectors from the sector `first` on. Accesses beyond the end of the flash fail.
    pub const fn new(flash: &'a Mutex<M, F>, first: usize, sectors: usize) -> Self {
        Self {
            flash,
            offset: (first * F::ERASE_SIZE) as u32,
            length: (sectors * F::ERASE_SIZE) as u32,
        }
    }

    /// Converts offsets in the region to offsets in the flash.
    fn within(&self, from: u32, to: u32) -> Result<(u32, u32), RegionError<F::Error>> {
        if from > to || to > self.length {
            return Err(RegionError::Bounds);
        }
        Ok((self.offset + from, self.offset + to))
    }

    /// The offset into the flash of an access of so many bytes.
    fn access(&self, offset: u32, length: usize) -> Result<u32, RegionError<F::Error>> {
        let end = u32::try_from(length).ok().and_then(|length| offset.checked_add(length));
        Ok(self.within(offset, end.ok_or(RegionError::Bounds)?)?.0)
    }
}

impl<M: RawMutex, F: NorFlash> ErrorType for FlashRegion<'_, M, F> {
    type Error = RegionError<F::Error>;
}

impl<M: RawMutex, F: NorFlash> ReadNorFlash for FlashRegion<'_, M, F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        let offset = self.access(offset, bytes.len())?;
        self.flash
            .lock()
            .await
            .read(offset, bytes)
            .await
            .map_err(RegionError::Flash)
    }

    fn capacity(&self) -> usize {
        self.length as usize
    }
}

impl<M: RawMutex, F: NorFlash> NorFlash for FlashRegion<'_, M, F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        let offset = self.access(offset, bytes.len())?;
        self.flash
            .lock()
            .await
            .write(offset, bytes)
            .await
            .map_err(RegionError::Flash)
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        let (from, to) = self.within(from, to)?;
        self.flash
            .lock()
            .await
            .erase(from, to)
            .await
            .map_err(RegionError::Flash)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::PARAMETERS;
    use crate::fault_history::FaultStore;
    use crate::fault_list::FaultEntry;
    use crate::parameters::{BootOutcome, ParameterStore};
    use crate::test_flash::{PAGE, TestFlash};
    use embassy_futures::block_on;
    use embassy_sync::blocking_mutex::raw::NoopRawMutex;
    use model::supervise::arming::Mode;
    use model::vehicle::Vehicle;

    type Shared = Mutex<NoopRawMutex, TestFlash>;

    /// The region of the fault history and that of the parameters, as on the board: one behind the other.
    fn regions(flash: &Shared) -> [FlashRegion<'_, NoopRawMutex, TestFlash>; 2] {
        [0, 2].map(|first| FlashRegion::new(flash, first, 2))
    }

    fn entry(number: u32) -> FaultEntry {
        FaultEntry {
            number,
            boot: 1,
            time_us: 1,
            mode: Mode::Armed,
            fault: 0,
        }
    }

    #[test]
    fn an_access_beyond_the_region_is_refused() {
        let flash = Shared::new(TestFlash::with_pages(4));
        let [mut first, mut second] = regions(&flash);
        let end = 2 * PAGE as u32;
        let mut word = [0; 32];
        for offset in [end - 31, end, u32::MAX] {
            let read = block_on(first.read(offset, &mut word));
            assert_eq!(read, Err(RegionError::Bounds));
            assert_eq!(block_on(second.write(offset, &word)), Err(RegionError::Bounds));
        }
        assert_eq!(block_on(first.erase(0, end + PAGE as u32)), Err(RegionError::Bounds));
        assert_eq!(block_on(first.erase(PAGE as u32, 0)), Err(RegionError::Bounds));
        assert_eq!(block_on(first.read(end - 32, &mut word)), Ok(()));
        // The first word of the second region is the word behind the first region.
        assert_eq!(block_on(second.write(0, &[7; 32])), Ok(()));
        assert!(flash.try_lock().expect("free").bytes[2 * PAGE..][..32] == [7; 32]);
    }

    /// Faults are stored with power cuts at any step, in a flash that holds parameters: not a byte of them changes.
    #[test]
    fn storing_faults_never_touches_the_parameters() {
        let vehicle = Vehicle::new(PARAMETERS).expect("valid");
        let mut flash = TestFlash::with_pages(4);
        {
            let shared = Shared::new(flash);
            let [_, parameters] = regions(&shared);
            let Ok(mut store) = ParameterStore::new(parameters) else {
                panic!("two sectors are enough");
            };
            block_on(store.store(&vehicle)).expect("stored");
            flash = shared.into_inner();
        }
        let before = flash.bytes[2 * PAGE..].to_vec();
        let mut number = 0;
        for power in (0..40).cycle().take(600) {
            flash.power = power;
            let shared = Shared::new(flash);
            let [history, _] = regions(&shared);
            let Ok(mut store) = FaultStore::new(history) else {
                panic!("two sectors are enough");
            };
            // Until the power is cut.
            while block_on(store.store(&entry(number))).is_ok() {
                number += 1;
            }
            flash = shared.into_inner();
            flash.revive();
            assert!(flash.bytes[2 * PAGE..] == before[..], "after {number} faults");
        }
        assert!(number > 1000, "the history was erased several times: {number}");
        let shared = Shared::new(flash);
        let [_, parameters] = regions(&shared);
        let Ok(mut store) = ParameterStore::new(parameters) else {
            panic!("two sectors are enough");
        };
        assert_eq!(block_on(store.load(&vehicle)).outcome, BootOutcome::Stored);
    }
}
