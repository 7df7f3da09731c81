//! Parts of pages that tests write: the block between `<!-- generated: NAME -->` and `<!-- end -->`, and the results in the table
//! "What is shown" of docs/control.md.
#![allow(dead_code)] // Each test binary uses part of it.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Held while a test writes a block, so that no two tests write one page at once.
static WRITING: Mutex<()> = Mutex::new(());

/// The root of the workspace, seen from the package whose tests run.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .find(|folder| folder.join("Cargo.lock").exists())
        .expect("the package stands in the workspace")
        .to_owned()
}

/// Compares the block `name` of `docs/PAGE` with `text`; with `UPDATE_DOCS=1` writes it instead.
pub fn check(page: &str, name: &str, text: &str) {
    let _alone = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    let path = root().join("docs").join(page);
    let committed = std::fs::read_to_string(&path).expect("the page is readable");
    let begin = format!("<!-- generated: {name} -->\n");
    let start = committed.find(&begin).expect("the block begins") + begin.len();
    let length = committed[start..].find("<!-- end -->").expect("the block ends");
    let block = format!("\n{}\n\n", text.trim());
    if updates() {
        let page = [&committed[..start], &block, &committed[start + length..]].concat();
        std::fs::write(&path, page).expect("the page is writable");
    } else {
        assert_eq!(
            &committed[start..start + length],
            block,
            "docs/{page}, block {name}, is not what the sources say; UPDATE_DOCS=1 writes it anew"
        );
    }
}

/// Compares the second cell of the row of docs/control.md's table "What is shown" that begins with `what` with `found`; with
/// `UPDATE_DOCS=1` writes it instead. tests/doc_links.rs checks that for every row one test calls this.
pub fn shown(what: &str, found: &str) {
    let _alone = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    let path = root().join("docs/control.md");
    // Tests of other files may write the page at the same time.
    let lock = std::fs::File::open(&path).expect("the page is readable");
    lock.lock().expect("the page can be locked");
    let committed = std::fs::read_to_string(&path).expect("the page is readable");
    let start = committed.find("\n## What is shown\n").expect("the table");
    let begin = format!("\n| {what}");
    let row = start
        + committed[start..]
            .find(&begin)
            .unwrap_or_else(|| panic!("no row begins with {what:?}"))
        + 1;
    let cell = row + committed[row + 2..].find(" | ").expect("a second cell") + 5;
    let end = cell + committed[cell..].find(" | ").expect("a third cell");
    if updates() {
        let page = [&committed[..cell], found, &committed[end..]].concat();
        std::fs::write(&path, page).expect("the page is writable");
    } else {
        assert_eq!(
            &committed[cell..end],
            found,
            "docs/control.md, row {what:?}, is not what the test finds; UPDATE_DOCS=1 writes it anew"
        );
    }
}

/// Whether the test must renew the pages.
fn updates() -> bool {
    std::env::var_os("UPDATE_DOCS").is_some_and(|value| value == "1")
}
