//! Tests of the allowed contents of scenario files.

use super::*;

mod bad_files;
mod bad_vehicles;

#[test]
fn the_default_scenario_is_valid() {
    let scenario = Scenario::parse(DEFAULT_NAME, DEFAULT).expect("valid");
    assert!(scenario.steps.len() > 4 && scenario.metrics.len() > 6);
}

#[test]
fn bad_scenarios_are_refused_with_file_field_and_range() {
    let base = "title = \"t\"\nduration_s = 10.0\n";
    for (text, parts) in [
        ("duration_s = 1.0\n", vec!["title is missing"]),
        (
            "title = \"t\"\nduration_s = nan\n",
            vec!["duration_s = NaN", "0.1 to 3600"],
        ),
        (
            &format!("{base}wings = 2\n"),
            vec!["unknown name `wings`", "duration_s"],
        ),
        (
            &format!("{base}[[step]]\nat_s = 11.0\naction = \"arm\"\n"),
            vec!["step[0].at_s = 11", "0 to 10", "(line 4, column 8)"],
        ),
        (
            &format!("{base}[[step]]\nat_s = 3.0\naction = \"arm\"\n\n[[step]]\nat_s = 1.0\naction = \"disarm\"\n"),
            vec!["step[1].at_s = 1", "3 to 10", "(line 8, column 8)"],
        ),
        (&format!("{base}[[step]]\nat_s = 1.0\naction = \"fly\"\n"), vec!["fly"]),
        (
            &format!(
                "{base}[[step]]\nat_s = 1.0\naction = \"arm\"\n\n[[step]]\nat_s = 2.0\naction = \"jamm\"\nside = \"left\"\n"
            ),
            vec![
                "step[1].action = \"jamm\": unknown action; did you mean `jam`?",
                "(line 9, column 10)",
                "chocks, jam, ",
                "link, stuck-operator",
            ],
        ),
        (
            &format!("{base}[[step]]\nat_s = 1.0\naction = \"arm\"\n[metrics]\nphi_peak = \"much\"\n"),
            vec!["metrics.phi_peak", "(line 7, column 12)"],
        ),
        (
            &format!("{base}[metrics]\nphi_peak = [0.0, 1.0]\n"),
            vec!["metrics.phi_peak", "did you mean `phi_peak_deg`?"],
        ),
        (
            &format!(
                "{base}[[step]]\nat_s = 1.0\naction = \"sensor-fault\"\nsensor = \"left-encoder\"\nfault = \"no-force\"\n"
            ),
            vec!["step[0].fault = no-force", "arm-imu and spar-imu"],
        ),
        (
            "[body]\nwheel_radius_m = 0.25\n",
            vec!["this is a vehicle file", "--vehicle"],
        ),
        (
            &format!("{base}[[step]]\nat_s = 1.0\naction = \"drive\"\nspeed_m_s = inf\n"),
            vec!["step[0].speed_m_s = inf", "-20 to 20"],
        ),
        (
            &format!("{base}[[step]]\nat_s=1.0\naction=\"sensor-fault\"\nsensor=\"arm-imu\"\nfault=\"sad\"\n"),
            vec!["step[0].fault = \"sad\" is unknown", "stuck"],
        ),
        (
            &format!("{base}[[step]]\nat_s = 1.0\naction = \"drive\"\nspeed = 1.0\n"),
            vec!["unknown name `speed`; did you mean `speed_m_s`?"],
        ),
        (
            &format!("{base}[[step]]\nat_s=1.0\naction=\"analog-fault\"\nsensor=\"battery-voltages\"\n"),
            vec!["did you mean `battery-voltage`?", "left-current"],
        ),
        (
            &format!("{base}[[step]]\nat_s=1.0\naction=\"push\"\non=\"arm\"\nfor_s=0.1\nforward_n=2e4\n"),
            vec!["step[0].forward_n = 20000", "-10000 to 10000"],
        ),
        (
            &format!("{base}[[step]]\nat_s=1.0\naction=\"link\"\nloss=nan\n"),
            vec!["step[0].loss = NaN", "0 to 1"],
        ),
        (
            &format!("{base}[[step]]\nat_s=1.0\naction=\"stand\"\nraised=true\nwings=1\n"),
            vec!["step[0]: unknown name `wings`", "raised"],
        ),
        (
            &format!("{base}[[step]]\nat_s=1.0\naction=\"link-noise\"\nbytes=1000001\n"),
            vec!["step[0].bytes = 1000001", "0 to 1000000"],
        ),
        (
            &format!(
                "{base}{0}bytes=999999\n{0}bytes=2\n",
                "[[step]]\nat_s=1.0\naction=\"link-noise\"\n"
            ),
            vec!["step[1].bytes = 2", "0 to 1"],
        ),
        (
            &format!("{base}[plant.left]\nbacklash_deg = 11.0\n"),
            vec!["plant.left.backlash_deg = 11", "0 to 10"],
        ),
        (
            &format!("{base}[[step]]\nat_s = 1.0\naction = \"arm\"\nspeed = 1.0\n"),
            vec!["unknown name `speed`"],
        ),
    ] {
        refused(text, &parts);
    }
}

#[test]
fn bounds_of_no_metric_and_no_range_are_refused() {
    let base = "title = \"t\"\nduration_s = 10.0\n[metrics]\n";
    refused(
        &format!("{base}beauty = [0, 1]\n"),
        &["metrics.beauty", "`drive --json` lists them all"],
    );
    refused(
        &format!("{base}phi_peak = [0, 1]\n"),
        &["metrics.phi_peak", "did you mean `phi_peak_deg`?"],
    );
    refused(
        &format!("{base}phi_peak_deg = [2, 1]\n"),
        &["metrics.phi_peak_deg = [2, 1]"],
    );
}

/// Checks that the scenario is refused and that the message contains each of these parts.
fn refused(text: &str, parts: &[&str]) {
    let message = Scenario::parse("s.toml", text).expect_err(text).to_string();
    assert!(message.starts_with("s.toml: "), "{message}");
    for part in parts {
        assert!(message.contains(part), "{message:?} lacks {part:?}");
    }
}
