//! The command line of the biplanar bicycle's host tool, over the packages that do the work: `plant` (the
//! physical vehicle), `virtual-board` (the firmware's tasks in virtual time, scenarios), `record-file` (records as files),
//! `theory` (analysis and figures), `report` (charts, pages, tables) and `hil-elf` (the board's toolchain).
#![forbid(unsafe_code)]

pub mod cli;
