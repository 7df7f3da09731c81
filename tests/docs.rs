//! The pages of `docs/`: their tables agree with the sources, and every command, test, flag, file and name that they mention
//! exists. `UPDATE_DOCS=1` rewrites the generated tables.
#![allow(dead_code)] // This binary uses part of the shared helpers.

use std::fmt::Write as _;
use std::process::Command;

use firmware::drive_board;
use firmware::protocol::frame::encode;
use firmware::protocol::message::{Envelope, HostMessage, Order, OrderId};
use model::analog::{Analog, AnalogScale};
use model::command::DriveCommand;
use model::supervise::codes::{Blocker, Fault, FaultSet, Limit};
use plant::fault::SensorFault;
use plant::settings::{BoardSettings, DriveSettings, ImuSettings, Setting};
use virtual_board::scenario::wire::LinkStep;
use virtual_board::scenario::world::{AnalogSensor, WorldStep};
use virtual_board::scenario::{Action, Scenario, metrics};

#[path = "support/boards.rs"]
mod boards;
#[path = "support/files.rs"]
mod files;
#[path = "support/generated.rs"]
mod generated;
#[path = "support/pages.rs"]
mod pages;
#[path = "support/ripple.rs"]
mod ripple;
#[path = "support/shown.rs"]
mod shown;
#[path = "support/switching.rs"]
mod switching;

use files::files;
use generated::root;
use pages::Page;

fn page(name: &str) -> Page {
    pages::all(&root())
        .into_iter()
        .find(|page| page.name == name)
        .expect("the page is there")
}

#[test]
fn the_safety_page_names_every_code() {
    let mut faults = String::from("| No. | Fault | Class | Meaning | Remedy |\n|---|---|---|---|---|\n");
    for fault in Fault::ALL.iter().copied() {
        let classes = [
            (FaultSet::OPENING, "opens"),
            (FaultSet::STOPPING, "stops"),
            (FaultSet::SPAR, "spar"),
        ];
        let class: Vec<&str> = classes
            .iter()
            .filter(|(set, _)| set.contains(fault))
            .map(|(_, name)| *name)
            .collect();
        let [class] = class[..] else {
            panic!("{} is in {class:?}", fault.name())
        };
        let (name, meaning) = (fault.name(), fault.meaning().trim());
        let remedy = fault.remedy();
        let _ = writeln!(faults, "| {} | {name} | {class} | {meaning} | {remedy} |", fault as u8);
    }
    generated::check("safety.md", "faults", &faults);

    let mut blockers = String::from("| No. | Blocker | Meaning | Remedy |\n|---|---|---|---|\n");
    for blocker in Blocker::ALL.iter().copied() {
        let (name, meaning) = (blocker.name(), blocker.meaning().trim());
        let remedy = blocker.remedy();
        let _ = writeln!(blockers, "| {} | {name} | {meaning} | {remedy} |", blocker as u8);
    }
    generated::check("safety.md", "blockers", &blockers);

    let mut limits = String::from("| No. | Limit | Meaning |\n|---|---|---|\n");
    for limit in Limit::ALL.iter().copied() {
        let (name, meaning) = (limit.name(), limit.meaning().trim());
        let _ = writeln!(limits, "| {} | {name} | {meaning} |", limit as u8);
    }
    generated::check("safety.md", "limits", &limits);
}

#[test]
fn the_safety_page_tells_how_each_fault_is_found() {
    let mut text = String::from("| Fault | Detected by | Bound |\n|---|---|---|\n");
    for (fault, (_, by, bound)) in Fault::ALL.iter().zip(Fault::DETECTION) {
        let _ = writeln!(text, "| {} | {by} | {bound} |", fault.name());
    }
    generated::check("safety.md", "detection", &text);
}

#[test]
fn the_scenarios_page_lists_every_scenario() {
    let mut text = String::from("| File | Length, s | Shows |\n|---|---|---|\n");
    for path in files(&root().join("tests/scenarios"), &["toml"]) {
        let scenario = Scenario::read(&path).expect("a good file");
        let name = path.file_name().expect("a file").to_string_lossy().into_owned();
        let Scenario { title, duration_s, .. } = scenario;
        let _ = writeln!(
            text,
            "| [`{name}`](../tests/scenarios/{name}) | {duration_s} | {title} |"
        );
    }
    generated::check("scenarios.md", "scenarios", &text);
}

#[test]
fn the_scenarios_page_explains_every_metric_and_fault() {
    let page = page("scenarios.md");
    assert_eq!(page.first_cells("## Metrics"), metrics::NAMES);
    let faults = page.first_cells("### Sensor faults").into_iter();
    let faults = faults.map(|name| serde_json::from_value(name.into()).expect("a fault"));
    assert_eq!(faults.collect::<Vec<SensorFault>>(), SensorFault::ALL);
    let examples = page.fenced("toml");
    assert!(!examples.is_empty());
    for example in examples {
        Scenario::parse("example", example).expect("every example is a whole scenario");
    }
}

