//! The glossary: the file that a row gives defines the row's names.

use std::path::Path;

#[path = "support/definitions.rs"]
mod definitions;
use definitions::defines;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// The texts in back quotes of a cell.
fn code(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

#[test]
fn the_glossarys_names_are_defined_where_it_says() {
    let text = std::fs::read_to_string(Path::new(ROOT).join("docs/glossary.md")).expect("the page");
    let (mut columns, mut checked, mut wrong) = (None, 0, Vec::new());
    for line in text.lines() {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let column = |start: &str| cells.iter().position(|cell| cell.starts_with(start));
        if line.starts_with("| Term |") {
            columns = column("In code").zip(column("Defined in"));
        }
        let Some((name, file)) = columns.filter(|_| line.starts_with("| ")) else {
            continue;
        };
        let (Some(names), Some(files)) = (cells.get(name), cells.get(file)) else {
            panic!("{line}")
        };
        let read = |file: &str| {
            std::fs::read_to_string(Path::new(ROOT).join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
        };
        let sources: Vec<String> = code(files).map(read).collect();
        // A name with a star or in brackets is a group of fields or a table of the vehicle file, which has a page of its own.
        let plain = |name: &&str| !name.contains(['*', '[', '.']);
        for name in code(names).filter(plain).filter(|_| !sources.is_empty()) {
            let last = name.rsplit("::").next().unwrap_or(name);
            checked += 1;
            if !sources.iter().any(|source| defines(source, last)) {
                wrong.push(format!("`{name}` is not defined in {files}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(checked > 40, "{checked} names checked");
}

#[test]
fn a_use_is_no_definition() {
    let source = "use crate::Sensed;\npub struct Sample {\n    pub analog: Analog,\n}\ncodes! { /// Is armed.\n Armed = 1, \"armed\"; }\n\
        fn judge(action: Action) { match action { Action::World(world) => act(world), Other => stop(Wheel { radius: 1 }) } }";
    for (name, defined) in [
        ("Sample", true),
        ("analog", true),
        ("Armed", true),
        ("judge", true),
        ("Action", false),
        ("World", false),
        ("Other", false),
        ("world", false),
        ("radius", false),
        ("Sensed", false),
        ("Analog", false),
        ("Sam", false),
    ] {
        assert_eq!(defines(source, name), defined, "{name}");
    }
}
