//! Registers that the parts have alike, for the boards' own modules to build on.

pub mod conversions;
pub mod external_clock;
pub mod flash_map;
