//! Address of the parts' flash, and its unlock keys.

use firmware::drive_board::{FLASH_SECTOR_BYTES, SECTORS_PER_BANK};
use firmware::image_seal::{FLASH_START, IMAGE_MAX};

/// Address of the flash for the core.
pub const FLASH_BASE: usize = FLASH_START as usize;

/// Keys that unlock a control register of the flash, in this order.
pub const UNLOCK_KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

// The image lies in the first bank.
const _: () = assert!(IMAGE_MAX as usize == SECTORS_PER_BANK * FLASH_SECTOR_BYTES);
