//! The last tick, where a debugger finds it: `FLIGHT_RECORD`.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use firmware::drive::{FlightRecord, Recorder};

/// Storage that only the recorder writes. All zero (tick 0) until the first tick.
#[repr(transparent)]
pub struct Storage(UnsafeCell<MaybeUninit<FlightRecord>>);

// SAFETY: the program writes through the one `FlightRecorder` and never reads; a debugger reads while
// the core stands still.
unsafe impl Sync for Storage {}

/// The last tick's record.
#[unsafe(no_mangle)]
static FLIGHT_RECORD: Storage = Storage(UnsafeCell::new(MaybeUninit::zeroed()));

/// The one writer of the record.
pub struct FlightRecorder(());

impl FlightRecorder {
    /// To be called once, when the board is taken.
    pub(super) fn new() -> Self {
        Self(())
    }
}

impl Recorder for FlightRecorder {
    fn record(&mut self, record: &FlightRecord) {
        // SAFETY: the storage is valid and aligned for the record, and nothing else in the program accesses
        // it. Volatile, because no code of the program ever reads it back.
        unsafe { FLIGHT_RECORD.0.get().cast::<FlightRecord>().write_volatile(*record) };
    }
}