#[test]
fn the_scenarios_page_explains_every_step() {
    let steps = [&Action::NAMES[..], &WorldStep::NAMES, &LinkStep::NAMES].concat();
    let page = page("scenarios.md");
    assert_eq!(page.first_cells("## Steps"), steps);
    let row = page.text.lines().find(|line| line.starts_with("| `analog-fault` |"));
    for sensor in AnalogSensor::names() {
        assert!(row.is_some_and(|row| row.contains(&format!("`{sensor}`"))), "{sensor}");
    }
    for step in steps {
        // A step without its fields is refused because of the fields, not because of its name.
        let text = format!("title = \"t\"\nduration_s = 1.0\n[[step]]\nat_s = 0.5\naction = \"{step}\"\n");
        if let Err(error) = Scenario::parse("s.toml", &text) {
            assert!(error.to_string().contains(" is missing: "), "{error}");
        }
    }
}

#[test]
fn the_scenarios_page_lists_every_setting_of_the_plant() {
    let table = |settings: &[Setting]| {
        let mut text = String::from("| Field | Meaning | Allowed | If left out |\n|---|---|---|---|\n");
        for setting in settings {
            let Setting {
                name,
                meaning,
                min,
                max,
                default,
            } = setting;
            let _ = writeln!(text, "| `{name}` | {} | {min} to {max} | {default} |", meaning.trim());
        }
        text
    };
    generated::check("scenarios.md", "plant-drive", &table(DriveSettings::FIELDS));
    generated::check("scenarios.md", "plant-imu", &table(ImuSettings::FIELDS));
    generated::check("scenarios.md", "plant-board", &table(BoardSettings::FIELDS));
}

#[test]
fn the_architecture_page_shows_a_frame() {
    let (speed_m_s, yaw_rate_rad_s) = (1.0, -0.5);
    let id = OrderId {
        session: 1,
        sequence: 2,
    };
    let envelope = Envelope { id, given_at_us: 300 };
    let order = Order::Drive(DriveCommand::driving(speed_m_s, yaw_rate_rad_s));
    let message = HostMessage::Order { envelope, order };
    let bytes: Vec<String> = encode(&message)
        .expect("fits")
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    let text = format!("`{}`", bytes.join(" "));
    generated::check("architecture.md", "frame", &text);
}

#[test]
fn the_architecture_page_has_the_boards_facts() {
    let scales = &drive_board::SCALES;
    let rows = [
        (
            "`DUTY_MAX_PERCENT`",
            format!("{} %", drive_board::DUTY_MAX_PERCENT),
            "largest duty of a bridge",
        ),
        (
            "`WATCHDOG_US`",
            format!("{} us", drive_board::WATCHDOG_US),
            "watchdog's time",
        ),
        ("`LINK_BAUD`", format!("{} baud", drive_board::LINK_BAUD), "host link"),
        (
            "`FLASH_SECTOR_BYTES`",
            format!("{} bytes", drive_board::FLASH_SECTOR_BYTES),
            "what an erase clears",
        ),
        (
            "`FLASH_WORD_BYTES`",
            format!("{} bytes", drive_board::FLASH_WORD_BYTES),
            "what is programmed at once",
        ),
        (
            "`PARAMETER_SECTORS`",
            format!("{}", drive_board::PARAMETER_SECTORS),
            "sectors of the parameter store",
        ),
        (
            "`gyro_lsb_per_deg_s`",
            format!("{}", scales.imu.gyro_lsb_per_deg_s),
            "gyros",
        ),
        (
            "`accel_lsb_per_g`",
            format!("{}", scales.imu.accel_lsb_per_g),
            "accelerometers",
        ),
    ];
    let mut text = String::from("| Fact | Value | Of |\n|---|---|---|\n");
    for (name, value, of) in rows {
        let _ = writeln!(text, "| {name} | {value} | {of} |");
    }
    for (name, scale) in Analog::<()>::NAMES.iter().zip(scales.analog.values()) {
        let AnalogScale { per_count, zero_count } = scale;
        let _ = writeln!(
            text,
            "| `{name}` | {per_count:.6} per count of 16 bits, 0 at {zero_count} | analogue input, V or A |"
        );
    }
    generated::check("architecture.md", "board", &text);
}

#[test]
fn the_power_stage_page_has_the_ripple() {
    let vehicle = vehicle_file::read_vehicle(&root().join("vehicles/reference.toml")).expect("readable");
    let motor = ripple::motor(&vehicle.parameters().drive_motor);
    generated::check("power-stage.md", "ripple", &ripple::modulations(&motor));
    generated::check("power-stage.md", "samples", &ripple::samples(&motor));
}

#[test]
fn the_porting_page_counts_a_boards_lines() {
    generated::check("porting.md", "lines", &boards::table(&root()));
}

