//! The scenarios that come with the project, by name.

use std::path::Path;

use super::error::ScenarioError;
use super::file::{DEFAULT, Scenario};

/// The shipped scenarios: name and text, in order of name.
const SHIPPED: [(&str, &str); 9] = [
    ("dead-man", include_str!("../../../../tests/scenarios/dead-man.toml")),
    (
        "emergency-stop",
        include_str!("../../../../tests/scenarios/emergency-stop.toml"),
    ),
    (
        "figure-of-eight",
        include_str!("../../../../tests/scenarios/figure-of-eight.toml"),
    ),
    ("kerb", include_str!("../../../../tests/scenarios/kerb.toml")),
    (
        "rail-inspection",
        include_str!("../../../../tests/scenarios/rail-inspection.toml"),
    ),
    (
        "side-slope",
        include_str!("../../../../tests/scenarios/side-slope.toml"),
    ),
    (
        "slippery-patch",
        include_str!("../../../../tests/scenarios/slippery-patch.toml"),
    ),
    ("slope-drive", DEFAULT),
    (
        "zero-radius-turn",
        include_str!("../../../../tests/scenarios/zero-radius-turn.toml"),
    ),
];

/// The names of the shipped scenarios, in order.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, _)| *name)
}

/// The scenario in the file at `path` or, if no such file exists, the shipped scenario of this
/// name. A folder of that name, as `--out` creates it, is no file.
///
/// # Errors
/// The first error of the scenario or, if `path` is neither a file nor a name, the list of names.
pub fn find(path: &Path) -> Result<Scenario, ScenarioError> {
    let name = path.to_str().unwrap_or_default();
    if (path.exists() && !path.is_dir()) || name.contains(['/', '\\', '.']) {
        return Scenario::read(path);
    }
    match SHIPPED.iter().find(|(shipped, _)| *shipped == name) {
        Some((name, text)) => Scenario::parse(name, text),
        None => Err(ScenarioError::Unreadable {
            file: path.display().to_string(),
            reason: format!(
                "no such file, and no shipped scenario of this name: they are {}",
                names().collect::<Vec<_>>().join(", ")
            ),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scenario_of_the_folder_is_shipped_under_its_name() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/scenarios");
        let mut files: Vec<_> = std::fs::read_dir(folder)
            .expect("the folder")
            .map(|entry| entry.expect("readable").path())
            .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
            .collect();
        files.sort();
        let stems: Vec<_> = files.iter().filter_map(|path| path.file_stem()?.to_str()).collect();
        assert_eq!(stems, names().collect::<Vec<_>>());
        for (path, name) in files.iter().zip(names()) {
            let shipped = find(Path::new(name)).expect("valid");
            assert_eq!(shipped.title, Scenario::read(path).expect("valid").title);
            // A relative path in a shipped scenario would mean another file here than in the
            // scenario's folder.
            assert_eq!(shipped.vehicle, None);
        }
    }

    #[test]
    fn a_name_that_is_none_lists_the_names_and_a_path_is_a_path() {
        let error = find(Path::new("curb")).expect_err("no scenario").to_string();
        assert!(
            error.contains("curb") && error.contains("kerb, rail-inspection"),
            "{error}"
        );
        let error = find(Path::new("./kerb")).expect_err("no file").to_string();
        assert!(!error.contains("shipped"), "{error}");
    }
}
