//! Parses a scenario's text into its tables and steps, and reports errors in the words of the file.

use model::vehicle::VehicleParameters;
use plant::settings::{BoardSettings, DriveSettings, ImuSettings, Setting};
use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};
use vehicle_file::place::{TextPlace, path_at, syntax_error};

use super::error::ScenarioError;
use super::nearest::nearest;
use super::sensor::FORMER_NAMES;
use super::step::{NoStep, Step};
use super::tables::ScenarioFile;

/// Parses the tables and the steps of a scenario's text.
///
/// # Errors
/// The first part that is not TOML, is missing, is unknown or is of the wrong kind.
pub(super) fn read(file: &str, text: &str) -> Result<(ScenarioFile, Vec<Step>), ScenarioError> {
    let syntax = |reason: String| ScenarioError::Syntax {
        file: file.to_owned(),
        reason,
    };
    let root = DeTable::parse(text).map_err(|error| syntax(syntax_error(text, &error)))?;
    let has = |name: &str| root.get_ref().keys().any(|key| key.get_ref().as_ref() == name);
    if has("body") || has("planar") {
        return Err(ScenarioError::Vehicle { file: file.to_owned() });
    }
    if root.get_ref().is_empty() {
        return Err(syntax(
            "it says nothing: a scenario has at least title and duration_s".to_owned(),
        ));
    }
    let told = ReadText {
        file,
        text,
        root: root.get_ref(),
    };
    let steps = told.steps()?;
    let tables =
        ScenarioFile::deserialize(Deserializer::from(root.clone())).map_err(|error| told.refusal(&error, ""))?;
    Ok((tables, steps))
}

/// A text with its name and its tables, for messages about it.
struct ReadText<'a> {
    file: &'a str,
    text: &'a str,
    root: &'a DeTable<'a>,
}

impl ReadText<'_> {
    fn error(&self, reason: String, place: Option<TextPlace>) -> ScenarioError {
        let file = self.file.to_owned();
        ScenarioError::Syntax { file, reason }.at(place)
    }

    fn steps(&self) -> Result<Vec<Step>, ScenarioError> {
        let Some((key, steps)) = self.root.iter().find(|(key, _)| key.get_ref().as_ref() == "step") else {
            return Ok(Vec::new());
        };
        let no_list = || {
            let place = TextPlace::of(self.text, key.span().start);
            self.error(
                "step: steps are a list: each begins with [[step]]".to_owned(),
                Some(place),
            )
        };
        let DeValue::Array(list) = steps.get_ref() else {
            return Err(no_list());
        };
        let mut read = Vec::new();
        for (index, step) in list.iter().enumerate() {
            let DeValue::Table(table) = step.get_ref() else {
                return Err(no_list());
            };
            let path = format!("step[{index}]");
            let step = Step::read(Spanned::new(step.span(), table.clone())).map_err(|wrong| match wrong {
                NoStep::Field { name, value, allowed } => {
                    let path = format!("{path}.{name}");
                    let place = TextPlace::find(self.text, &path);
                    let value = value.map_or_else(String::new, |value| format!(" = {value}"));
                    self.error(format!("{path}{value}: {allowed}"), place)
                }
                NoStep::Reader(error) => self.refusal(&error, &path),
            })?;
            read.push(step);
        }
        Ok(read)
    }

    /// The parser's error in the words of the file; `table` is the table that it was reading, if known.
    fn refusal(&self, error: &toml::de::Error, table: &str) -> ScenarioError {
        let message = error.message().trim();
        let span = error.span().filter(|span| span.start < span.end);
        let path = span
            .as_ref()
            .map_or_else(String::new, |span| path_at(self.root, span.start));
        let path = if path.is_empty() { table.to_owned() } else { path };
        let of = |name: &str| {
            if path.is_empty() {
                name.to_owned()
            } else {
                format!("{path}.{name}")
            }
        };
        if let Some(name) = between(message, "missing field `", "`") {
            let path = of(name);
            let reason = format!("{path} is missing: allowed is {}", allowed(&path, "a value"));
            return self.error(reason, TextPlace::find(self.text, &path));
        }
        let place = span.as_ref().map(|span| TextPlace::of(self.text, span.start));
        let place = place.or_else(|| TextPlace::find(self.text, &path));
        let reason = if let Some((name, known)) = unknown_name(message) {
            let parent = path.rsplit_once('.').map_or("", |(parent, _)| parent);
            let near = nearest(name, &known);
            let inside = if parent.is_empty() {
                String::new()
            } else {
                format!("{parent}: ")
            };
            format!(
                "{inside}unknown name `{name}`{near}: allowed here is {}",
                known.join(", ")
            )
        } else if let Some(name) = between(message, "unknown variant `", "`") {
            let mut known = names(message);
            known.retain(|name| !FORMER_NAMES.contains(name));
            format!(
                "{path} = {name:?} is unknown{}: allowed is {}",
                nearest(name, &known),
                known.join(", ")
            )
        } else if let Some((_, expected)) = message.split_once(", expected ") {
            let found = span.and_then(|span| self.text.get(span)).map_or("", str::trim);
            let found = found.lines().next().unwrap_or_default();
            format!("{path} = {found}: allowed is {}", allowed(&path, expected))
        } else {
            format!("{path}: {message}")
        };
        self.error(reason, place)
    }
}

