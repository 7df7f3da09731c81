//! Turns the vehicle file into constants, hashes what the firmware is built from, and for the target gives the linker
//! the board's memory layout and the scripts of the start-up code and of defmt.
//!
//! The vehicle file is `vehicles/reference.toml`, or the file that the environment variable `VEHICLE` names,
//! relative to the workspace root. A wrong file ends the build with the reader's message.

use std::path::{Path, PathBuf};
use std::{env, fs};

use model::board::SensorRanges;

#[path = "src/drive_board/nucleo_f767zi/memory.rs"]
#[allow(dead_code)]
mod f767zi_memory;
#[path = "src/drive_board/nucleo_h743zi/memory.rs"]
#[allow(dead_code)]
mod h743zi_memory;
#[path = "src/image_seal.rs"]
#[allow(dead_code)]
mod image_seal;
#[path = "src/drive_board/nucleo_144.rs"]
#[allow(dead_code)]
mod nucleo_144;

use image_seal::{DTCM_BYTES, DTCM_START, FLASH_START, SEAL_AT, SEAL_BYTES, STACK_BYTES, image_room};

/// What the build needs to know of a board.
struct BuiltBoard {
    /// What its inputs measure.
    ranges: SensorRanges,
    /// The name of its program.
    program: &'static str,
    /// First byte and bytes of its RAM.
    ram: [u32; 2],
    /// Sectors of its boot loader, and of its image.
    sectors: [u32; 2],
    /// Bytes of a sector.
    sector_bytes: u32,
}

/// The boot loader's program.
const LOADER: &str = "boot-loader";

/// The board that a feature chose. With no board, or two, the library's own message ends the build.
fn board() -> BuiltBoard {
    if env::var_os("CARGO_FEATURE_NUCLEO_F767ZI").is_some() {
        BuiltBoard {
            ranges: nucleo_144::RANGES,
            program: "drive-board-f767",
            ram: [f767zi_memory::RAM_START, f767zi_memory::RAM_BYTES],
            sectors: [
                f767zi_memory::LOADER_SECTORS as u32,
                f767zi_memory::IMAGE_SECTORS as u32,
            ],
            sector_bytes: f767zi_memory::FLASH_SECTOR_BYTES as u32,
        }
    } else {
        BuiltBoard {
            ranges: nucleo_144::RANGES,
            program: "drive-board",
            ram: [h743zi_memory::RAM_START, h743zi_memory::RAM_BYTES],
            sectors: [
                h743zi_memory::LOADER_SECTORS as u32,
                h743zi_memory::IMAGE_SECTORS as u32,
            ],
            sector_bytes: h743zi_memory::FLASH_SECTOR_BYTES as u32,
        }
    }
}

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/drive_board");
    let board = board();
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    vehicle(&out, &board);
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        linker(&out, &board);
    }
}

fn vehicle(out: &Path, board: &BuiltBoard) {
    println!("cargo::rerun-if-env-changed=VEHICLE");
    let name = env::var("VEHICLE").unwrap_or_else(|_| "vehicles/reference.toml".to_owned());
    let path = Path::new("..").join(name);
    println!("cargo::rerun-if-changed={}", path.display());
    match vehicle_file::read_vehicle_for(&path, &board.ranges) {
        Ok(vehicle) => {
            let text = vehicle_file::to_rust(&vehicle);
            fs::write(out.join("vehicle.rs"), &text).expect("OUT_DIR is writable");
            let hash = build_hash(&text, board.program);
            fs::write(out.join("build_hash.rs"), format!("{hash}")).expect("OUT_DIR is writable");
        }
        Err(error) => {
            println!("cargo::error={error}");
            std::process::exit(1);
        }
    }
}

/// FNV-1a hash of the board's program, the built-in vehicle and every source file of firmware and model, in order of
/// their paths: equal sources give equal hashes for one board, whatever machine builds them.
fn build_hash(vehicle: &str, program: &str) -> u32 {
    let mut paths = Vec::new();
    for directory in ["src", "../model/src"] {
        println!("cargo::rerun-if-changed={directory}");
        sources(Path::new(directory), &mut paths);
    }
    paths.sort();
    let mut hash = fnv_1a(fnv_1a(FNV_OFFSET, program.as_bytes()), vehicle.as_bytes());
    for path in paths {
        // A checkout may end lines in its own way.
        let text = fs::read_to_string(&path)
            .expect("a source file is readable")
            .replace('\r', "");
        hash = fnv_1a(hash, text.as_bytes());
    }
    hash
}

