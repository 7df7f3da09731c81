//! The claims of the safety page, and what shows them.

use std::path::Path;

use hil_sim::cli::bring_up::steps::STEPS;
use model::supervise::codes::{Blocker, Fault, Limit};

use super::files::files;
use super::pages::Page;

/// The heading of the table, the page's last section.
const HEADING: &str = "## What shows it";
/// The head of the table.
const HEAD: &str = "| Section | Claim | Shown by |\n|---|---|---|\n";

/// Asserts that the page's last table has rows for every section, and that every row names a command, or a step of the bring-up by
/// its title in quotes.
pub fn every_section_has_rows(page: &Page) {
    let sections: Vec<&str> = page.text.lines().filter(|line| line.starts_with("## ")).collect();
    let (last, claims) = sections.split_last().expect("sections");
    assert_eq!(*last, HEADING);
    let (_, table) = page.text.split_once(HEAD).expect("the table");
    let mut shown = Vec::new();
    for row in table.lines().take_while(|line| line.starts_with('|')) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        let [section, claim, by] = cells[..] else {
            panic!("{row}")
        };
        if let Some(name) = section.strip_prefix('[') {
            shown.push(format!("## {}", name.split(']').next().unwrap_or_default()));
        }
        let steps: Vec<&str> = by.split('"').skip(1).step_by(2).collect();
        for title in &steps {
            assert!(
                STEPS.iter().any(|step| step.title == *title),
                "{claim}: no step \"{title}\""
            );
        }
        assert!(by.contains("`cargo ") || !steps.is_empty(), "{claim}: nothing shows it");
    }
    assert_eq!(shown, claims);
}

/// The faults, blockers and limits that no source of a test and no scenario names.
pub fn untested_codes(root: &Path) -> Vec<String> {
    let sources = files(root, &["rs", "toml"]);
    let place = |path: &Path| {
        path.strip_prefix(root)
            .expect("below it")
            .to_string_lossy()
            .into_owned()
    };
    let tests: String = sources
        .iter()
        .filter(|path| place(path).contains("test"))
        .map(|path| std::fs::read_to_string(path).expect("a source"))
        .collect();
    let codes = Fault::ALL.iter().map(|code| ("Fault", code.name()));
    let codes = codes.chain(Blocker::ALL.iter().map(|code| ("Blocker", code.name())));
    let codes = codes.chain(Limit::ALL.iter().map(|code| ("Limit", code.name())));
    codes
        .filter(|(kind, name)| !tests.contains(&format!("{kind}::{name}")) && !tests.contains(&format!("\"{name}\"")))
        .map(|(kind, name)| format!("{kind}::{name}"))
        .collect()
}
