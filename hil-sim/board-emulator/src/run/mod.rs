//! A run of the firmware in virtual time.
//!
//! The emulated core runs on its own thread, which [`Emulation`] starts. The caller's orders reach the thread
//! through a channel, and the conductor carries them out between two instructions.

mod backend;
mod clock;
mod conductor;
mod emulation;
mod orders;
mod settings;
mod state;
mod stopped;
mod trial;

pub use backend::EmulatedBackend;
pub use emulation::{Emulation, Frozen};
pub use settings::EmulationSettings;
pub use state::CycleRead;
pub use stopped::{Stopped, Work};
pub use trial::takes_stored;
