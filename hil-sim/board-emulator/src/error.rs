//! Why a run could not be made.

use std::path::PathBuf;

/// Why a run could not be made, or ended.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The firmware is not an ELF this crate reads.
    #[error(transparent)]
    Elf(#[from] object::Error),
    /// The firmware has no such symbol.
    #[error("{}: no symbol `{name}`", path.display())]
    NoSymbol {
        /// The ELF.
        path: PathBuf,
        /// The symbol.
        name: String,
    },
    /// The firmware's log cannot be decoded.
    #[error("the firmware's log: {0}")]
    Log(String),
    /// The firmware's flight record is not what the host expects.
    #[error("the flight record: {0}")]
    Record(String),
    /// The emulator refuses the image.
    #[error(transparent)]
    Image(#[from] rigless::image::Error),
    /// The emulated part refuses an access.
    #[error(transparent)]
    Part(#[from] rigless::soc::Error),
    /// The emulated core or its memory refuses.
    #[error(transparent)]
    Emulator(#[from] rigless::emulator::Error),
    /// The run ended before it should have.
    #[error("the emulated core: {0}")]
    Core(String),
    /// A snapshot could not be taken or read back.
    #[error(transparent)]
    Snapshot(#[from] rigless::snapshot::Error),
    /// The firmware would not fly this vehicle.
    #[error("the vehicle: {0}")]
    Vehicle(String),
    /// The firmware could not be built.
    #[error("building the firmware: {0}")]
    Build(String),
}
