//! Bad input, closed pipes and directories that cannot be written, for every analysis command: exit code 2,
//! one message that names the value and what is allowed, nothing on stdout.

use std::io::Read as _;
use std::process::{Command, Output, Stdio};

fn hil_sim(line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        // `''` is an empty argument.
        .args(line.split_whitespace().map(|a| if a == "''" { "" } else { a }))
        .output()
        .unwrap()
}

#[track_caller]
fn refused(line: &str, parts: &[&str]) {
    let output = hil_sim(line);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{line}: {message}");
    assert!(output.stdout.is_empty(), "{line}");
    assert_eq!(message.matches("error: ").count(), 1, "{line}: {message}");
    for part in parts {
        assert!(message.contains(part), "{line}: {message}");
    }
}

#[test]
fn numbers_that_are_none_are_refused_for_every_flag() {
    let flags = [
        (
            "equilibrium",
            "--l --alpha --zeta --mu --nu --beta --voltage --kp --kd --feed-forward",
        ),
        (
            "simulate --voltage 1",
            "--ramp-time --u-max --phi0 --theta-rate0 --t-end --sample",
        ),
        ("simulate", "--voltage --reference"),
        ("critical", "--phi0 --theta-rate0 --ramp-time --u-max"),
        ("slip-limit", "--mu-s"),
        ("envelope", "--ramp-time"),
        (
            "spatial",
            "--l --alpha --zeta --mu --nu --s --j0 --slope-x --slope-y --u-right --u-left",
        ),
        ("lqr", "--lm --lr --mm --mr --zeta --xi --r"),
        ("camera", "--tilt0-deg --ax --ay --v-max --t-end --sample"),
        ("coupled", "--lp --kr --voltage"),
    ];
    for (command, flags) in flags {
        for flag in flags.split(' ') {
            for value in ["NaN", "inf", "-inf", "1e400", "''", "one"] {
                let shown = if value == "''" { "" } else { value };
                refused(
                    &format!("{command} {flag} {value}"),
                    &[flag, &format!("'{shown}'"), "must be a finite number"],
                );
            }
            // Finite, but beyond the range of every model.
            refused(&format!("{command} {flag} 1e300"), &[flag, "must be "]);
        }
    }
}

#[test]
fn values_out_of_range_are_named_with_what_is_allowed() {
    for (line, parts) in [
        ("critical --l -1", ["--l is -1", "positive"]),
        ("critical --alpha 1", ["--alpha is 1", "above 0 and below 1"]),
        ("critical --zeta -1", ["--zeta is -1", "zero or more"]),
        ("critical --beta -0.81", ["--beta is -0.81", "asin(alpha l) = 0.8038"]),
        ("simulate --voltage 1 --sample 0", ["--sample is 0", "positive"]),
        (
            "simulate --voltage 1 --t-end 1 --sample 1.5",
            ["--sample is 1.5", "to --t-end = 1"],
        ),
        (
            "simulate --voltage 1 --t-end 1e9 --sample 1e3",
            ["--t-end is 1000000000", "at most 100000"],
        ),
        (
            "simulate --voltage 1 --t-end 1e5 --sample 1e-3",
            ["--sample is 0.001", "= 0.2 to"],
        ),
        (
            "simulate --voltage 1 --f32 --dt 0.1",
            ["--dt is 0.1", "at most --sample"],
        ),
        (
            "simulate --voltage 1 --ramp-time -1",
            ["--ramp-time is -1", "zero or more"],
        ),
        (
            "simulate --voltage 1 --waveform sawtooth",
            ["sawtooth", "quintic-smoothstep"],
        ),
        (
            "critical --waveform ramp --ramp-time 1e9",
            ["--ramp-time is 1000000000", "at most 10000"],
        ),
        (
            "critical --theta-rate0 -2e3",
            ["--theta-rate0 is -2000", "between -1000 and 1000"],
        ),
        ("critical --zeta 0", ["--zeta is 0", "zeta must be positive"]),
        (
            "critical --quantity reference --kp 2.3",
            ["--kp is 2.3", "must be negative"],
        ),
        ("envelope --slopes 0:0.9:3", ["--slopes is 0.9", "0.8038"]),
        ("envelope --slopes -2:0:3", ["--slopes is -2", "pi/2"]),
        ("spatial --sample 100 --t-end 1", ["--sample is 100", "--t-end = 1"]),
        (
            "spatial --state0 0,0,0,0,0,0,1e200,0,0",
            ["--state0", "between -1000 and 1000"],
        ),
        ("camera --ax -1e6", ["--ax is -1000000", "between -100000 and 100000"]),
        ("coupled --voltage", ["--voltage", "value is required"]),
        ("coupled --beta 0.6", ["--beta is 0.6", "0.58697"]),
    ] {
        refused(line, &parts);
    }
}