/// The text between two parts of a text.
fn between<'t>(text: &'t str, before: &str, after: &str) -> Option<&'t str> {
    let (_, rest) = text.split_once(before)?;
    Some(rest.split_once(after)?.0)
}

/// A name that the parser does not know, and the names that it knows.
fn unknown_name(message: &str) -> Option<(&str, Vec<&str>)> {
    if let Some(name) = between(message, "unknown field `", "`") {
        return Some((name, names(message)));
    }
    let (unknown, known) = message
        .strip_prefix("unexpected keys in table: ")?
        .split_once(", available keys: ")?;
    Some((unknown.split(", ").next()?, known.split(", ").collect()))
}

/// The names that the parser lists as expected.
fn names(message: &str) -> Vec<&str> {
    let listed = message.split_once("expected").map_or("", |(_, listed)| listed);
    listed.split('`').skip(1).step_by(2).collect()
}

/// The allowed value at `path`, where the parser expected `expected`.
fn allowed(path: &str, expected: &str) -> String {
    let last = path.rsplit_once('.').map_or(path, |(_, last)| last);
    match path {
        "title" => return "a text of one line".to_owned(),
        "duration_s" => return "0.1 to 3600".to_owned(),
        "seed" => return "a whole number from 0".to_owned(),
        _ => {}
    }
    if let Some(field) = path.strip_prefix("plant.vehicle.") {
        let field = VehicleParameters::<f64>::TABLES
            .iter()
            .flat_map(|table| table.fields.iter().map(move |known| (table.name, known)))
            .find(|(table, known)| field.split_once('.') == Some((table, known.name)));
        if let Some((_, known)) = field {
            return format!("{} to {}", known.min, known.max);
        }
    } else if path.starts_with("plant.") {
        let settings: [&[Setting]; 3] = [DriveSettings::FIELDS, ImuSettings::FIELDS, BoardSettings::FIELDS];
        if let Some(known) = settings.concat().iter().find(|known| known.name == last) {
            return format!("{} to {}", known.min, known.max);
        }
    }
    match expected {
        "f64" | "a floating point number" => "a number",
        "u32" | "u64" => "a whole number from 0",
        "a boolean" => "true or false",
        "a string" | "path string" | "a borrowed string" => "a text in quotes",
        "a sequence" => "a list in brackets",
        "a map" => "a table",
        other if other.starts_with("struct ") || other.starts_with("enum ") => "a table",
        other => other,
    }
    .to_owned()
}
