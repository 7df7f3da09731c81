//! Facts of the drive board except its pins: one number for each fact. The board's own code, the virtual and the emulated
//! board, and the host's tools read these numbers. This module needs no hardware.
//!
//! Each board has its facts in its own folder; a feature chooses the board for which the firmware is built. The host's
//! tools and tests use the first board.

use model::analog::ANALOG_INPUTS;
use model::board::BoardScales;
use model::vehicle::BRIDGE_SHARE;

use crate::image::ImageHome;
use crate::image_seal::{DTCM_BYTES, DTCM_START, FLASH_START};
use crate::imu::driver;

pub mod encoders;
pub mod nucleo_144;
pub mod nucleo_f767zi;
pub mod nucleo_h743zi;

#[cfg(feature = "nucleo-f767zi")]
pub use nucleo_f767zi::{
    DUTY_MAX_PERCENT, ENCODER_DIVIDER, FLASH_WORD_BYTES, SECTORS_PER_BANK, WATCHDOG_US, analog, inputs, memory,
};
#[cfg(feature = "nucleo-h743zi")]
pub use nucleo_h743zi::{
    DUTY_MAX_PERCENT, ENCODER_DIVIDER, FLASH_WORD_BYTES, SECTORS_PER_BANK, WATCHDOG_US, analog, inputs, memory,
};

#[cfg(all(feature = "nucleo-h743zi", feature = "nucleo-f767zi"))]
compile_error!("a firmware is built for one board: leave the default features out");
#[cfg(not(any(feature = "nucleo-h743zi", feature = "nucleo-f767zi")))]
compile_error!("choose a board: the feature nucleo-h743zi or nucleo-f767zi");

pub use memory::FLASH_SECTOR_BYTES;

/// The board's number in the seal of an image.
pub const BOARD: u16 = memory::BOARD;
/// Sectors of the place of an image that arrives over the link.
pub const ARRIVED_SECTORS: usize = 2;
/// Address of the firmware's image in the part's memory.
pub const IMAGE_START: u32 = FLASH_START + (memory::LOADER_SECTORS * FLASH_SECTOR_BYTES) as u32;
/// Requirements on an image that this board can run. Its stack lies in the DTCM of either part, where `memory.x` puts it,
/// or among the variables.
pub const IMAGE_HOME: ImageHome = ImageHome {
    board: BOARD,
    start: IMAGE_START,
    stacks: [[DTCM_START, DTCM_BYTES], [memory::RAM_START, memory::RAM_BYTES]],
};

// The arrived and the kept image fit the place where an image runs, and the three places and the loader do not overlap.
const _: () = {
    use nucleo_h743zi::SECTORS_PER_BANK;
    use nucleo_h743zi::memory::{ARRIVED_SECTOR, IMAGE_SECTORS, KEPT_SECTOR, LOADER_SECTORS};
    let Some(arrived) = ARRIVED_SECTOR else { panic!() };
    assert!(ARRIVED_SECTORS == IMAGE_SECTORS && LOADER_SECTORS + IMAGE_SECTORS <= SECTORS_PER_BANK);
    assert!(arrived >= SECTORS_PER_BANK && arrived + IMAGE_SECTORS <= KEPT_SECTOR);
    assert!(KEPT_SECTOR + IMAGE_SECTORS + HISTORY_SECTORS + PARAMETER_SECTORS <= 2 * SECTORS_PER_BANK);
};

// The rules and the analyses of a vehicle without a board count on the duty that every board gives. For a board that gives less,
// the rules' constant gets the smallest duty of all boards.
const _: () = {
    assert!(nucleo_h743zi::DUTY_MAX_PERCENT as f64 / 100.0 == BRIDGE_SHARE);
    assert!(nucleo_f767zi::DUTY_MAX_PERCENT as f64 / 100.0 == BRIDGE_SHARE);
};

/// PWM frequency of the bridges, Hz: inaudible, and slow enough for their drivers.
pub const PWM_HZ: u32 = 20_000;

/// The converter's channels of the analogue inputs, in order.
pub const ANALOG_CHANNELS: [u8; ANALOG_INPUTS] = {
    let pins = inputs::INPUTS.pins();
    let mut channels = [0; ANALOG_INPUTS];
    let mut n = 0;
    while n < ANALOG_INPUTS {
        channels[n] = analog::channel(pins[n]);
        n += 1;
    }
    channels
};

/// The scales of the board's raw counts.
pub const SCALES: BoardScales = BoardScales {
    analog: inputs::INPUTS.scales(),
    duty_max: DUTY_MAX_PERCENT as f32 / 100.0,
    imu: driver::IMU_SCALES,
};

/// Rate of the host link, baud.
pub const LINK_BAUD: u32 = 921_600;

/// Sectors of the parameters' flash: the store needs one sector to move to while it keeps the other.
pub const PARAMETER_SECTORS: usize = 2;
/// Sectors of the fault history's flash, in front of those of the parameters.
pub const HISTORY_SECTORS: usize = 2;
