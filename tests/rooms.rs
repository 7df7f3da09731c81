//! Every package's sources are rooms with one purpose: no circle of imports between the modules of one folder, no file too long
//! to read in one go, no name for two types. The tests find new packages by themselves.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

#[path = "support/files.rs"]
mod files;
#[path = "support/imports.rs"]
mod imports;
#[path = "support/sides.rs"]
mod sides;

use files::files;
use imports::Crate;

/// Most lines of a source file.
const LINES_MAX: usize = 400;

/// Files that may be longer, each with the reason.
const LONG: &[(&str, &str)] = &[];

/// Modules whose circles may stay, each as the crate's root and the module, with the reason.
const CIRCLES: &[(&str, &str, &str)] = &[];

/// Programs some of whose modules import from above what imports from them, with the reason.
const FROM_ABOVE: &[(&str, &str)] = &[(
    "firmware/src/bin/drive-board",
    "what both boards share is a module of each board, and takes the board's pins and numbers from it",
)];

/// Names that several types may have, each with the reason.
const SHARED: &[(&str, &str)] = &[
    (
        "Arguments",
        "the flags of a command: one type for each command, in its module, as clap has it",
    ),
    (
        "Topics",
        "the board's alias fills in the one parameter of the firmware's type",
    ),
];

/// Names that several constants of one package may have: folder and names (none: every name), with the reason.
const SHARED_CONSTANTS: &[(&str, &[&str], &str)] = &[
    (
        "firmware/src/drive_board/",
        &[],
        "one folder for each board, with the same facts of each",
    ),
    (
        "firmware/src/bin/drive-board",
        &[],
        "one program for each board, with the same parts",
    ),
    (
        "model/src/dynamics",
        &["PHI", "PHI_RATE", "PSI", "THETA", "THETA_RATE"],
        "where a quantity stands in the state of each model",
    ),
    ("hil-sim", &["EXAMPLES"], "the examples of a command, in its module"),
    (
        "hil-sim/theory/src/figures",
        &["FIGURES"],
        "the figures of a chapter, in its module",
    ),
];

/// Files that may have right before left, with the reason.
const RIGHT_FIRST: &[(&str, &str)] = &[
    ("model/src/dynamics/spatial.rs", "the order of the thesis's ch. 6"),
    ("model/tests/spatial_derivation.rs", "the derivation of that model"),
    ("model/tests/spatial_wrong_forms.rs", "the wrong forms of that model"),
    ("hil-sim/theory/src/analysis/spatial.rs", "the state of that model"),
    (
        "hil-sim/theory/src/analysis/spatial_tests.rs",
        "the state of that model",
    ),
    (
        "hil-sim/plant/src/body/tests/in_space.rs",
        "the plant against that model",
    ),
    ("tests/rooms.rs", "what this test finds"),
    ("tests/support/sides.rs", "what this test finds"),
];

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

/// Every package's sources, parsed, except tests, which may give their helpers any names.
fn sources() -> impl Iterator<Item = (String, syn::File)> {
    files(&root(), &["rs"]).into_iter().filter_map(|file| {
        let place = shown(&file);
        if !place.contains("/src/") || place.contains("tests") {
            return None;
        }
        let text = fs::read_to_string(&file).expect("a source is readable");
        let source = syn::parse_file(&text).unwrap_or_else(|error| panic!("{place}: {error}"));
        Some((place, source))
    })
}

/// The names of the types that these items and the modules among them define. Types that a macro makes are not found.
fn types(items: &[syn::Item], names: &mut Vec<String>) {
    for item in items {
        match item {
            syn::Item::Struct(item) => names.push(item.ident.to_string()),
            syn::Item::Enum(item) => names.push(item.ident.to_string()),
            syn::Item::Trait(item) => names.push(item.ident.to_string()),
            syn::Item::Type(item) => names.push(item.ident.to_string()),
            syn::Item::Mod(module) if module.ident != "tests" => {
                types(module.content.as_ref().map_or(&[], |(_, items)| items), names);
            }
            _ => {}
        }
    }
}

#[test]
fn no_two_types_have_one_name() {
    let mut places: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (place, source) in sources() {
        let mut names = Vec::new();
        types(&source.items, &mut names);
        for name in names {
            places.entry(name).or_default().push(place.clone());
        }
    }
    assert!(places.len() > 300, "{} types found", places.len());
    let twice: BTreeMap<_, _> = places.iter().filter(|(_, places)| places.len() > 1).collect();
    let known = |name: &str| SHARED.iter().any(|(shared, _)| *shared == name);
    let found: BTreeMap<_, _> = twice.iter().filter(|(name, _)| !known(name)).collect();
    assert!(found.is_empty(), "{found:#?}");
    for (name, _) in SHARED {
        assert!(
            twice.contains_key(&(*name).to_owned()),
            "{name} is one type: take it out of the list"
        );
    }
}

