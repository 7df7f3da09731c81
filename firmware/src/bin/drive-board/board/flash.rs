//! The firmware's write access to the part's flash, through the HAL's driver.

use embassy_stm32::flash::{Async, Error as DriverError, Flash};
use firmware::drive_board::FLASH_SECTOR_BYTES;

pub use super::flash_banks::{clean_up, read_guarded};

/// The part's flash, through the HAL's driver.
pub struct DriverFlash(Flash<'static, Async>);

impl DriverFlash {
    /// The flash behind its driver.
    pub fn new(driver: Flash<'static, Async>) -> Self {
        Self(driver)
    }

    /// Programs one word of the stores.
    pub async fn write_word(&mut self, offset: u32, word: &[u8]) -> Result<(), DriverError> {
        self.0.write(offset, word).await
    }

    /// Erases the sector that begins at `offset`.
    pub async fn erase_sector(&mut self, offset: u32) -> Result<(), DriverError> {
        self.0.erase(offset, offset + FLASH_SECTOR_BYTES as u32).await
    }
}
