//! The record of the last tick, which a debugger finds under the symbol `FLIGHT_RECORD`.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use firmware::flight_record::{FlightRecord, Recorder};

/// Storage that only the recorder writes; all zeros (tick 0) before the first tick.
#[repr(transparent)]
pub struct Storage(UnsafeCell<MaybeUninit<FlightRecord>>);

// SAFETY: the program writes through the only `FlightRecorder` and never reads; a debugger reads while the
// core stands still.
unsafe impl Sync for Storage {}

/// The record of the last tick.
#[unsafe(no_mangle)]
static FLIGHT_RECORD: Storage = Storage(UnsafeCell::new(MaybeUninit::zeroed()));

/// The only writer of the record.
pub struct FlightRecorder(());

impl FlightRecorder {
    /// To be called once, when the board is taken.
    pub fn new() -> Self {
        Self(())
    }
}

impl Recorder for FlightRecorder {
    fn record(&mut self, record: &FlightRecord) {
        // SAFETY: the storage is valid and aligned for the record, and nothing else in the program accesses
        // the storage. The write is volatile because the program never reads the record back.
        unsafe { FLIGHT_RECORD.0.get().cast::<FlightRecord>().write_volatile(*record) };
    }
}
