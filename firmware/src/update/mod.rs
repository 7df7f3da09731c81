//! Updating without a probe: a new image comes over the link, the firmware stores and checks it, and the boot loader, a program
//! of its own (`firmware/src/bin/boot-loader/`), installs it or rolls it back.
//!
//! Three places of the flash hold a whole image each: the image that runs, the image that has arrived, and the image
//! that ran before, which is kept. The firmware writes the arrived image alone, in the bank that it does not run from.
//! The boot loader copies: it keeps the image that runs, installs the arrived image, and restores the kept image when
//! the new image does not confirm itself. At every instant one whole image lies in a place that nothing is writing to,
//! so after a loss of power at any word the boot loader copies again.
//!
//! What was decided stands behind the arrived image, as marks that are only ever added ([`journal`]); what follows from the
//! marks and the three places is a pure decision ([`plan`]).

pub mod journal;
pub mod loader;
pub mod plan;
mod store;
mod task;

pub use store::UpdateStore;
pub use task::run;

#[cfg(test)]
mod tests;
