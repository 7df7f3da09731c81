//! The report of a run: events with time and reason, a verdict only where there are bounds, scenarios by name.

use std::path::{Path, PathBuf};

use model::supervise::codes::Limit;

#[path = "support/tool.rs"]
mod tool;
use tool::{hil_sim, stderr};

fn file(name: &str, text: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, text).expect("writes");
    path
}

/// The object that `drive --json` prints for these arguments.
fn json(arguments: &[&str]) -> serde_json::Value {
    let output = hil_sim(&[&["drive", "--json"], arguments].concat());
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {}", stderr(&output)))
}

/// The events of one kind: time, duration, text.
fn events<'a>(run: &'a serde_json::Value, kind: &str) -> Vec<(f64, Option<f64>, &'a str)> {
    run["events"]
        .as_array()
        .expect("events")
        .iter()
        .filter(|event| event["kind"] == kind)
        .map(|event| {
            let number = |name: &str| event[name].as_f64();
            (
                number("at_s").expect("a time"),
                number("for_s"),
                event["text"].as_str().expect("text"),
            )
        })
        .collect()
}

#[test]
fn a_vehicle_that_dies_without_bounds_has_not_passed() {
    let path = file(
        "dies.toml",
        "title = \"dies\"\nduration_s = 6.0\n\
         [[step]]\nat_s = 2.0\naction = \"arm\"\n\
         [[step]]\nat_s = 3.0\naction = \"drive\"\nspeed_m_s = 0.5\n\
         [[step]]\nat_s = 4.0\naction = \"sensor-fault\"\nsensor = \"arm-imu\"\nfault = \"off\"\n",
    );
    let path = path.to_str().expect("utf-8");
    let run = json(&[path]);
    assert_eq!(
        (&run["verdict"], &run["ok"]),
        (&"not-judged".into(), &serde_json::Value::Null)
    );
    let faults = events(&run, "fault");
    let [(at_s, None, text)] = faults[..] else {
        panic!("{faults:?}")
    };
    // The fault comes within 15 ms of its cause, and shows in the next row of the trace.
    assert!(
        (4.0..4.03).contains(&at_s) && text.starts_with("ImuStale: "),
        "{at_s} {text}"
    );
    let output = hil_sim(&["drive", path, "--out", env!("CARGO_TARGET_TMPDIR")]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    let page = std::fs::read_to_string(Path::new(env!("CARGO_TARGET_TMPDIR")).join("index.html")).expect("the page");
    for (place, text) in [("table", &table), ("page", &page)] {
        assert!(
            text.contains("not judged") && !text.contains("passed"),
            "{place}: {text}"
        );
        assert!(
            text.contains("ImuStale: The arm IMU gave no sample in time."),
            "{place}"
        );
        assert!(text.contains("disarmed, the bridges are open"), "{place}");
    }
}

#[test]
fn a_refusal_says_what_blocks_and_a_stop_that_it_begins() {
    let run = json(&["emergency-stop"]);
    assert_eq!(run["verdict"], "passed");
    let refusals = events(&run, "refusal");
    assert!(
        refusals.iter().any(|(_, _, text)| text.contains("FaultLatched")),
        "{refusals:?}"
    );
    let run = json(&["dead-man"]);
    let modes: Vec<_> = events(&run, "mode").into_iter().map(|(_, _, text)| text).collect();
    assert_eq!(
        modes,
        ["armed", "a controlled stop begins", "disarmed, the bridges are open"]
    );
}

#[test]
fn slides_stalls_and_whirls_are_told_with_their_time() {
    let wall = "title = \"wall\"\nduration_s = 12.0\n\
         [[terrain.profile]]\nkind = \"step\"\nat_m = 1.0\nheight_m = 0.075\n\
         [[step]]\nat_s = 2.0\naction = \"arm\"\n\
         [[step]]\nat_s = 3.0\naction = \"drive\"\nspeed_m_s = 0.4\n";
    let run = json(&[file("wall.toml", wall).to_str().expect("utf-8")]);
    let stalls = events(&run, "stall");
    assert!(!stalls.is_empty(), "{run}");
    // The vehicle needs 2 s or more to reach the wall; nothing blocks it before.
    assert!(
        stalls.iter().all(|(at_s, for_s, _)| *at_s > 4.0 && for_s.is_some()),
        "{stalls:?}"
    );
    // The edge of 75 mm meets a wheel of 250 mm at acos(175/250) = 45.6 deg.
    let reason =
        "told to drive at 0.40 m/s, the vehicle is blocked: an edge rises at 46 deg under its wheels; its arm leans";
    assert!(stalls.iter().any(|(.., text)| text.contains(reason)), "{stalls:?}");

    let ice = "title = \"ice\"\nduration_s = 8.0\n\
         [terrain.plane]\nslope_x_rad = 0.0873\n\
         [[terrain.patch]]\nfrom_m = -100.0\nto_m = 100.0\nleft = 0.05\nright = 0.05\n\
         [[step]]\nat_s = 2.0\naction = \"arm\"\n";
    let run = json(&[file("ice.toml", ice).to_str().expect("utf-8")]);
    let slides = events(&run, "slide");
    let longest = slides.iter().filter_map(|(_, for_s, _)| *for_s).fold(0.0, f64::max);
    assert!(longest > 1.0, "{slides:?}");
    // tan(5 deg) = 0.09, on ground of 0.05.
    let reason = "the ground gives a grip of 0.05, and its slope of 5.0 deg asks for 0.09";
    assert!(
        slides
            .iter()
            .any(|(.., text)| text.starts_with("both wheels slide at up to ") && text.ends_with(reason)),
        "{slides:?}"
    );

    // No law can hold against this push.
    let push = "title = \"push\"\nduration_s = 6.0\n\
         [[step]]\nat_s = 2.0\naction = \"push\"\non = \"arm\"\nforward_n = 600.0\nfor_s = 0.5\n";
    let run = json(&[file("push.toml", push).to_str().expect("utf-8")]);
    let whirls = events(&run, "whirl");
    assert!(
        !whirls.is_empty() && whirls.iter().all(|(at_s, ..)| (2.0..4.0).contains(at_s)),
        "{whirls:?}"
    );
    // Pushed to 15 m/s with its bridges off, the vehicle charges the battery through the bridges' diodes once the push ends: the
    // motors brake and turn the arm over.
    assert!(
        whirls
            .iter()
            .all(|(.., text)| text.starts_with("the arm turns over backward at ")
                && text.contains("the motors, which brake the wheels with up to ")
                && text.ends_with(" N m, lift it")),
        "{whirls:?}"
    );
}

#[test]
fn a_shipped_scenario_is_found_by_its_name_and_a_wrong_name_lists_them() {
    assert_eq!(
        json(&["kerb"])["metrics"],
        json(&["tests/scenarios/kerb.toml"])["metrics"]
    );
    let output = hil_sim(&["drive", "curb"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("kerb, rail-inspection"), "{}", stderr(&output));
}

#[test]
fn bounds_left_aside_judge_nothing() {
    let path = file(
        "strict.toml",
        "title = \"t\"\nduration_s = 1.0\n[metrics]\narmed_s = [5.0, 6.0]\n",
    );
    let path = path.to_str().expect("utf-8");
    assert_eq!(hil_sim(&["drive", path, "--json"]).status.code(), Some(1));
    let output = hil_sim(&["drive", path, "--json", "--no-bounds"]);
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stdout).contains("\"verdict\":\"not-judged\""));
}