/// Counts and spans that would take for ever or need all of the memory.
#[test]
fn huge_counts_are_refused_with_what_is_allowed() {
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/scenarios/kerb.toml");
    let vehicle = concat!(env!("CARGO_MANIFEST_DIR"), "/../vehicles/reference.toml");
    for (line, parts) in [
        ("spatial --sample 1e-300".to_owned(), ["--sample is ", "0.00002 to"]),
        (
            "camera --t-end 1e5 --sample 0.19".to_owned(),
            ["--sample is 0.19", "0.2 to"],
        ),
        (
            "coupled --t-end 1.1e5".to_owned(),
            ["--t-end is 110000", "at most 100000"],
        ),
        (
            "simulate --voltage 1 --f32 --dt 1e-12".to_owned(),
            ["--dt is 0.000000000001", "at least 0.000003"],
        ),
        (
            "envelope --slopes 0:0.1:1001".to_owned(),
            ["0:0.1:1001", "N from 1 to 1000"],
        ),
        (
            "envelope --slopes 0:0.1:18446744073709551616".to_owned(),
            ["--slopes", "N from 1 to 1000"],
        ),
        (
            format!("kernel --vehicle {vehicle} --grid 322"),
            ["--grid is 322", "41 to 321"],
        ),
        (
            format!("drive {scenario} --seeds 0:18446744073709551615"),
            ["--seeds 0:18446744073709551615", "at most 10000"],
        ),
        (
            format!("bounds {scenario} --seeds 1:10001"),
            ["--seeds 1:10001", "at most 10000"],
        ),
        (
            format!("campaign run {scenario} --seeds 0:18446744073709551615"),
            ["runs", "at most 100000000"],
        ),
        (format!("campaign run {scenario} --jobs 1025"), ["--jobs", "1024"]),
        (format!("campaign run {scenario} --shard 1/0"), ["--shard", "I/N"]),
        ("serve --rate 1e-300".to_owned(), ["--rate", "0.01 to 100"]),
        (
            "bring-up --port no-port --cold-starts 1001".to_owned(),
            ["--cold-starts", "1..=1000"],
        ),
        (
            "link --port no-port status --seconds 1e300".to_owned(),
            ["--seconds 1", "up to 3600"],
        ),
    ] {
        refused(&line, &parts);
    }
}

/// The longest run that is allowed, with the most columns: twelve as JSON, as CSV, in charts and on a page.
#[cfg(target_os = "linux")]
#[test]
fn the_longest_run_of_the_widest_command_stays_within_half_a_gigabyte() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("longest-run");
    let out = folder.to_str().unwrap();
    let line = format!("spatial --u-right 0.3 --t-end 10 --sample 2e-5 --json --out {out} --html {out}/page.html");
    // The system refuses memory beyond the limit, and a refused allocation ends the tool.
    let limited = Command::new("sh")
        .args([
            "-c",
            "ulimit -v 524288; exec \"$@\"",
            "sh",
            env!("CARGO_BIN_EXE_hil-sim"),
        ])
        .args(line.split_whitespace())
        .stdout(Stdio::null())
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&limited.stderr);
    assert!(limited.status.success(), "{line}: {} {message}", limited.status);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_directory_that_cannot_be_written_is_bad_input() {
    for line in [
        "equilibrium",
        "simulate --voltage 1 --json",
        "lqr",
        "camera --json",
        "figures",
    ] {
        // A file in the place of the directory.
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
        refused(
            &format!("{line} --out {file}"),
            &["--out", file, "must be a directory that can be written"],
        );
    }
}

/// A reader that closes the pipe early, as `| head -c 1` does.
#[test]
fn a_reader_that_leaves_is_no_failure() {
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/scenarios/zero-radius-turn.toml");
    for line in [
        "simulate --voltage 1 --t-end 1000 --sample 0.01 --json",
        "spatial --u-right 0.3 --t-end 200 --sample 0.01 --json",
        "coupled --t-end 100 --sample 0.01 --json",
        "critical",
        &format!("drive {scenario} --json"),
    ] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
            .args(line.split_whitespace())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // Closed before the tool writes anything, so that every write fails.
        drop(child.stdout.take());
        let mut message = String::new();
        child.stderr.take().unwrap().read_to_string(&mut message).unwrap();
        let status = child.wait().unwrap();
        assert!(status.success() && message.is_empty(), "{line}: {status} {message}");
    }
}

/// If the integration cannot follow a motion, the command ends with a message, in bounded time, and without a result.
#[test]
fn a_motion_that_cannot_be_followed_is_said() {
    for line in [
        "simulate --voltage 0.5 --zeta 1e6 --t-end 1e4 --sample 1e4 --json",
        "camera --gains 1e9,1e9,1e9,1e9 --tilt0-deg 5 --json",
    ] {
        let output = hil_sim(line);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{line}: {message}");
        assert!(
            output.stdout.is_empty() && message.contains("cannot be followed beyond t = "),
            "{line}: {message}"
        );
    }
}
