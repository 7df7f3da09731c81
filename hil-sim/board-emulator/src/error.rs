//! Errors of this crate.

use std::path::PathBuf;

/// Why a run could not start, or why it ended.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file could not be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The firmware's file is not an ELF.
    #[error(transparent)]
    Elf(#[from] object::Error),
    /// The firmware lacks a symbol.
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
    /// The layout of the firmware's flight record differs from the host's.
    #[error("the flight record: {0}")]
    Record(String),
    /// The emulator rejects the image.
    #[error(transparent)]
    Image(#[from] rigless::image::Error),
    /// The emulated part rejects an access.
    #[error(transparent)]
    Part(#[from] rigless::soc::Error),
    /// The emulated core or its memory rejects an operation.
    #[error(transparent)]
    Emulator(#[from] rigless::emulator::Error),
    /// The run ended early.
    #[error("the emulated core: {0}")]
    Core(String),
    /// A snapshot could not be taken or read back.
    #[error(transparent)]
    Snapshot(#[from] rigless::snapshot::Error),
    /// The firmware does not use this vehicle's parameters.
    #[error("the vehicle: {0}")]
    Vehicle(String),
    /// The firmware could not be built.
    #[error("building the firmware: {0}")]
    Build(String),
}

impl Error {
    /// An access to a register that the emulated part's bus does not answer.
    pub(crate) fn access(fault: &rigless::soc::Fault) -> Self {
        Self::Core(format!("{fault:?}"))
    }
}
