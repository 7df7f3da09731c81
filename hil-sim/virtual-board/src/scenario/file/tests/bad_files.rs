//! Attacks on the reader of scenarios: each message names the file, the place, the text found there and the allowed values.

use vehicle_file::{place::TextPlace, reference};

use model::vehicle::Vehicle;

use super::super::*;

/// Splits a text with a `^` before the error into the text without the `^` and the place of the
/// `^`.
pub(super) fn marked(text: &str) -> (String, Option<String>) {
    let place = text.find('^').map(|at| TextPlace::of(text, at).to_string());
    (text.replacen('^', "", 1), place)
}

pub(super) fn told(message: &str, text: &str, place: Option<String>, parts: &[&str]) {
    assert!(message.starts_with("bad.toml: "), "{message}");
    for part in parts {
        assert!(message.contains(part), "{text:?}:\n{message:?} lacks {part:?}");
    }
    if let Some(place) = place {
        assert!(
            message.ends_with(&format!("({place})")),
            "{text:?}:\n{message:?} is at {place}"
        );
    }
    // The message contains no wording of the parser libraries.
    for raw in [
        "f64",
        "u64",
        "u32",
        "struct",
        "variant",
        "TOML parse error",
        "invalid type",
        "invalid value",
    ] {
        assert!(!message.contains(raw), "{message:?} says {raw:?}");
    }
}

