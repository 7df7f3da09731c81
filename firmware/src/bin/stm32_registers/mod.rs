//! Registers that are equal on all parts, used by the boards' own modules.

pub mod conversions;
pub mod external_clock;
pub mod flash_map;
