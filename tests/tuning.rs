//! The tables of the tuning page: how changing one field of the reference vehicle changes a drive.

use std::fmt::Write as _;
use std::path::Path;

#[path = "support/generated.rs"]
mod generated;
#[path = "support/tool.rs"]
mod tool;
use tool::{WORKSPACE, hil_sim};

/// A column: the metric, and the decimals that the table gives.
type MetricColumn = (&'static str, usize);

/// A row: table and field of the vehicle file, and the value as the file writes it; all empty for the reference vehicle.
type ChangedField = (&'static str, &'static str, &'static str);

/// The unchanged reference vehicle.
const NONE: ChangedField = ("", "", "");

/// The result of a drive of the reference vehicle with one field changed, as the page's shell function drives it.
fn drive(scenario: &str, (table, field, value): ChangedField) -> serde_json::Value {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("tuning");
    std::fs::create_dir_all(&folder).expect("a folder");
    let reference = std::fs::read_to_string(Path::new(WORKSPACE).join("vehicles/reference.toml")).expect("there");
    let mut given = 0;
    let mut text = String::new();
    for line in reference.lines() {
        if line.split_whitespace().next() != Some(field) {
            let _ = writeln!(text, "{line}");
        }
        if line == format!("[{table}]") {
            given += 1;
            let _ = writeln!(text, "{field} = {value}");
        }
    }
    assert_eq!(given, usize::from(!field.is_empty()), "{field}");
    let file = folder.join(format!("{field}-{value}.toml"));
    std::fs::write(&file, text).expect("writes");
    let output = hil_sim(&["drive", scenario, "--vehicle", file.to_str().expect("utf-8"), "--json"]);
    serde_json::from_slice(&output.stdout).expect("one object")
}

fn table(
    scenario: &str,
    head: &str,
    columns: &[MetricColumn],
    rows: &[ChangedField],
    first: fn(&ChangedField) -> String,
) -> String {
    let names: Vec<String> = columns.iter().map(|(name, _)| format!("`{name}`")).collect();
    let mut text = format!(
        "| {head} | {} |\n|---|{}\n",
        names.join(" | "),
        "---|".repeat(columns.len())
    );
    for row in rows {
        let json = drive(scenario, *row);
        let metrics = json["metrics"].as_array().expect("metrics");
        let _ = write!(text, "| {} |", first(row));
        for (name, decimals) in columns {
            let metric = metrics.iter().find(|metric| metric["name"] == *name).expect(name);
            let value = metric["value"].as_f64().expect("a number");
            let _ = write!(text, " {value:.decimals$} |");
        }
        text.push('\n');
    }
    text
}

fn change((_, field, value): &ChangedField) -> String {
    match *field {
        "" => "none".to_owned(),
        field => format!("`{field}` {value}"),
    }
}

#[test]
fn the_tuning_page_has_what_each_change_makes_of_the_drive() {
    let text = table(
        "slope-drive",
        "Change",
        &[
            ("speed_error_rms_m_s", 3),
            ("phi_peak_deg", 1),
            ("spar_peak_deg", 2),
            ("current_peak_a", 1),
        ],
        &[
            NONE,
            ("control", "comfort_s", "0.0"),
            ("control", "comfort_s", "0.5"),
            ("control", "acceleration_max_m_s2", "1.0"),
            ("control", "acceleration_max_m_s2", "3.0"),
            ("control", "grip_mu", "0.3"),
            ("control", "law", "\"eq-3.25\""),
        ],
        change,
    );
    generated::check("tuning.md", "drive", &text);
    let text = table(
        "slope-drive",
        "Change",
        &[
            ("phi_estimate_error_rms_deg", 3),
            ("slope_estimate_error_rms_deg", 3),
            ("spar_peak_deg", 2),
        ],
        &[
            NONE,
            ("estimator", "tilt_time_constant_s", "0.3"),
            ("estimator", "tilt_time_constant_s", "10.0"),
            ("estimator", "bias_time_constant_s", "600.0"),
        ],
        change,
    );
    generated::check("tuning.md", "estimator", &text);
    let text = table(
        "zero-radius-turn",
        "yaw_kp_v_s_per_rad",
        &[
            ("yaw_rate_peak_rad_s", 3),
            ("current_peak_a", 1),
            ("armed_s", 2),
            ("faults", 0),
        ],
        &["2.0", "4.0", "12.0", "60.0"].map(|value| ("control", "yaw_kp_v_s_per_rad", value)),
        |(_, _, value)| (*value).to_owned(),
    );
    generated::check("tuning.md", "yaw", &text);
}
