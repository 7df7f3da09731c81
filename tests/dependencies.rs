//! The external crates: each has a row with its reason, the row names exactly the packages that use it, and each package uses what
//! its manifest names.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

#[path = "support/files.rs"]
mod files;
use files::files;

/// Dependencies that a package's sources do not name, each with the reason.
const UNNAMED: &[(&str, &str, &str)] = &[(
    "vehicle-file",
    "serde",
    "with it the firmware's build script takes the packages that the tools are built with",
)];

/// Rows of the table that are no crates.
const NO_CRATES: [&str; 1] = ["uPlot"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// A dependency as a manifest names it.
struct Dependency {
    name: String,
    /// Whether only tests, examples and benchmarks may use it.
    tests_only: bool,
    /// Whether only the build script may use it.
    build_only: bool,
    /// Whether it is a package of this repository.
    own: bool,
}

/// Every package: name, folder, dependencies.
fn packages() -> Vec<(String, PathBuf, Vec<Dependency>)> {
    let manifests = files(&root(), &["toml"]);
    let manifests = manifests.iter().filter(|path| path.ends_with("Cargo.toml"));
    manifests
        .filter_map(|file| {
            let text = fs::read_to_string(file).expect("a manifest is readable");
            let manifest: toml::Table = text.parse().expect("a manifest");
            let package = manifest.get("package")?.get("name")?.as_str()?.to_owned();
            let folder = file.parent().expect("a file stands in a folder").to_owned();
            Some((package, folder, dependencies(&manifest)))
        })
        .collect()
}

fn dependencies(manifest: &toml::Table) -> Vec<Dependency> {
    let kinds = ["dependencies", "dev-dependencies", "build-dependencies"];
    let targets = manifest.get("target").and_then(toml::Value::as_table);
    let tables = targets.into_iter().flat_map(|targets| targets.values());
    let tables = tables.filter_map(toml::Value::as_table).chain([manifest]);
    tables
        .flat_map(|table| kinds.map(|kind| (kind, table.get(kind).and_then(toml::Value::as_table))))
        .flat_map(|(kind, listed)| {
            listed.into_iter().flatten().map(move |(name, wanted)| Dependency {
                name: name.clone(),
                tests_only: kind == "dev-dependencies",
                build_only: kind == "build-dependencies",
                own: wanted.get("path").is_some(),
            })
        })
        .collect()
}

/// Who uses a crate: packages, and packages of which only the tests do.
type Users = (BTreeSet<String>, BTreeSet<String>);

/// The users that the cell of a row names: `a, b; tests of c, d`.
fn users(cell: &str) -> Users {
    let mut users = Users::default();
    for part in cell.split("; ") {
        let (named, set) = match part.strip_prefix("tests of ") {
            Some(named) => (named, &mut users.1),
            None => (part, &mut users.0),
        };
        set.extend(named.split(", ").map(str::to_owned));
    }
    users
}

/// Every crate that any package depends on has a row in the table of dependencies; the row names its users, and no others.
#[test]
fn every_dependency_has_its_reason() {
    let page = fs::read_to_string(root().join("docs/architecture.md")).expect("the page is readable");
    let table = page.lines().skip_while(|line| *line != "## Dependencies").skip(1);
    let table = table.take_while(|line| !line.starts_with("## "));
    let mut rows: BTreeMap<String, Users> = BTreeMap::new();
    for row in table.filter(|line| line.starts_with("| ") && !line.starts_with("| Crate")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        assert!(cells.len() > 4 && !cells[3].is_empty(), "no reason: {row}");
        for name in cells[1].split(", ").filter(|name| !NO_CRATES.contains(name)) {
            assert!(
                rows.insert(name.to_owned(), users(cells[2])).is_none(),
                "{name} has two rows"
            );
        }
    }
    let mut found: BTreeMap<String, Users> = BTreeMap::new();
    for (package, _, dependencies) in packages() {
        let short = if package == "vehicle-console" {
            "console"
        } else {
            &package
        };
        for dependency in dependencies.iter().filter(|dependency| !dependency.own) {
            let users = found.entry(dependency.name.clone()).or_default();
            let set = if dependency.tests_only {
                &mut users.1
            } else {
                &mut users.0
            };
            set.insert(short.to_owned());
        }
    }
    for (all, tests) in found.values_mut() {
        tests.retain(|package| !all.contains(package));
    }
    for (name, users) in &found {
        let row = rows
            .get(name)
            .unwrap_or_else(|| panic!("{users:?} use {name}, which has no row"));
        assert_eq!(row, users, "the row of {name} (left) and its users (right)");
    }
    for name in rows.keys() {
        assert!(found.contains_key(name), "no package uses {name}, which has a row");
    }
    assert!(found.len() > 40, "{} crates found", found.len());
}

/// The sources of a package that may use a dependency, as one text.
fn sources(package: &str, folder: &Path, dependency: &Dependency) -> String {
    let folders: &[&str] = if dependency.tests_only {
        &["src", "tests", "examples", "benches"]
    } else {
        &["src", "fuzz_targets"]
    };
    let mut paths: Vec<PathBuf> = folders.iter().map(|name| folder.join(name)).collect();
    // The vehicle's tests stand at the top of the workspace.
    if package == "hil-sim" && dependency.tests_only {
        paths.push(root().join("tests"));
    }
    let mut texts: Vec<PathBuf> = paths
        .iter()
        .filter(|path| path.is_dir())
        .flat_map(|path| files(path, &["rs"]))
        .collect();
    if dependency.build_only {
        texts = vec![folder.join("build.rs")];
    }
    texts
        .iter()
        .map(|path| fs::read_to_string(path).expect("a source is readable"))
        .collect()
}

/// Whether a text contains a name as a whole word.
fn names(text: &str, name: &str) -> bool {
    let in_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.match_indices(name)
        .any(|(at, _)| !text[..at].ends_with(in_word) && !text[at + name.len()..].starts_with(in_word))
}

#[test]
fn every_package_uses_its_dependencies() {
    let (mut unused, mut needed) = (Vec::new(), [false; UNNAMED.len()]);
    let mut checked = 0;
    for (package, folder, dependencies) in packages() {
        for dependency in &dependencies {
            checked += 1;
            if names(
                &sources(&package, &folder, dependency),
                &dependency.name.replace('-', "_"),
            ) {
                continue;
            }
            let known = UNNAMED
                .iter()
                .position(|(user, name, _)| *user == package && *name == dependency.name);
            match known {
                Some(n) => needed[n] = true,
                None => unused.push(format!("{package}: {}", dependency.name)),
            }
        }
    }
    assert!(unused.is_empty(), "{unused:#?}");
    for (known, needed) in UNNAMED.iter().zip(needed) {
        assert!(needed, "{known:?} is named or gone: take it out of the list");
    }
    assert!(checked > 120, "{checked} dependencies checked");
}
