//! Building the firmware.
