//! The flashed ELF under test, on the emulated board.

mod ages;
mod boot;
mod bridges;
mod bring_up;
mod budget;
mod cases;
mod currents;
mod determinism;
mod drive;
mod equivalence;
mod link;
mod loader;
mod log;
mod memory;
mod parameters;
mod part;
mod safety;
mod serve;
mod start_up;
mod support;
mod update;
mod wire;
mod without_spar;
