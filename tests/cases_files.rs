//! The scenario files of `tests/cases`, each unchanged and at other values, with two seeds. `hil_elf/cases.rs` flies them
//! unchanged on the flashed ELF.

use std::path::Path;

#[path = "support/case_files.rs"]
mod case_files;
#[path = "support/outcomes.rs"]
mod outcomes;
mod support;
use case_files::{CASE_FILES, CaseFile};
use support::flights::drive;

/// Files that are no drive of the reference vehicle: `tests/cases.rs` gives them to the tool.
const OF_THE_TOOL: [&str; 5] = [
    "link-noise-4g",
    "nan-passes",
    "title-escape",
    "vehicle-that-is-nan",
    "vehicle-that-panics",
];

#[test]
fn every_file_is_flown_or_one_of_the_tools() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/cases");
    let mut files: Vec<String> = std::fs::read_dir(folder)
        .expect("the folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned())
        .collect();
    files.sort();
    let mut flown: Vec<&str> = CASE_FILES.iter().map(|file| file.name).chain(OF_THE_TOOL).collect();
    flown.sort_unstable();
    assert_eq!(files, flown);
}

fn fly(name: &str) {
    let file: &CaseFile = CASE_FILES.iter().find(|file| file.name == name).expect("a file");
    assert!(file.values.len() >= 3, "{name}: at least three values");
    // The shorter drive of the flashed ELF, on the virtual board.
    let short = file.scenario(&file.values[0], 7, file.shorter);
    file.check(&file.values[0], 7, &drive(&short));
    for value in file.values {
        for seed in [7, 17] {
            file.check(value, seed, &drive(&file.scenario(value, seed, &[])));
        }
    }
}

#[test]
fn a_ballast_encoder_that_dies_downhill_takes_the_levelling_only() {
    fly("ballast-encoder-dies-downhill");
}

#[test]
fn a_battery_beyond_its_limit_opens_the_bridges() {
    fly("battery-over-range");
}

#[test]
fn a_kerb_lets_the_vehicle_go_gently() {
    fly("kerb-surge");
}

#[test]
fn a_fall_over_a_ledge_is_no_fault() {
    fly("ledge-down");
}

#[test]
fn half_a_minute_of_turning_leaves_the_heading_known() {
    fly("spin-then-straight");
}

#[test]
fn wheels_of_unequal_radius_keep_the_line() {
    fly("straight-120-m");
}

#[test]
fn a_vehicle_at_a_wall_backs_off_when_told() {
    fly("wall-back-off");
}
