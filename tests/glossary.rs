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
        let sources: String = code(files)
            .filter_map(|file| std::fs::read_to_string(Path::new(ROOT).join(file)).ok())
            .collect();
        // Names in capitals are types, constants and variants; the fields of the vehicle file have pages of their own.
        let names = code(names).filter(|name| name.starts_with(|c: char| c.is_ascii_uppercase()));
        for name in names.filter(|_| !sources.is_empty()) {
            let last = name.rsplit("::").next().unwrap_or(name);
            checked += 1;
            if !defines(&sources, last) {
                wrong.push(format!("`{name}` is not defined in {files}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(checked > 20, "{checked} names checked");
}

#[test]
fn a_use_is_no_definition() {
    let source = "use crate::Sensed;\npub struct Sample {\n    pub analog: Analog,\n}\n    Armed = 1, \"armed\";\n";
    for (name, defined) in [
        ("Sample", true),
        ("Armed", true),
        ("Sensed", false),
        ("Analog", false),
        ("Sam", false),
    ] {
        assert_eq!(defines(source, name), defined, "{name}");
    }
}
