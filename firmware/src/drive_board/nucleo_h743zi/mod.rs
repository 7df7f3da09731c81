//! Facts of the drive board on the NUCLEO-H743ZI2.

pub mod analog;
pub mod memory;

pub use super::nucleo_144 as inputs;

/// Largest duty of a bridge either way, in percent of the supply: the rest of each period brakes, so that the switching half
/// of the bridge visits the low side and charges the capacitor of a bootstrapped high side.
pub const DUTY_MAX_PERCENT: u32 = 94;

/// Time after which the watchdog resets a part that has not fed it, us: long enough for a control task that is late
/// by many ticks and, together with the reset, less than the 40 ms within which a hung part must be in its safe
/// state.
pub const WATCHDOG_US: u32 = 20_000;

/// Clock of the core, Hz, as the board's clock tree sets it.
pub const CORE_CLOCK_HZ: u32 = 400_000_000;
/// Kernel clock of the encoders' timers, Hz.
pub const ENCODER_CLOCK_HZ: u32 = 200_000_000;
/// Periods of that clock between two samples of an encoder's input.
pub const ENCODER_DIVIDER: u32 = 32;

/// Sectors of each of the flash's two banks.
pub const SECTORS_PER_BANK: usize = 8;
/// Bytes of one word of the parameters' flash: the unit of programming and of error correction.
pub const FLASH_WORD_BYTES: usize = 32;
