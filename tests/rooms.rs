//! Every package's sources are rooms with one purpose: no circle of imports between the modules of one
//! folder, and no file too long to read in one go. A package that appears later is checked too.

use std::fs;
use std::path::{Path, PathBuf};

#[path = "support/files.rs"]
mod files;
#[path = "support/imports.rs"]
mod imports;

use files::files;
use imports::Crate;

/// Most lines of a source file.
const LINES_MAX: usize = 400;

/// Files that may be longer, each with the reason.
const LONG: &[(&str, &str)] = &[("hil-sim/plant/src/tests.rs", "not split yet")];

/// Modules whose circles may stay, each as the crate's root and the module, with the reason.
const CIRCLES: &[(&str, &str, &str)] = &[];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A path as it reads from the workspace's root.
fn shown(path: &Path) -> String {
    path.strip_prefix(root()).expect("below the root").display().to_string()
}

/// The root files of every crate of every package: library, main program, further programs.
fn crates() -> Vec<PathBuf> {
    let manifests = files(&root(), &["toml"]);
    let manifests = manifests.iter().filter(|path| path.ends_with("Cargo.toml"));
    manifests
        .map(|path| path.with_file_name("src"))
        .flat_map(|sources| {
            let mut roots = vec![sources.join("lib.rs"), sources.join("main.rs")];
            if let Ok(programs) = fs::read_dir(sources.join("bin")) {
                for program in programs {
                    let path = program.expect("an entry").path();
                    roots.push(if path.is_dir() { path.join("main.rs") } else { path });
                }
            }
            roots
        })
        .filter(|file| file.exists())
        .collect()
}

#[test]
fn no_modules_import_each_other_in_a_circle() {
    let mut found = Vec::new();
    let mut modules = 0;
    let mut needed = [false; CIRCLES.len()];
    for file in crates() {
        let read = Crate::read(&file);
        modules += read.modules();
        for circle in read.circles() {
            let circle: Vec<String> = circle.iter().map(|place| place.join("::")).collect();
            let known = CIRCLES
                .iter()
                .position(|(root, module, _)| *root == shown(&file) && circle.iter().any(|name| name == module));
            match known {
                Some(n) => needed[n] = true,
                None => found.push(format!("{}: {}", shown(&file), circle.join(" -> "))),
            }
        }
    }
    assert!(found.is_empty(), "{found:#?}");
    for (known, needed) in CIRCLES.iter().zip(needed) {
        assert!(needed, "{known:?} is no circle any more: take it out of the list");
    }
    assert!(modules > 150, "{modules} modules found");
}

#[test]
fn no_file_is_too_long() {
    let mut found = Vec::new();
    let mut needed = [false; LONG.len()];
    let sources = files(&root(), &["rs"]);
    for file in &sources {
        let lines = fs::read_to_string(file).expect("a source is readable").lines().count();
        if lines > LINES_MAX {
            match LONG.iter().position(|(name, _)| *name == shown(file)) {
                Some(n) => needed[n] = true,
                None => found.push(format!("{}: {lines} lines", shown(file))),
            }
        }
    }
    assert!(found.is_empty(), "more than {LINES_MAX} lines: {found:#?}");
    for (known, needed) in LONG.iter().zip(needed) {
        assert!(needed, "{known:?} is short or gone: take it out of the list");
    }
    assert!(sources.len() > 150, "{} sources found", sources.len());
}
