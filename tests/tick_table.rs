//! `replay --csv` from outside: the ticks of a record as a table, even of a record that cannot be replayed.

use std::path::{Path, PathBuf};

#[path = "support/tool.rs"]
mod tool;
use tool::{hil_sim, stderr};

/// The path of a file that does not exist yet.
fn new_path(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    _ = std::fs::remove_file(&path);
    path
}

/// The second half of a drive, like a look back: the record lacks the vehicle's state at its beginning, but has every tick since.
#[test]
fn the_middle_of_a_drive_is_a_table_of_what_was_recorded() {
    let (whole, late, csv) = (
        new_path("table.records"),
        new_path("table-late.records"),
        new_path("table.csv"),
    );
    let driven = hil_sim(&[
        "drive",
        "kerb",
        "--json",
        "--no-bounds",
        "--record",
        whole.to_str().expect("utf-8"),
    ]);
    assert!(driven.status.success(), "{}", stderr(&driven));
    let bytes = std::fs::read(&whole).expect("reads");
    std::fs::write(&late, &bytes[bytes.len() / 2..]).expect("writes");
    let shown = hil_sim(&[
        "replay",
        late.to_str().expect("utf-8"),
        "--csv",
        csv.to_str().expect("utf-8"),
    ]);
    assert_eq!(shown.status.code(), Some(0), "{}", stderr(&shown));
    let read = hil_sim::cli::record_files::read(&late).expect("readable");
    let text = std::fs::read_to_string(&csv).expect("a table");
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), read.records().count() + 1);
    let at = |name: &str| rows[0].iter().position(|column| *column == name).expect(name);
    for (record, row) in read.records().zip(&rows[1..]) {
        assert_eq!(row.len(), rows[0].len());
        let number = |name: &str| row[at(name)].parse::<f64>().expect(name);
        assert_eq!(number("tick"), f64::from(record.tick));
        assert_eq!(number("time_s"), record.sample.time_us as f64 * 1e-6);
        assert_eq!(number("right_encoder_counts"), record.sample.encoder_counts[1] as f64);
        assert_eq!(number("commanded_speed_m_s"), f64::from(record.command.drive.speed_m_s));
        assert_eq!(number("enable"), f64::from(record.actuation.enable));
        assert_eq!(number("left_duty"), f64::from(record.actuation.duty[0]) / 32767.0);
        // A battery of 24 V, by the data sheet's scale.
        assert!((20.0..26.0).contains(&number("battery_voltage_v")), "{row:?}");
    }
    let mean_force = |axis: &str| {
        let name = format!("arm_force_{axis}_m_s2");
        let sum: f64 = rows[1..]
            .iter()
            .map(|row| row[at(&name)].parse::<f64>().expect("a number"))
            .sum();
        sum / (rows.len() - 1) as f64
    };
    let force = ["x", "y", "z"].map(mean_force);
    let size = force.iter().map(|f| f * f).sum::<f64>().sqrt();
    assert!((9.3..10.3).contains(&size), "{force:?}");
}
