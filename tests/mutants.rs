//! `tests/mutants.md` against the sources: every listed mutant changes a line that exists.

use std::path::Path;

/// A change that survives: `FILE: CHANGE in FUNCTION: LINE`.
struct Survivor<'a> {
    file: &'a str,
    change: &'a str,
    function: &'a str,
    line: &'a str,
}

/// Reads one entry of the list, without its backquotes.
fn survivor(entry: &str) -> Option<Survivor<'_>> {
    let (file, rest) = entry.split_once(": ")?;
    let (change, line) = rest.split_once(": ")?;
    let (change, function) = change.rsplit_once(" in ")?;
    let function = function.rsplit("::").next()?;
    Some(Survivor {
        file,
        change,
        function,
        line,
    })
}

/// What an entry names and the sources below `root` lack.
fn missing(root: &Path, survivor: &Survivor) -> Option<String> {
    let Ok(source) = std::fs::read_to_string(root.join(survivor.file)) else {
        return Some(format!("no file {}", survivor.file));
    };
    if !source.lines().any(|line| line.trim() == survivor.line) {
        return Some(format!("{} has no line {}", survivor.file, survivor.line));
    }
    let function = format!("fn {}", survivor.function);
    if !source.contains(&format!("{function}(")) && !source.contains(&format!("{function}<")) {
        return Some(format!("{} has no {function}", survivor.file));
    }
    // "replace < with <= ...": the line contains the replaced text.
    let replaced = survivor
        .change
        .strip_prefix("replace ")
        .and_then(|rest| rest.split(" with ").next());
    replaced
        .filter(|replaced| !survivor.line.contains(replaced))
        .map(|replaced| format!("nothing to replace: {replaced} is not in {}", survivor.line))
}

#[test]
fn every_mutant_that_survives_changes_a_line_that_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let list = std::fs::read_to_string(root.join("tests/mutants.md")).expect("readable");
    let entries: Vec<&str> = list.lines().filter_map(|line| line.strip_prefix("- `")).collect();
    assert!(entries.len() >= 10, "{}", entries.len());
    let wrong: Vec<String> = entries
        .iter()
        .filter_map(|entry| {
            let entry = entry.strip_suffix('`')?;
            match survivor(entry) {
                Some(survivor) => missing(&root, &survivor),
                None => Some(format!("no entry: {entry}")),
            }
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(entries.iter().all(|entry| entry.ends_with('`')), "an entry is one line");
}