/// Bad scenarios: the text after title and length, and the parts of the message. `^` marks the
/// place.
const SCENARIOS: [(&str, &[&str]); 58] = [
    ("seed = ^-1", &["seed = -1", "a whole number from 0"]),
    ("seed = ^1.5", &["seed = 1.5", "a whole number from 0"]),
    ("seed = ^\"one\"", &["seed = \"one\"", "a whole number from 0"]),
    ("seed = ^99999999999999999999", &["seed"]),
    ("vehicle = ^3", &["vehicle = 3", "a text in quotes"]),
    (
        "chocked_until_armed = ^1",
        &["chocked_until_armed = 1", "true or false"],
    ),
    ("^wings = 2", &["unknown name `wings`", "title", "step"]),
    (
        "^duration = 2",
        &["unknown name `duration`; did you mean `duration_s`?"],
    ),
    ("^title = \"again\"", &["duplicate key"]),
    ("[^step]\nat_s = 1.0", &["[[step]]"]),
    ("^step = 3", &["[[step]]"]),
    ("^step = [1, 2]", &["[[step]]"]),
    ("[terrain\n", &["not valid TOML"]),
    ("= 3", &["not valid TOML"]),
    ("[[step]]\naction = \"arm\"", &["step[0].at_s", "a time in s"]),
    (
        "[[step]]\nat_s = ^\"soon\"\naction = \"arm\"",
        &["step[0].at_s", "a time in s"],
    ),
    (
        "[[step]]\nat_s = ^nan\naction = \"arm\"",
        &["step[0].at_s = NaN", "0 to 10"],
    ),
    (
        "[[step]]\nat_s = ^-1\naction = \"arm\"",
        &["step[0].at_s = -1", "0 to 10"],
    ),
    (
        "[[step]]\nat_s = ^1e300\naction = \"arm\"",
        &["step[0].at_s", "0 to 10"],
    ),
    ("[[step]]\nat_s = 1", &["step[0].action", "a step needs an action"]),
    ("[[step]]\nat_s = 1\naction = ^3", &["step[0].action", "arm, disarm"]),
    (
        "[[step]]\nat_s = 1\naction = ^\"pusch\"",
        &["\"pusch\"", "did you mean `push`?"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"arm\"\nspeed = 1",
        &["step[0]", "unknown name `speed`"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"drive\"\nspeed_m_s = ^\"fast\"",
        &["step[0].speed_m_s = \"fast\"", "a number"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"drive\"\n^speed = 1",
        &["did you mean `speed_m_s`?"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"drive\"\nspeed_m_s = ^-21",
        &["step[0].speed_m_s = -21", "-20 to 20"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"drive\"\nyaw_rate_rad_s = ^inf",
        &["step[0].yaw_rate_rad_s = inf"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"emergency-stop\"\npressed = ^\"yes\"",
        &["step[0].pressed = \"yes\"", "true or false"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"emergency-stop\"",
        &["step[0].pressed is missing"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"link-noise\"\nbytes = ^-4",
        &["step[0].bytes = -4", "a whole number from 0"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"link-noise\"\nbytes = ^1000001",
        &["step[0].bytes = 1000001", "0 to 1000000"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"battery\"\nopen_circuit_v = ^101",
        &["step[0].open_circuit_v = 101", "0 to 100"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"jam\"\nside = ^\"lleft\"\njammed = true",
        &["step[0].side = \"lleft\"", "did you mean `left`?", "right"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"sensor-fault\"\nsensor = ^\"nose\"\nfault = \"off\"",
        &["step[0].sensor = \"nose\"", "arm-imu"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"sensor-fault\"\nsensor = \"arm-imu\"\nfault = ^\"sad\"",
        &["step[0].fault", "fault = \"sad\" is unknown", "stuck"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"sensor-fault\"\nsensor = \"left-encoder\"\nfault = ^\"no-force\"",
        &["step[0].fault = no-force", "arm-imu and spar-imu"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"arm\"\n[[step]]\nat_s = 2\naction = \"push\"\non = \"arm\"\nfor_s = ^0",
        &["step[1].for_s = 0", "0.001 to 3600"],
    ),
    (
        "[[step]]\nat_s = 1\naction = \"link\"\nloss = ^2",
        &["step[0].loss = 2", "0 to 1"],
    ),
    (
        "[metrics]\nfaults = ^[1.0]",
        &["metrics.faults = [1]", "the names of exactly these faults"],
    ),
    ("[metrics]\nfaults = ^[0, 3]", &["metrics.faults = [0, 3]", "exact"]),
    (
        "[metrics]\nfaults = ^[\"Sadness\"]",
        &["`Sadness` is none", "EmergencyStop"],
    ),
    ("[metrics]\nfaults = ^[4294967295, 4294967295]", &["no such value"]),
    (
        "[metrics]\nfinal_mode = ^[3, 3]",
        &["no such value", "disarmed, armed, stopping"],
    ),
    ("[metrics]\nfinal_mode = ^[\"asleep\"]", &["`asleep` is none", "armed"]),
    (
        "[metrics]\nphi_peak_deg = ^3",
        &["metrics.phi_peak_deg = 3", "two numbers"],
    ),
    (
        "[metrics]\nphi_peak_deg = ^[1, 2, 3]",
        &["metrics.phi_peak_deg = [1, 2, 3]", "two numbers"],
    ),
    (
        "[metrics]\nphi_peak_deg = ^[\"armed\"]",
        &["metrics.phi_peak_deg", "two numbers"],
    ),
    ("[metrics]\nphi_peak_deg = ^[nan, 1]", &["must not exceed"]),
    ("[metrics]\nphi_peak = ^[0, 1]", &["did you mean `phi_peak_deg`?"]),
    (
        "[terrain.plane]\nslope_x_rad = ^nan",
        &["terrain: plane.slope_x_rad = NaN", "-1.2 to 1.2"],
    ),
    (
        "[terrain.plane]\n^slope_rad = 0.1",
        &["terrain.plane: unknown name `slope_rad`", "slope_x_rad"],
    ),
    (
        "[[terrain.profile]]\nkind = ^\"rmap\"",
        &["terrain.profile[0].kind = \"rmap\"", "did you mean `ramp`?", "joints"],
    ),
    (
        "[[terrain.profile]]\nkind = \"step\"\nat_m = 1\nheight_m = ^\"low\"",
        &["terrain.profile[0].height_m = \"low\"", "a number"],
    ),
    (
        "[[terrain.patch]]\nfrom_m = 1\nto_m = 2\nleft = 0.1\nright = 0.1\n[[terrain.patch]]\nfrom_m = 1\nto_m = 2\nleft = 0\nright = ^-1",
        &["patch[1].right = -1", "0 to 5"],
    ),
    (
        "[plant.left]\nbacklash_deg = ^\"much\"",
        &["plant.left.backlash_deg = \"much\"", "0 to 10"],
    ),
    (
        "[plant.battery]\ncapacity_ah = 1\nopen_circuit_v = ^[[0, 1]]\ncharge = 0.5\n[plant.board]\nbrown_out_v = 70",
        &["plant."],
    ),
    (
        "[plant.wheels]\nround = true",
        &["plant: unknown name `wheels`", "left"],
    ),
    (
        "[plant.vehicle]\nbody.wheel_radius_m = ^\"big\"",
        &["plant.vehicle.body.wheel_radius_m = \"big\"", "0.01 to 2"],
    ),
];

#[test]
fn every_bad_scenario_is_told_with_its_place() {
    for (text, parts) in SCENARIOS {
        let (text, place) = marked(&format!("title = \"t\"\nduration_s = 10.0\n{text}\n"));
        let message = Scenario::parse("bad.toml", &text)
            .map(drop)
            .expect_err(&text)
            .to_string();
        // The place that is reported for a whole table is that of one of its parts.
        let place = place.filter(|_| !parts.contains(&"plant."));
        told(&message, &text, place, parts);
        // Line ends and byte-order marks of other systems do not change the message.
        let other = text.replace('\n', "\r\n");
        let message_there = Scenario::parse("bad.toml", &other)
            .map(drop)
            .expect_err(&text)
            .to_string();
        assert_eq!(message_there, message);
    }
}

#[test]
fn what_is_wrong_with_the_whole_file_is_told_without_a_place() {
    for (text, parts) in [
        ("", &["it says nothing", "title and duration_s"][..]),
        ("# only a comment\n", &["it says nothing"]),
        ("duration_s = 1.0\n", &["title is missing", "a text of one line"]),
        ("title = \"t\"\n", &["duration_s is missing", "0.1 to 3600"]),
        (
            "title = 3\nduration_s = 1\n",
            &["title = 3: allowed is a text of one line (line 1, column 9)"],
        ),
        (
            "title = \"t\"\nduration_s = \"long\"\n",
            &["duration_s = \"long\": allowed is 0.1 to 3600 (line 2, column 14)"],
        ),
        ("[body]\nwheel_radius_m = 0.25\n", &["this is a vehicle file"]),
    ] {
        told(
            &Scenario::parse("bad.toml", text).map(drop).expect_err(text).to_string(),
            text,
            None,
            parts,
        );
    }
    // A byte-order mark is no part of the first name.
    assert!(Scenario::parse("good.toml", "\u{feff}title = \"t\"\r\nduration_s = 1.0\r\n").is_ok());
}

/// Settings and ground that are wrong only for this vehicle.
#[test]
fn what_does_not_fit_the_vehicle_is_told_with_its_place() {
    let reference = reference().expect("good");
    let mut bare = *reference.parameters();
    bare.spar = None;
    let bare = Vehicle::new(bare).expect("a vehicle");
    let spar = ["this vehicle has no", "[spar]"];
    for (vehicle, text, parts) in [
        (
            &reference,
            "[plant.vehicle]\nbody.wheel_radius_m = ^3",
            &["plant.vehicle.body.wheel_radius_m = 3", "0.01 to 2"][..],
        ),
        (
            &reference,
            "[plant.vehicle]\nbody.wheel_radius_m = ^nan",
            &["plant.vehicle.body.wheel_radius_m = NaN"],
        ),
        (
            &reference,
            "[plant.vehicle.body]\ntotal_mass_kg = 10",
            &["plant.vehicle.body.arm_mass_kg = 12.24", "10 here"],
        ),
        (
            &reference,
            "[plant.vehicle.body]\nwings = ^2",
            &["plant.vehicle.body.wings: unknown name"],
        ),
        (
            &reference,
            "[plant.vehicle.control]\nkp = ^0.1",
            &["plant.vehicle.control.kp: unknown name"],
        ),
        (
            &bare,
            "[plant.vehicle.spar]\nspar_length_m = ^0.1",
            &["plant.vehicle.spar.spar_length_m: unknown name"],
        ),
        (
            &reference,
            "[[terrain.profile]]\nkind = \"step\"\nat_m = 1\nheight_m = ^0.08",
            &["profile[0].height_m = 0.08", "-0.075 to 0.075"],
        ),
        (
            &reference,
            "[[terrain.profile]]\nkind = \"step\"\nat_m = 1\nheight_m = 0.01\n^[[terrain.profile]]\nkind = \"sine\"\nfrom_m = 3\nwavelength_m = 0.5\nheight_m = 0.1\nwaves = 1",
            &["profile[1]: its sharpest hollow"],
        ),
        (
            &bare,
            "[[step]]\nat_s = 1\naction = \"arm\"\n[[step]]\nat_s = 1\naction = \"push\"\non = ^\"spar\"\nfor_s = 1",
            &spar,
        ),
        (
            &bare,
            "[[step]]\nat_s = 1\naction = \"sensor-fault\"\nsensor = ^\"spar-imu\"\nfault = \"off\"",
            &spar,
        ),
        (
            &bare,
            "[[step]]\nat_s = 1\naction = \"sensor-fault\"\nsensor = ^\"ballast-encoder\"\nfault = \"off\"",
            &spar,
        ),
        (
            &bare,
            "[[step]]\nat_s = 1\naction = \"encoder-loss\"\nmotor = ^\"ballast\"\nshare = 0.1",
            &spar,
        ),
        (
            &bare,
            "[[step]]\nat_s = 1\naction = \"motor-leads\"\nmotor = ^\"ballast\"\nleads = \"open\"",
            &spar,
        ),
        (
            &bare,
            "[[step]]\nat_s = 1\naction = \"half-bridge\"\nmotor = ^\"ballast\"\ndead = \"forward\"",
            &spar,
        ),
        (&bare, "[plant.^spar_imu]\ntemperature_c = 20", &spar),
    ] {
        let (text, place) = marked(&format!("title = \"t\"\nduration_s = 10.0\n{text}\n"));
        let scenario = Scenario::parse("bad.toml", &text).expect(&text);
        let message = scenario.plant(vehicle).map(drop).expect_err(&text).to_string();
        told(&message, &text, place, parts);
        // For a vehicle that has the part, the step is accepted.
        if parts == spar {
            assert!(scenario.plant(&reference).is_ok(), "{text}");
        }
    }
}
