//! The numbers and files that the pages of `docs/` give for names of the sources.
#![allow(dead_code)] // This binary uses part of the shared helpers.

#[path = "support/constants.rs"]
mod constants;
#[path = "support/definitions.rs"]
mod definitions;
#[path = "support/files.rs"]
mod files;
#[path = "support/generated.rs"]
mod generated;
#[path = "support/pages.rs"]
mod pages;

use constants::Constants;
use definitions::defines;
use generated::root;

/// "for 150 ticks (`SLIDES_TICKS` in `FILE`)": the page's number is the constant's, and the file defines it.
#[test]
fn every_number_beside_a_constant_is_its_value() {
    let root = root();
    let constants = Constants::of(&root);
    let tick_us = model::sample::TICK_US as f64;
    let (mut compared, mut wrong) = (0, Vec::new());
    for page in pages::all(&root) {
        for citation in constants::citations(&page.prose()) {
            for name in &citation.names {
                let values = constants.values(name, citation.file.as_deref());
                let is_duration = constants.is_duration(name);
                let given: Vec<f64> = constants::numbers(&citation.sentence)
                    .into_iter()
                    .filter_map(|(number, unit)| constants::in_unit_of(name, is_duration, number, &unit, tick_us))
                    .collect();
                if values.is_empty() || given.is_empty() {
                    continue;
                }
                compared += 1;
                // A page rounds to the digits that it prints, a constant in f32 to its own.
                let agree = |given: &f64| values.iter().any(|value| (given - value).abs() <= 1e-6 * value.abs());
                if !given.iter().any(agree) {
                    wrong.push(format!(
                        "{}: {name} is {values:?}, the page says: {}",
                        page.name, citation.sentence
                    ));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(compared >= 40, "{compared} numbers compared");
}

/// "`NAME` in `FILE`": the file defines the name.
#[test]
fn a_file_that_a_page_gives_for_a_name_defines_it() {
    let root = root();
    let (mut compared, mut wrong) = (0, Vec::new());
    for page in pages::all(&root) {
        for paragraph in page.prose().split("\n\n") {
            let text = paragraph.split_whitespace().collect::<Vec<_>>().join(" ");
            for (at, _) in text.match_indices("` in `") {
                let file = text[at + 6..].split('`').next().unwrap_or_default();
                let path = root.join(file);
                if path.extension().is_none_or(|extension| extension != "rs") || !path.is_file() {
                    continue;
                }
                let source = std::fs::read_to_string(path).expect("a source");
                // The names of a list: `A`, `B` in `FILE`.
                for name in listed_before(&text[..=at]) {
                    let defined = name.split("::").all(|part| defines(&source, part));
                    compared += 1;
                    if !defined {
                        wrong.push(format!("{}: `{name}` is not in {file}", page.name));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(compared >= 40, "{compared} names looked for");
}

/// The names in backquotes at the end of a text, with commas or "and" between them.
fn listed_before(text: &str) -> Vec<&str> {
    let mut names = Vec::new();
    let mut rest = text;
    while let Some(inner) = rest.strip_suffix('`')
        && let Some((before, name)) = inner.rsplit_once('`')
        && !name.contains('/')
    {
        names.push(name);
        let before = before.trim_end();
        rest = before
            .strip_suffix(',')
            .or_else(|| before.strip_suffix(" and"))
            .unwrap_or("");
    }
    names
}
