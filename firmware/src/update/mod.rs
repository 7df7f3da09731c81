//! Updating without a probe: a new image comes over the link, the firmware stores and checks it, and the boot loader, a program
//! of its own (`firmware/src/bin/boot-loader/`), installs it or rolls it back.
//!
//! Three places of the flash contain one image each: the image that runs, the image that has arrived, and the image
//! that ran before, which is kept. The firmware writes only the arrived image, in the bank from which it does not run.
//! The boot loader copies the other two: it keeps the running image, installs the arrived image, and restores the kept
//! image if the new image does not confirm itself. At every instant one intact image is in a place that is not being
//! written, so after a loss of power at any word the boot loader can copy again.
//!
//! The decisions are stored behind the arrived image as marks that are only ever added ([`journal`]). The next step is
//! a pure decision from the marks and the three places ([`plan`]).

pub mod journal;
pub mod loader;
pub mod plan;
mod store;
mod task;

pub use store::UpdateStore;
pub use task::{CONFIRM_AFTER, run};

#[cfg(test)]
mod tests;
