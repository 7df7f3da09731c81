//! The command line of the biplanar bicycle's host tool, over the packages that do the work: `plant` (the
//! physical vehicle), `virtual-board` (the firmware's tasks in virtual time, scenarios), `theory` (analysis
//! and figures) and `report` (charts, pages, tables).
#![forbid(unsafe_code)]

pub mod cli;