/// The names of the constants and statics that a file defines at its top level.
fn constants(items: &[syn::Item]) -> impl Iterator<Item = String> {
    items.iter().filter_map(|item| match item {
        syn::Item::Const(item) if item.ident != "_" => Some(item.ident.to_string()),
        syn::Item::Static(item) => Some(item.ident.to_string()),
        _ => None,
    })
}

/// Within a package, a name stands for one number.
#[test]
fn no_two_constants_of_a_package_have_one_name() {
    let mut places: BTreeMap<(String, String), Vec<String>> = BTreeMap::new();
    for (place, source) in sources() {
        let (package, _) = place.split_once("/src/").expect("a package's source");
        for name in constants(&source.items) {
            places
                .entry((package.to_owned(), name))
                .or_default()
                .push(place.clone());
        }
    }
    assert!(places.len() > 500, "{} constants found", places.len());
    let shared = |(folder, names, _): &(&str, &[&str], &str), name: &str, place: &str| {
        place.starts_with(folder) && (names.is_empty() || names.contains(&name))
    };
    places.retain(|_, places| places.len() > 1);
    for entry in SHARED_CONSTANTS {
        let needed = places
            .iter()
            .any(|((_, name), places)| places.iter().any(|place| shared(entry, name, place)));
        assert!(
            needed,
            "{entry:?}: no constant there has the name of another: take it out of the list"
        );
    }
    for ((_, name), places) in &mut places {
        places.retain(|place| !SHARED_CONSTANTS.iter().any(|entry| shared(entry, name, place)));
    }
    places.retain(|_, places| places.len() > 1);
    assert!(places.is_empty(), "{places:#?}");
}

/// The glossary's rule: where both sides have a value, left stands first, in code, comments, texts, pages and files.
#[test]
fn left_stands_before_right() {
    let mut found = Vec::new();
    let (mut pairs, mut needed) = (0, [false; RIGHT_FIRST.len()]);
    for file in files(&root(), &["rs", "md", "toml"]) {
        let place = shown(&file);
        let text = fs::read_to_string(&file).expect("a file is readable");
        let mut right_first = sides::right_first_in_text(&text);
        if file.extension().is_some_and(|ending| ending == "rs") {
            let source = syn::parse_file(&text).unwrap_or_else(|error| panic!("{place}: {error}"));
            let sides = sides::Sides::of(&source);
            pairs += sides.left_first;
            right_first.extend(sides.right_first);
        }
        match RIGHT_FIRST.iter().position(|(known, _)| *known == place) {
            Some(n) => needed[n] |= !right_first.is_empty(),
            None => found.extend(right_first.iter().map(|names| format!("{place}: {names}"))),
        }
    }
    assert!(found.is_empty(), "{found:#?}");
    for (known, needed) in RIGHT_FIRST.iter().zip(needed) {
        assert!(needed, "{known:?} has left before right: take it out of the list");
    }
    assert!(pairs > 50, "{pairs} pairs found");
}

#[test]
fn right_before_left_is_seen_in_texts() {
    for (text, seen) in [
        ("/// Contacts of the right and\n/// the left wheel.", true),
        ("the voltages `u` (right, left)", true),
        ("[friction]\\nright = {mu}\\nleft = {mu}\\n", true),
        ("friction = { right = { mu_s = 1 }, left = 1 }", true),
        ("right less left; right before left", false),
        ("let right = a;\nlet left = b;", false),
        ("left = 1\nright = 2\n[other]\nleft = 3", false),
        ("[a]\nright = 2\nfrom_m = 1\nleft = 3", false),
    ] {
        assert_eq!(!sides::right_first_in_text(text).is_empty(), seen, "{text}");
    }
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

/// A module and the modules in it import in one direction too.
#[test]
fn no_module_imports_from_above_what_imports_from_it() {
    let (mut found, mut needed) = (Vec::new(), [false; FROM_ABOVE.len()]);
    for file in crates() {
        let imports = Crate::read(&file).imports_from_above();
        let place = shown(&file);
        match FROM_ABOVE.iter().position(|(program, _)| place.starts_with(program)) {
            Some(n) => needed[n] |= !imports.is_empty(),
            None => found.extend(imports.iter().map(|name| format!("{place}: {name}"))),
        }
    }
    assert!(found.is_empty(), "{found:#?}");
    for (known, needed) in FROM_ABOVE.iter().zip(needed) {
        assert!(needed, "{known:?} imports nothing from above: take it out of the list");
    }
}

#[test]
fn paths_in_macros_are_seen() {
    let tokens = r##"a , crate :: b :: C ("d :: e \" f :: g", 'x', '"', '\'') $crate::h::i < 'a , j :: k > r#"l :: "m"# n :: o :"##;
    let found: Vec<String> = imports::paths_in(tokens).iter().map(|path| path.join("::")).collect();
    assert_eq!(found, ["crate::b::C", "crate::h::i", "j::k", "n::o"]);
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
