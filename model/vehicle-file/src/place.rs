//! Place of a field in a TOML text, for error messages.

use core::fmt;
use core::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A place in a text. Both numbers count from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TextPlace {
    /// The line.
    pub line: usize,
    /// The character in the line.
    pub column: usize,
}

impl fmt::Display for TextPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}, column {}", self.line, self.column)
    }
}

impl TextPlace {
    /// The place of the byte `offset` of `text`.
    pub fn of(text: &str, offset: usize) -> Self {
        let end = (0..=offset.min(text.len()))
            .rev()
            .find(|end| text.is_char_boundary(*end))
            .unwrap_or(0);
        let before = &text[..end];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        Self {
            line: 1 + before.matches('\n').count(),
            column: 1 + before[line_start..].chars().count(),
        }
    }

    /// The place in a TOML text of the field that `path` names: `body.wheel_radius_m`, `step[2].at_s`.
    /// For a missing field, the start of its table; `None` if the text lacks the table too.
    pub fn find(text: &str, path: &str) -> Option<Self> {
        let root = DeTable::parse(text).ok()?;
        let mut span = None;
        let mut at = TomlNode::Table(root.get_ref());
        for part in parts(path) {
            let next = match (at, part) {
                (TomlNode::Table(table), PathPart::Name(name)) => {
                    table
                        .iter()
                        .find(|(key, _)| key.get_ref().as_ref() == name)
                        .map(|(key, value)| {
                            // A table's place is its header, a value's place is the value.
                            let entries = value.get_ref().as_array();
                            let is_table = value.get_ref().is_table()
                                || entries.is_some_and(|list| list.iter().any(|entry| entry.get_ref().is_table()));
                            (if is_table { key.span() } else { value.span() }, value)
                        })
                }
                (TomlNode::Value(value), PathPart::Index(index)) => {
                    let entry = value.as_array().and_then(|list| list.get(index));
                    entry.map(|entry| (entry.span(), entry))
                }
                _ => None,
            };
            let Some((found, value)) = next else { break };
            span = Some(found);
            at = match value.get_ref() {
                DeValue::Table(table) => TomlNode::Table(table),
                other => TomlNode::Value(other),
            };
        }
        span.map(|span| Self::of(text, span.start))
    }
}

/// A table or a value of a document.
#[derive(Clone, Copy)]
enum TomlNode<'a> {
    Table(&'a DeTable<'a>),
    Value(&'a DeValue<'a>),
}

/// A part of a path.
enum PathPart<'a> {
    Name(&'a str),
    Index(usize),
}

fn parts(path: &str) -> impl Iterator<Item = PathPart<'_>> {
    path.split('.').flat_map(|part| {
        let (name, rest) = part.split_once('[').unwrap_or((part, ""));
        let indices = rest
            .split('[')
            .filter_map(|index| index.trim_end_matches(']').parse().ok().map(PathPart::Index));
        core::iter::once(PathPart::Name(name)).chain(indices)
    })
}

/// The path of the innermost key or value that contains the byte `offset` of a document; empty if none
/// does.
pub fn path_at(root: &DeTable<'_>, offset: usize) -> String {
    let mut best: (String, usize) = (String::new(), usize::MAX);
    let mut look = |path: &str, span: Range<usize>| {
        if span.start <= offset && offset < span.end.max(span.start + 1) && span.len() <= best.1 {
            best = (path.to_owned(), span.len());
        }
    };
    walk_table(root, "", &mut look);
    best.0
}

fn walk_table(table: &DeTable<'_>, path: &str, look: &mut dyn FnMut(&str, Range<usize>)) {
    for (key, value) in table {
        let name = key.get_ref();
        let path = if path.is_empty() {
            name.to_string()
        } else {
            format!("{path}.{name}")
        };
        look(&path, key.span());
        walk(value, &path, look);
    }
}

fn walk(value: &Spanned<DeValue<'_>>, path: &str, look: &mut dyn FnMut(&str, Range<usize>)) {
    look(path, value.span());
    match value.get_ref() {
        DeValue::Table(table) => walk_table(table, path, look),
        DeValue::Array(list) => {
            for (index, entry) in list.iter().enumerate() {
                walk(entry, &format!("{path}[{index}]"), look);
            }
        }
        _ => {}
    }
}

/// The TOML reader's message about a text that is not TOML, with the place.
pub fn syntax_error(text: &str, error: &toml::de::Error) -> String {
    let reason = error.message().trim().replace('\n', "; ");
    match error.span() {
        Some(span) => format!("not valid TOML: {reason} ({})", TextPlace::of(text, span.start)),
        None => format!("not valid TOML: {reason}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "title = \"ü\"\n[a]\nb = 3\nc.d = 4\n\n[[s]]\nx = 1\n[[s]]\ny = [5, 6]\n";

    #[test]
    fn a_path_is_found_where_it_stands_and_what_is_missing_at_its_table() {
        for (path, place) in [
            ("title", Some((1, 9))),
            ("a.b", Some((3, 5))),
            ("a.c.d", Some((4, 7))),
            ("a.missing", Some((2, 2))),
            ("s[0].x", Some((7, 5))),
            ("s[1].y[1]", Some((9, 9))),
            ("s[1].x", Some((8, 1))),
            ("nothing", None),
        ] {
            let found = TextPlace::find(TEXT, path).map(|place| (place.line, place.column));
            assert_eq!(found, place, "{path}");
        }
        assert_eq!(TextPlace::find("[", "a"), None);
    }

    #[test]
    fn the_innermost_path_at_an_offset_is_found_again() {
        let root = DeTable::parse(TEXT).expect("TOML");
        for path in ["title", "a.b", "a.c.d", "s[0].x", "s[1].y[1]"] {
            let place = TextPlace::find(TEXT, path).expect("there");
            let line_start: usize = TEXT.lines().take(place.line - 1).map(|line| line.len() + 1).sum();
            // Only the first line has a two-byte letter, after the place.
            assert_eq!(path_at(root.get_ref(), line_start + place.column - 1), path);
        }
    }

    #[test]
    fn columns_are_characters_and_no_offset_is_out_of_the_text() {
        let text = "ä = 1\nb";
        assert_eq!(TextPlace::of(text, 6), TextPlace { line: 1, column: 6 });
        assert_eq!(TextPlace::of(text, 1), TextPlace { line: 1, column: 1 });
        assert_eq!(TextPlace::of(text, 99), TextPlace { line: 2, column: 2 });
    }
}