#[test]
fn the_errata_are_numbered_and_listed() {
    let page = page("errata.md");
    let heads = page.text.lines().filter_map(|line| line.strip_prefix("### "));
    let numbers: Vec<&str> = heads.filter_map(|head| head.split('.').next()).collect();
    let expected: Vec<String> = (1..=38).map(|n| format!("E{n}")).collect();
    assert_eq!(numbers, expected);
    let listed: Vec<String> = page
        .first_cells("## Contents")
        .iter()
        .map(|cell| {
            cell.trim_start_matches('[')
                .split(']')
                .next()
                .unwrap_or_default()
                .to_owned()
        })
        .collect();
    assert_eq!(listed, expected);
}

#[test]
fn the_adding_page_counts_its_places() {
    let page = page("adding.md");
    // The section on commands has two lists: for a quantity and for a request.
    for (what, places, lists) in [
        ("parameter", 2, 1),
        ("fault", 2, 1),
        ("sensor", 4, 1),
        ("command", 2, 2),
    ] {
        let claim = format!("| [a {what}](#a-{what})");
        let claim = page.text.lines().find(|line| line.starts_with(&claim)).expect(what);
        assert_eq!(claim.split(" | ").nth(1), Some(&*places.to_string()), "{claim}");
        let section = page.text.split(&format!("\n## A {what}\n")).nth(1).expect(what);
        let section = section.split("\n## ").next().unwrap_or_default();
        let numbers = (1..=places).map(|n| section.matches(&format!("\n| {n}. ")).count());
        assert_eq!(numbers.collect::<Vec<_>>(), vec![lists; places], "{what}");
        assert!(!section.contains(&format!("\n| {}. ", places + 1)), "{what}");
    }
}

/// `every_test_that_a_page_names_exists` checks that the commands of the rows run tests.
#[test]
fn every_section_of_the_safety_page_has_what_shows_it() {
    shown::every_section_has_rows(&page("safety.md"));
}

#[test]
fn a_test_names_every_code() {
    assert_eq!(shown::untested_codes(&root()), [""; 0]);
}

#[test]
fn every_test_that_a_page_names_exists() {
    let board = root().join("hil-sim/board-emulator/tests/hil_elf");
    let mut cited = 0;
    for page in pages::all(&root()) {
        for command in page.commands() {
            // Variables stand before a command; the words after `--` are for the test binary.
            let words = command.split(' ').filter(|word| !word.contains('='));
            let words: Vec<&str> = words.take_while(|word| *word != "--").collect();
            let tests = match words[..] {
                ["cargo", "test", ref arguments @ ..] => pages::selected(&root(), arguments),
                ["cargo", "hil-elf", ref filter @ ..] => {
                    let mut tests = pages::unit_tests(&board);
                    tests.retain(|test| filter.iter().all(|filter| test.contains(filter)));
                    tests
                }
                _ => continue,
            };
            assert!(!tests.is_empty(), "{}: `{command}` runs no test", page.name);
            cited += 1;
        }
    }
    assert!(cited > 50, "{cited} commands found");
}

#[test]
fn every_tool_command_that_a_page_names_is_understood() {
    let mut cited = 0;
    for page in pages::all(&root()) {
        for command in page.commands() {
            let words: Vec<&str> = command.split(' ').collect();
            let (["hil-sim", arguments @ ..]
            | ["cargo", "run", "--", arguments @ ..]
            | ["cargo", "run", "--release", "--", arguments @ ..]) = &words[..]
            else {
                continue;
            };
            // A synopsis is no command.
            if command.contains('[') {
                continue;
            }
            // The words after a pipe or a redirection are not the tool's.
            let arguments = arguments.split(|word| *word == "|" || *word == ">").next();
            let output = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
                .args(arguments.unwrap_or_default())
                .arg("--help")
                .output()
                .expect("it starts");
            let message = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{}: `{command}`: {message}", page.name);
            cited += 1;
        }
    }
    assert!(cited > 40, "{cited} commands found");
}

/// Whether a piece of inline code is a name: of a type, a constant, a function, a field.
fn is_name(code: &str) -> bool {
    let word = |part: &str| part.len() > 2 && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    code.split("::").all(word) && code.chars().any(|c| c.is_ascii_alphabetic())
}

#[test]
fn every_name_and_file_that_a_page_mentions_exists() {
    let root = root();
    let sources: String = files(&root, &["rs", "toml", "x", "c"])
        .iter()
        .filter(|path| !path.ends_with("tests/docs.rs"))
        .map(|path| std::fs::read_to_string(path).expect("a source"))
        .collect();
    let mut cited = 0;
    for page in pages::all(&root) {
        for code in page.code() {
            if is_name(&code) {
                let missing = code.split("::").find(|part| !sources.contains(part));
                assert_eq!(missing, None, "{}: `{code}` is nowhere in the sources", page.name);
                cited += 1;
            } else if code.contains('/') && !code.contains([' ', '*', '{', '(']) {
                // Files that the commands of the pages write are not in the tree.
                let made = ["target/", "out/", "vehicles/mine"]
                    .iter()
                    .any(|start| code.starts_with(start));
                assert!(made || root.join(&code).exists(), "{}: `{code}` is no file", page.name);
                cited += 1;
            }
        }
    }
    assert!(cited > 200, "{cited} names found");
}
