//! What the pages point at exists: the target of every link, and the test for every number of the table "What is shown".
#![allow(dead_code)] // This binary uses part of the shared helpers.

#[path = "support/files.rs"]
mod files;
#[path = "support/generated.rs"]
mod generated;
#[path = "support/pages.rs"]
mod pages;

use generated::root;

#[test]
fn every_link_leads_somewhere() {
    let root = root();
    let pages = pages::all(&root);
    let mut followed = 0;
    for page in &pages {
        for link in page.links() {
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let name = if file.is_empty() {
                page.name.clone()
            } else {
                page.target(file)
            };
            assert!(
                root.join("docs").join(&name).exists(),
                "{}: {link}: no such file",
                page.name
            );
            if !anchor.is_empty() {
                let target = pages.iter().find(|page| page.name == name).expect("a page of docs/");
                assert!(
                    target.anchors().iter().any(|found| found == anchor),
                    "{}: {link}: no such heading",
                    page.name
                );
            }
            followed += 1;
        }
    }
    assert!(followed > 40, "{followed} links found");
}

/// For every row of the control page's table "What is shown", exactly one test compares the row with its result.
#[test]
fn a_test_compares_every_row_of_what_is_shown() {
    let sources: String = files::files(&root(), &["rs"])
        .iter()
        .map(|path| std::fs::read_to_string(path).expect("a source"))
        .collect();
    let calls: Vec<&str> = sources
        .split("shown(")
        .filter_map(|rest| rest.trim_start().strip_prefix('"')?.split('"').next())
        .collect();
    let pages = pages::all(&root());
    let page = pages.iter().find(|page| page.name == "control.md").expect("there");
    let rows = page.first_cells("## What is shown");
    assert!(rows.len() > 20, "{rows:?}");
    for row in rows {
        let times = calls.iter().filter(|what| row.starts_with(**what)).count();
        assert_eq!(times, 1, "{row}: {times} tests compare it");
    }
}
