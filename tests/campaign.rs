//! Campaigns from outside: shards, merging, exit codes, messages.

use std::path::{Path, PathBuf};

#[path = "support/tool.rs"]
mod tool;
use tool::{hil_sim, stderr};

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("campaign").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Writes a scenario of one second, in which the vehicle arms, with these bounds; returns its path.
fn scenario(folder: &Path, name: &str, bounds: &str) -> String {
    let path = folder.join(name);
    let text =
        format!("title = \"{name}\"\nduration_s = 1.0\n[[step]]\nat_s = 0.7\naction = \"arm\"\n[metrics]\n{bounds}");
    std::fs::write(&path, text).expect("written");
    path.to_str().expect("utf-8").to_owned()
}

#[test]
fn shards_merge_to_exactly_what_one_run_of_the_whole_writes() {
    let folder = folder("shards");
    let file = |name: &str| folder.join(name).to_str().expect("utf-8").to_owned();
    let stands = scenario(&folder, "stands.toml", "faults = [0.0, 0.0]");
    let flags = [
        "--seeds",
        "3:5",
        "--set",
        "vehicle.body.arm_mass_kg=11,12",
        "--set",
        "scenario.plant.arm_imu.misalignment_x_deg=0,1",
    ];
    let run = |more: &[&str]| {
        let arguments: Vec<&str> = ["campaign", "run", &stands]
            .into_iter()
            .chain(flags)
            .chain(more.iter().copied())
            .collect();
        hil_sim(&arguments)
    };
    let whole = run(&["--out", &file("whole.jsonl"), "--jobs", "1"]);
    assert!(whole.status.success(), "{}", stderr(&whole));
    for part in ["1", "2", "3", "4", "5"] {
        let output = run(&[
            "--out",
            &file(&format!("part-{part}.jsonl")),
            "--shard",
            &format!("{part}/5"),
        ]);
        assert!(output.status.success(), "{}", stderr(&output));
    }
    let parts: Vec<String> = ["4", "1", "5", "3", "2"]
        .map(|part| file(&format!("part-{part}.jsonl")))
        .into();
    let merge = |parts: &[String]| {
        let mut arguments = vec!["campaign", "merge"];
        arguments.extend(parts.iter().map(String::as_str));
        let out = file("merged.jsonl");
        arguments.extend(["--out", &out]);
        hil_sim(&arguments)
    };
    let merged = merge(&parts);
    assert!(merged.status.success(), "{}", stderr(&merged));
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect(name);
    assert_eq!(read("merged.jsonl"), read("whole.jsonl"));
    assert_eq!(read("whole.jsonl").lines().count(), 1 + 12);

    // If a shard is missing, given twice, cut off, or from another campaign, the tool says which and writes nothing.
    std::fs::remove_file(folder.join("merged.jsonl")).expect("there");
    let mut twice = parts.clone();
    twice.push(parts[0].clone());
    let other = run(&[
        "--out",
        &file("other.jsonl"),
        "--shard",
        "1/5",
        "--set",
        "scenario.seed=1",
    ]);
    assert!(other.status.success(), "{}", stderr(&other));
    let mut foreign = parts.clone();
    foreign[1] = file("other.jsonl");
    let text = read("part-3.jsonl");
    let cut = text.trim_end().rsplit_once('\n').expect("lines").0;
    std::fs::write(folder.join("cut.jsonl"), cut).expect("written");
    let mut unfinished = parts.clone();
    unfinished[3] = file("cut.jsonl");
    for (wrong, words) in [
        (&parts[1..], "missing"),
        (&parts[..4], "missing"),
        (&twice[..], "twice"),
        (&foreign[..], "another campaign"),
        (&unfinished[..], "did not end"),
    ] {
        let output = merge(wrong);
        assert_eq!(output.status.code(), Some(2), "{wrong:?}");
        assert!(stderr(&output).contains(words), "{words}: {}", stderr(&output));
        assert!(!folder.join("merged.jsonl").exists());
    }
}

