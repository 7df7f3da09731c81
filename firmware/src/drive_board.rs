//! Facts of the drive board, apart from its pins: one number for each, read by the board's own code, by the boards
//! that stand in for it on the host, and by the host's tools. Nothing here needs the hardware.

use model::board::BoardScales;
pub use model::board::DUTY_MAX_PERCENT;

use crate::imu::driver;

pub mod analog;
pub mod encoders;

/// Shortest pulse of either side of a bridge, in percent of the PWM period: both diagonals always switch, and the
/// drivers' bootstrap capacitors stay charged. The largest duty leaves room for two of them: the bridges give no more,
/// and the controller asks for no more.
pub const PULSE_MIN_PERCENT: u32 = (100 - DUTY_MAX_PERCENT) / 2;

/// What the board's raw counts stand for.
pub const SCALES: BoardScales = BoardScales {
    analog: analog::INPUTS.scales(),
    duty_max: DUTY_MAX_PERCENT as f32 / 100.0,
    imu: driver::SCALES,
};

/// Time after which the watchdog resets a part that has not fed it, us: long enough for a control task that is late
/// by many ticks, and with the reset itself short of the 40 ms within which a hung part must be back in its safe
/// state.
pub const WATCHDOG_US: u32 = 20_000;

/// Rate of the host link, baud.
pub const LINK_BAUD: u32 = 921_600;

/// One sector of the parameters' flash, bytes: what an erase clears.
pub const FLASH_SECTOR_BYTES: usize = 128 * 1024;
/// Sectors of each of the flash's two banks.
pub const SECTORS_PER_BANK: usize = 8;
/// One word of the parameters' flash, bytes: what is programmed, and what errors are corrected over.
pub const FLASH_WORD_BYTES: usize = 32;
/// Sectors of the parameters' flash: the store needs one to move to while it keeps the other.
pub const PARAMETER_SECTORS: usize = 2;
/// Sectors of the fault history's flash, in front of those of the parameters.
pub const HISTORY_SECTORS: usize = 2;
