//! The parts of the pages of `docs/` that tests can check: commands, names, links.

use std::path::{Path, PathBuf};

use super::files::files;

/// A page of `docs/`.
pub struct Page {
    /// The page's place in `docs/`.
    pub name: String,
    pub text: String,
}

/// Every page, in order of its name.
pub fn all(root: &Path) -> Vec<Page> {
    let docs = root.join("docs");
    let mut files = files(&docs, &["md"]);
    files.sort();
    let page = |path: PathBuf| Page {
        name: path.strip_prefix(&docs).expect("in it").to_string_lossy().into_owned(),
        text: std::fs::read_to_string(&path).expect("the page is readable"),
    };
    files.into_iter().map(page).collect()
}

impl Page {
    /// The place in `docs/` of the file that a link of this page names.
    pub fn target(&self, file: &str) -> String {
        let mut place: Vec<&str> = self.name.split('/').collect();
        place.pop();
        for part in file.split('/') {
            match part {
                ".." if !place.is_empty() => drop(place.pop()),
                part => place.push(part),
            }
        }
        place.join("/")
    }

    /// The fenced blocks of one language.
    pub fn fenced(&self, language: &str) -> Vec<&str> {
        let fence = format!("```{language}\n");
        self.text
            .split(&fence)
            .skip(1)
            .filter_map(|rest| rest.split_once("```").map(|(block, _)| block))
            .collect()
    }

    /// The text without its fenced blocks.
    pub fn prose(&self) -> String {
        self.text.split("```").step_by(2).collect()
    }

    /// Inline code, with spaces in place of line breaks.
    pub fn code(&self) -> Vec<String> {
        self.prose()
            .split("\n\n")
            .flat_map(|paragraph| {
                paragraph
                    .split('`')
                    .skip(1)
                    .step_by(2)
                    .map(|code| code.split_whitespace().collect::<Vec<_>>().join(" "))
                    .collect::<Vec<_>>()
            })
            .collect()
    }

    /// Every command the page names, inline or in a block of shell lines.
    pub fn commands(&self) -> Vec<String> {
        let lines = self.fenced("sh").join("\n").replace("\\\n", " ");
        let lines = lines.lines().map(|line| line.split('#').next().unwrap_or(line).trim());
        lines
            .map(str::to_owned)
            .filter(|line| !line.is_empty())
            .chain(self.code())
            .collect()
    }

    /// The targets of every link.
    pub fn links(&self) -> Vec<String> {
        self.prose()
            .split("](")
            .skip(1)
            .filter_map(|rest| rest.split_once(')').map(|(target, _)| target.to_owned()))
            .collect()
    }

    /// The anchors of its headings.
    pub fn anchors(&self) -> Vec<String> {
        let slug = |heading: &str| -> String {
            heading
                .trim_start_matches('#')
                .trim()
                .to_lowercase()
                .chars()
                .filter_map(|c| match c {
                    ' ' => Some('-'),
                    c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
                    _ => None,
                })
                .collect()
        };
        self.prose()
            .lines()
            .filter(|line| line.starts_with('#'))
            .map(slug)
            .collect()
    }

    /// The first cells of the rows of the first table below a heading.
    pub fn first_cells(&self, heading: &str) -> Vec<String> {
        self.text
            .lines()
            .skip_while(|line| *line != heading)
            .skip_while(|line| !line.starts_with("|--"))
            .skip(1)
            .take_while(|line| line.starts_with('|'))
            .filter_map(|line| line.split('|').nth(1))
            .map(|cell| cell.trim().trim_matches('`').to_owned())
            .collect()
    }
}

/// The paths of the tests in one source file, by which `cargo test` selects: each begins with `module`.
fn tests_of(file: &Path, module: &str) -> Vec<String> {
    let text = std::fs::read_to_string(file).expect("a source");
    let mut names = Vec::new();
    let mut marked = false;
    for line in text.lines().map(str::trim) {
        marked |= line.starts_with("#[test]");
        if let Some(rest) = line.strip_prefix("fn ").filter(|_| marked) {
            let name = rest.split(['(', '<']).next().unwrap_or(rest);
            names.push(format!("{module}{name}"));
            marked = false;
        }
    }
    names
}

/// The tests of a crate whose modules stand in `folder`, with their modules.
pub fn unit_tests(folder: &Path) -> Vec<String> {
    files(folder, &["rs"])
        .iter()
        .flat_map(|file| {
            let relative = file.strip_prefix(folder).expect("below it").with_extension("");
            let parts: Vec<_> = relative
                .iter()
                .map(|part| part.to_string_lossy().into_owned())
                .collect();
            let named = parts
                .iter()
                .filter(|part| !["lib", "main", "mod"].contains(&part.as_str()));
            let modules: Vec<&str> = named.map(String::as_str).chain([""]).collect();
            tests_of(file, &modules.join("::"))
        })
        .collect()
}

/// The integration tests in `folders`, or only those of the file `only`.
pub fn integration_tests(folders: &[PathBuf], only: Option<&str>) -> Vec<String> {
    folders
        .iter()
        .filter(|folder| folder.exists())
        .flat_map(|folder| files(folder, &["rs"]))
        .filter(|file| only.is_none_or(|name| file.file_stem().is_some_and(|stem| stem == name)))
        .flat_map(|file| tests_of(&file, ""))
        .collect()
}

/// The tests that `cargo test ARGUMENTS` runs.
pub fn selected(root: &Path, arguments: &[&str]) -> Vec<String> {
    let (mut package, mut only, mut filter) = (None, None, None);
    let mut words = arguments.iter();
    while let Some(word) = words.next() {
        match *word {
            "-p" => package = words.next(),
            "--test" => only = words.next(),
            // The names say which of a package's tests are meant.
            "--release" | "--lib" => {}
            name => {
                assert!(!name.starts_with('-') && filter.is_none(), "{arguments:?}: {name}");
                filter = Some(name);
            }
        }
    }
    let packages = [
        ("model", "model"),
        ("square-root", "model/square-root"),
        ("vehicle-file", "model/vehicle-file"),
        ("firmware", "firmware"),
        ("hil-sim", "hil-sim"),
        ("plant", "hil-sim/plant"),
        ("virtual-board", "hil-sim/virtual-board"),
        ("record-file", "hil-sim/record-file"),
        ("theory", "hil-sim/theory"),
        ("report", "hil-sim/report"),
        ("vehicle-console", "hil-sim/console"),
    ];
    let mut tests = Vec::new();
    for (name, folder) in packages {
        if package.is_some_and(|package| *package != name) {
            continue;
        }
        let mut folders = vec![root.join(folder).join("tests")];
        if name == "hil-sim" {
            folders.push(root.join("tests"));
        }
        if only.is_none() {
            tests.extend(unit_tests(&root.join(folder).join("src")));
        }
        tests.extend(integration_tests(&folders, only.copied()));
    }
    tests.retain(|test| filter.is_none_or(|filter| test.contains(filter)));
    tests
}
