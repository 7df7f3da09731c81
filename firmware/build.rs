//! Turns the vehicle file into constants, and for the target gives the linker the memory layout and the
//! scripts of the start-up code and of defmt.
//!
//! The vehicle file is `vehicles/reference.toml`, or the file that the environment variable `VEHICLE` names,
//! relative to the workspace root. A wrong file ends the build with the reader's message.

use std::path::{Path, PathBuf};
use std::{env, fs};

#[path = "src/drive_board/analog.rs"]
mod analog;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/drive_board/analog.rs");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    vehicle(&out);
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        linker(&out);
    }
}

fn vehicle(out: &Path) {
    println!("cargo::rerun-if-env-changed=VEHICLE");
    let name = env::var("VEHICLE").unwrap_or_else(|_| "vehicles/reference.toml".to_owned());
    let path = Path::new("..").join(name);
    println!("cargo::rerun-if-changed={}", path.display());
    match vehicle_file::read_vehicle_for(&path, &analog::RANGES) {
        Ok(vehicle) => fs::write(out.join("vehicle.rs"), vehicle_file::to_rust(&vehicle)).expect("OUT_DIR is writable"),
        Err(error) => {
            println!("cargo::error={error}");
            std::process::exit(1);
        }
    }
}

fn linker(out: &Path) {
    println!("cargo::rerun-if-changed=../memory.x");
    fs::copy("../memory.x", out.join("memory.x")).expect("memory.x stands at the workspace root");
    println!("cargo::rustc-link-search={}", out.display());
    // --nmagic: the sections are not page aligned, which the linker would otherwise pad in flash.
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
}