/// The small vehicle stalls at the kerb that the reference vehicle climbs, and keeps every bound of the dead man's scenario, whose
/// bounds are the reference vehicle's. Neither run has passed, and neither has failed.
#[test]
fn no_vehicle_passes_or_fails_by_what_another_measures() {
    const SMALL: [&str; 2] = ["--vehicle", "vehicles/small.toml"];
    let folder = env!("CARGO_TARGET_TMPDIR");
    let out = ["--out", folder];
    for scenario in ["kerb", "dead-man"] {
        let run = json(&[&[scenario][..], &SMALL].concat());
        assert_eq!(
            (&run["verdict"], &run["ok"]),
            (&"not-judged".into(), &serde_json::Value::Null),
            "{scenario}"
        );
        assert_eq!(scenario == "kerb", !events(&run, "stall").is_empty(), "{scenario}");
        let output = hil_sim(&[&["drive", scenario][..], &SMALL, &out].concat());
        assert_eq!(output.status.code(), Some(0), "{scenario}: {}", stderr(&output));
        let table = String::from_utf8_lossy(&output.stdout).into_owned();
        let page = std::fs::read_to_string(Path::new(folder).join("index.html")).expect("the page");
        for (place, text) in [("table", &table), ("page", &page)] {
            let told = text.contains("not judged") && text.contains("another vehicle's");
            assert!(told && !text.contains("passed"), "{scenario}, {place}: {text}");
        }
    }
    let spreads = json(&[&["dead-man", "--seeds", "1:2"][..], &SMALL].concat());
    assert_eq!((&spreads["passed"], &spreads["failed"]), (&0.into(), &0.into()));

    // A bound that holds for any vehicle judges this vehicle, too: its run ends with the fault of a silent operator.
    let path = file(
        "any.toml",
        &std::fs::read_to_string(format!("{}/tests/scenarios/dead-man.toml", tool::WORKSPACE))
            .expect("reads")
            .replace("faults = [2048.0, 2048.0]", "faults = []"),
    );
    let path = path.to_str().expect("utf-8");
    let output = hil_sim(&[&["drive", path, "--json"][..], &SMALL].concat());
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("faults = ") && !stderr(&output).contains("distance"));
}

