//! The flashed ELF under test, on the emulated board.

mod boot;
mod budget;
mod determinism;
mod equivalence;
mod link;
mod safety;
mod support;
