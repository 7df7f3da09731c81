//! `hil-sim`: see `hil-sim --help`.
use std::process::ExitCode;

fn main() -> ExitCode {
    hil_sim::cli::main()
}
