//! Facts of the drive board on the NUCLEO-F767ZI.

pub mod analog;
pub mod memory;

pub use super::nucleo_144 as inputs;

/// Largest duty of a bridge either way, in percent of the supply: the rest of each period brakes, so that the switching half
/// of the bridge visits the low side and charges the capacitor of a bootstrapped high side.
pub const DUTY_MAX_PERCENT: u32 = 94;

/// Time after which the watchdog resets a part that has not fed it, us, at its oscillator's 32 kHz. Within the
/// oscillator's 17 to 47 kHz (data sheet) that is 8.2 to 22.6 ms: more than the 5 ms between two feeds, and, together
/// with the 15 ms after which a hung control task stops the feeding, less than the 40 ms within which a hung part must
/// be in its safe state.
pub const WATCHDOG_US: u32 = 12_000;

/// Clock of the core, Hz, as the board's clock tree sets it.
pub const CORE_CLOCK_HZ: u32 = 216_000_000;
/// Kernel clock of the encoders' timers, Hz.
pub const ENCODER_CLOCK_HZ: u32 = 108_000_000;
/// Periods of that clock between two samples of an encoder's input.
pub const ENCODER_DIVIDER: u32 = 16;

/// Size of each of the flash's two banks, in sectors of [`FLASH_SECTOR_BYTES`](memory::FLASH_SECTOR_BYTES).
pub const SECTORS_PER_BANK: usize = 8;
/// Bytes of one word of the stores: eight of the part's programming units, so that a stored set has the same form on
/// each board.
pub const FLASH_WORD_BYTES: usize = 32;