#[test]
fn a_run_out_of_bounds_ends_with_1_and_tells_seed_and_reason() {
    let folder = folder("fails");
    let drives = scenario(&folder, "drives.toml", "distance_m = [100.0, 200.0]");
    let output = hil_sim(&["campaign", "run", &drives, "--seeds", "7:8", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
    assert_eq!(summary["runs"], 2);
    assert_eq!(summary["failed"], 2);
    assert_eq!(summary["groups"][&drives]["first_failure"][0], 7);
    let unjudged = scenario(&folder, "unjudged.toml", "");
    let output = hil_sim(&["campaign", "run", &unjudged, "--seeds", "1:2", "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
    assert_eq!((&summary["passed"], &summary["not_judged"]), (&0.into(), &2.into()));
}

/// Asserts that the command ends with exit code 2 and a message.
fn refused(arguments: &[&str]) {
    let output = hil_sim(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
    assert!(output.stdout.is_empty() && !stderr(&output).is_empty(), "{arguments:?}");
}

#[test]
fn what_cannot_run_is_refused_before_the_first_run() {
    let kerb = "tests/scenarios/kerb.toml";
    for flags in [
        &["--seeds", "5:4"][..],
        &["--seeds", "1:99999999999999999999"],
        &["--seeds", "1:999999999999"],
        &["--shard", "0/3"],
        &["--shard", "4/3"],
        &["--jobs", "0"],
        &["--set", "vehicle.body.arm_mass_kg=1e9"],
        &["--set", "speed=1"],
        &["--vehicle", "missing.toml"],
        &["--out", "missing/results.jsonl"],
    ] {
        refused(&[&["campaign", "run", kerb][..], flags].concat());
    }
    for flags in [
        &["--drives", "100000001"][..],
        &["--climbs", "1001"],
        &["--first-seed", "18446744073709551615"],
        &["--shard", "0/3"],
        &["--jobs", "0"],
        &["--law", "eq-3.26"],
        &["--vehicle", "missing.toml"],
        &["--out", "missing/results.jsonl"],
    ] {
        refused(&[&["campaign", "search"][..], flags].concat());
    }
}

/// 2,100 drives, in three blocks of up to a thousand, under the law that lets arms whirl. One thread and shards with two threads
/// each write the same file, and exit code and summary report the whirls.
#[test]
fn a_search_tells_its_whirls_and_is_the_same_from_any_threads_and_shards() {
    let folder = folder("search");
    let file = |name: &str| folder.join(name).to_str().expect("utf-8").to_owned();
    let search = |more: &[&str]| {
        let flags = [
            "campaign", "search", "--law", "eq-3.25", "--drives", "2100", "--climbs", "0",
        ];
        let output = hil_sim(&[&flags[..], &["--plants", "2", "--first-seed", "7"], more].concat());
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert!(stderr(&output).contains("turned over"), "{}", stderr(&output));
        output
    };
    let whole = search(&["--out", &file("whole.jsonl"), "--jobs", "1", "--json"]);
    let summary: serde_json::Value = serde_json::from_slice(&whole.stdout).expect("one object");
    assert_eq!(summary["random"]["drives"], 2100);
    assert_eq!(summary["plants"]["plants"], 2);
    let whirls = summary["random"]["whirls"].as_u64().expect("a number");
    assert!(whirls > 1050 && whirls < 2100, "{whirls}");
    let worst = summary["random"]["worst"]["seed"].as_u64().expect("a seed");
    assert!((7..2107).contains(&worst), "{worst}");

    let mut arguments = vec!["campaign".to_owned(), "merge".to_owned()];
    for part in ["3", "1", "2"] {
        let out = file(&format!("part-{part}.jsonl"));
        search(&["--out", &out, "--shard", &format!("{part}/3"), "--jobs", "2"]);
        arguments.push(out);
    }
    arguments.extend(["--out".to_owned(), file("merged.jsonl")]);
    let merged = hil_sim(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    // As the search in one run ends, because arms have turned over.
    assert_eq!(merged.status.code(), Some(1), "{}", stderr(&merged));
    let told = String::from_utf8_lossy(&merged.stdout).into_owned();
    assert!(
        told.contains(&format!("worst seed {worst}")) && told.contains(&format!("{whirls} turn over")),
        "{told}"
    );
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect(name);
    assert_eq!(read("merged.jsonl"), read("whole.jsonl"));
    assert_eq!(read("whole.jsonl").lines().count(), 1 + 3);
}

/// A seed searched alone gives the same drive as among other seeds, and the optimiser makes the arm swing at least as far. If a
/// line is no result of a search, the tool names the line's number and writes nothing.
#[test]
fn one_seed_of_a_search_drives_alone_as_among_others() {
    let folder = folder("one-seed");
    let out = folder.join("part.jsonl");
    let swings = |flags: &[&str]| {
        let output = hil_sim(&[&["campaign", "search", "--json"][..], flags].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).expect("one object")
    };
    let among = swings(&["--drives", "20", "--climbs", "0", "--out", out.to_str().expect("utf-8")]);
    let worst = &among["random"]["worst"];
    let seed = worst["seed"].to_string();
    let alone = swings(&["--drives", "1", "--climbs", "1", "--first-seed", &seed]);
    assert_eq!(&alone["random"]["worst"], worst);
    let angle = |counts: &serde_json::Value| counts["worst"]["phi_max_rad"].as_f64();
    assert!(angle(&alone["climbed"]) >= angle(&alone["random"]), "{alone}");

    let text = std::fs::read_to_string(&out).expect("written");
    let wrong = text.replace("\"random\"", "\"other\"");
    assert_ne!(wrong, text);
    std::fs::write(&out, wrong).expect("writable");
    let merged = folder.join("merged.jsonl");
    let output = hil_sim(&[
        "campaign",
        "merge",
        out.to_str().expect("utf-8"),
        "--out",
        merged.to_str().expect("utf-8"),
    ]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("line 2"), "{}", stderr(&output));
    assert!(!merged.exists());
}