/// A scenario's bounds judge its vehicle with other gains, too, and a scenario that names a vehicle judges that vehicle.
#[test]
fn a_vehicle_is_judged_by_bounds_of_its_own() {
    let ringing = vehicle_file::REFERENCE.replace("law = \"landing\"", "law = \"eq-3.25\"");
    let ringing = file("ringing-vehicle.toml", &ringing);
    let output = hil_sim(&["drive", "--json", "--vehicle", ringing.to_str().expect("utf-8")]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("speed_"), "{}", stderr(&output));

    let small = format!("{}/vehicles/small.toml", tool::WORKSPACE);
    let path = file(
        "own.toml",
        &format!("title = \"t\"\nduration_s = 3.0\nvehicle = {small:?}\n[metrics]\narmed_s = [0.0, 0.1]\n"),
    );
    let run = json(&[path.to_str().expect("utf-8"), "--vehicle", &small]);
    assert_eq!(run["verdict"], "passed");
}

#[test]
fn many_seeds_give_spreads_that_hold_each_run() {
    let path = file(
        "spread.toml",
        "title = \"t\"\nduration_s = 3.0\n[[step]]\nat_s = 2.0\naction = \"arm\"\n[metrics]\narmed_s = [0.9, 1.1]\n",
    );
    let path = path.to_str().expect("utf-8");
    let spreads = json(&[path, "--seeds", "1:5"]);
    assert_eq!((&spreads["runs"], &spreads["passed"]), (&5.into(), &5.into()));
    let phi = |metrics: &serde_json::Value| {
        let metrics = metrics.as_array().expect("metrics");
        let metric = metrics.iter().find(|metric| metric["name"] == "phi_peak_deg");
        metric.expect("there").clone()
    };
    let spread = phi(&spreads["metrics"]);
    let mut singles: Vec<f64> = (1..=5)
        .map(|seed| {
            phi(&json(&[path, "--seed", &seed.to_string()])["metrics"])["value"]
                .as_f64()
                .expect("number")
        })
        .collect();
    singles.sort_by(f64::total_cmp);
    assert_eq!(
        [&spread["least"], &spread["median"], &spread["most"]].map(|n| n.as_f64().expect("number")),
        [singles[0], singles[2], singles[4]]
    );
    assert!(singles[0] < singles[4]);

    let strict = file(
        "spread-strict.toml",
        "title = \"t\"\nduration_s = 1.0\n[metrics]\narmed_s = [0.9, 1.1]\n",
    );
    let output = hil_sim(&["drive", strict.to_str().expect("utf-8"), "--seeds", "3:4"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("2 of 2 runs failed or stopped, the first with seed 3"));
    for wrong in ["5:1", "x", "0:20000"] {
        let output = hil_sim(&["drive", path, "--seeds", wrong]);
        assert_eq!(output.status.code(), Some(2), "{wrong}");
    }
}

#[test]
fn suggested_bounds_hold_what_was_seen_and_parse() {
    let output = hil_sim(&["bounds", "kerb", "--seeds", "1:3", "--suggest"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let text = String::from_utf8_lossy(&output.stdout);
    let kerb = std::fs::read_to_string(format!("{}/tests/scenarios/kerb.toml", tool::WORKSPACE)).expect("reads");
    let without = kerb.split("[metrics]").next().expect("the rest");
    let path = file("suggested.toml", &format!("{without}\n{text}"));
    for seed in ["1", "2", "3"] {
        let run = json(&[path.to_str().expect("utf-8"), "--seed", seed]);
        assert_eq!(run["verdict"], "passed", "seed {seed}: {run}");
    }
}

/// A kerb holds the vehicle up, and its wheels come past the kerb: story, trace and page report that, there and nowhere else.
#[test]
fn what_the_wheels_come_past_is_told_where_it_stands() {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("freed");
    let run = json(&["kerb", "--out", out.to_str().expect("utf-8")]);
    let told = events(&run, "freed");
    let [(at_s, Some(for_s), _)] = told[..] else {
        panic!("{told:?}")
    };
    let trace = std::fs::read_to_string(out.join("trace.csv")).expect("the trace");
    let mut rows = trace.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = rows.next().expect("a header");
    let column = |name: &str| header.iter().position(|column| *column == name).expect(name);
    let (time, x, limits) = (column("time_s"), column("true_x_m"), column("limits"));
    let number = |row: &[&str], column: usize| row[column].parse::<f64>().expect("a number");
    let mut free = 0;
    for row in rows {
        if number(&row, limits) as u32 & (1 << Limit::Freed as u8) == 0 {
            continue;
        }
        free += 1;
        // The kerb of 20 mm stands at 4 m. Wheels of 0.25 m meet it 0.1 m before, and the status stops reporting 0.15 m after the
        // place where they came free.
        let (time_s, x_m) = (number(&row, time), number(&row, x));
        assert!((3.9..4.25).contains(&x_m), "{x_m} m");
        assert!((at_s - 0.02..at_s + for_s + 0.02).contains(&time_s), "{time_s} s");
    }
    // 0.15 m at no more than 1.3 m/s, with a hundred rows per second.
    assert!(free > 10, "{free} rows");
    let page = std::fs::read_to_string(out.join("index.html")).expect("the page");
    assert!(page.contains("come past what held them up"));
}

/// For an unknown sensor the message lists the present names. The tool reads the names of old files, but does not offer them.
#[test]
fn an_unknown_sensor_is_told_with_the_names_of_today() {
    let with = |sensor: &str| {
        let name = format!("{sensor}.toml");
        let text =
            "title = \"s\"\nduration_s = 3.0\n[[step]]\nat_s = 2.0\naction = \"sensor-fault\"\nfault = \"off\"\n";
        let path = file(&name, &format!("{text}sensor = \"{sensor}\"\n"));
        hil_sim(&["drive", "--json", path.to_str().expect("utf-8")])
    };
    let output = with("left-imu");
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(
        message.contains("allowed is arm-imu, spar-imu, left-encoder, right-encoder, ballast-encoder (line 7"),
        "{message}"
    );
    assert_eq!(with("chassis-imu").status.code(), Some(0));
}