/// Adds every source file below `directory`.
fn sources(directory: &Path, paths: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).expect("a source folder is readable") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            sources(&path, paths);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            paths.push(path);
        }
    }
}

/// Start of the 32-bit FNV-1a hash.
const FNV_OFFSET: u32 = 0x811c_9dc5;
/// Factor of the 32-bit FNV-1a hash.
const FNV_PRIME: u32 = 0x0100_0193;

fn fnv_1a(hash: u32, bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .fold(hash, |hash, byte| (hash ^ u32::from(*byte)).wrapping_mul(FNV_PRIME))
}

fn linker(out: &Path, board: &BuiltBoard) {
    println!("cargo::rerun-if-changed=../memory.x");
    let program = board.program;
    let [loader_sectors, image_sectors] = board.sectors;
    let sector_bytes = board.sector_bytes;
    let start = FLASH_START + loader_sectors * sector_bytes;
    let [ram_start, ram_bytes] = board.ram;
    let room = image_room((image_sectors * sector_bytes) as usize);
    memory(program, [start, room, ram_start, ram_bytes]);
    let place = start as usize + SEAL_AT;
    // The code follows the seal.
    let code = format!("--defsym=_stext={:#x}", place + SEAL_BYTES);
    for argument in [code.as_str(), "-Tlink.x", "-Tseal.x", "-Tdefmt.x"] {
        println!("cargo::rustc-link-arg-bin={program}={argument}");
    }
    // The gap in front of the seal is a section with contents: who loads an ELF by its sections leaves a gap erased, who
    // loads it by its segments fills it with what the linker put there, and the checksum covers it.
    let text = format!(
        "SECTIONS\n{{\n  .before_seal : {{ BYTE(0xFF); . = {place:#x}; }} > FLASH =0xFFFFFFFF\n  \
         .seal {place:#x} : {{ KEEP(*(.seal)) }} > FLASH\n}} INSERT AFTER .vector_table;\n"
    );
    fs::write(out.join("seal.x"), text).expect("OUT_DIR is writable");
    println!("cargo::rustc-link-search={}", out.display());
    if loader_sectors > 0 {
        let [ram_start, ram_bytes] = [h743zi_memory::LOADER_RAM_START, h743zi_memory::LOADER_RAM_BYTES];
        memory(
            LOADER,
            [FLASH_START, loader_sectors * sector_bytes, ram_start, ram_bytes],
        );
        // It has no seal, and none of the log's texts, which the libraries bring with them.
        let text = "SECTIONS\n{\n  /DISCARD/ : { *(.defmt.*) }\n} INSERT AFTER .rodata;\n";
        fs::write(out.join("no-log.x"), text).expect("OUT_DIR is writable");
        for argument in ["-Tlink.x", "-Tno-log.x"] {
            println!("cargo::rustc-link-arg-bin={LOADER}={argument}");
        }
    }
    // --nmagic: the sections are not page aligned, which the linker would otherwise pad in flash.
    println!("cargo::rustc-link-arg-bins=--nmagic");
}

/// Gives the linker a program's memory. It finds memory.x in the workspace's root, where it looks first: what differs between
/// the programs are numbers.
fn memory(program: &str, [flash_start, flash_bytes, ram_start, ram_bytes]: [u32; 4]) {
    for (symbol, number) in [
        ("_program_flash_start", flash_start),
        ("_program_flash_bytes", flash_bytes),
        ("_program_ram_start", ram_start),
        ("_program_ram_bytes", ram_bytes),
        ("_program_dtcm_start", DTCM_START),
        ("_program_dtcm_bytes", DTCM_BYTES),
        ("_program_stack_bytes", STACK_BYTES),
    ] {
        println!("cargo::rustc-link-arg-bin={program}=--defsym={symbol}={number:#x}");
    }
}
