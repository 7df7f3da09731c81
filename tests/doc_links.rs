//! Every link of the docs leads somewhere.
#![allow(dead_code)] // Of the shared helpers it uses its part.

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
            let name = if file.is_empty() { page.name.as_str() } else { file };
            assert!(
                root.join("docs").join(name).exists(),
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
