//! Parts of pages that are written by a test: the block between `<!-- generated: NAME -->` and
//! `<!-- end -->`.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Blocks of one page are written one after the other.
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
    if std::env::var_os("UPDATE_DOCS").is_some_and(|value| value == "1") {
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
