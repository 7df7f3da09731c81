//! What the boot loader shares with the firmware of the STM32 boards.

#[path = "../../stm32_registers/flash_map.rs"]
pub mod flash_map;
