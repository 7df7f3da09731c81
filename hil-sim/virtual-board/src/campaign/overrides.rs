//! Values that replace values in a scenario's or a vehicle's text before the text is parsed.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::error::CampaignError;

/// The file that an override changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Target {
    /// The scenario's file.
    Scenario,
    /// The vehicle of the firmware, and also the simulated vehicle unless it has a file of its own.
    Vehicle,
    /// The simulated vehicle only.
    PlantVehicle,
}

/// One quantity of the scenario or the vehicle, and its values.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub(super) key: String,
    pub(super) target: Target,
    path: Vec<String>,
    pub(super) values: Vec<Value>,
}

impl Axis {
    /// Parses `KEY=VALUE[,VALUE...]`. A key begins with `scenario.`, `vehicle.` or `plant-vehicle.` and names a place
    /// in that file; the entries of a list are numbered from 0. A value is written as in TOML; a value that is not
    /// valid TOML counts as a text.
    ///
    /// # Errors
    /// [`CampaignError::Override`].
    pub fn parse(text: &str) -> Result<Self, CampaignError> {
        let wrong = |reason: &str| CampaignError::Override(text.to_owned(), reason.to_owned());
        let (key, values) = text
            .split_once('=')
            .ok_or_else(|| wrong("must read KEY=VALUE[,VALUE...]"))?;
        let mut parts = key.split('.');
        let target = match parts.next() {
            Some("scenario") => Target::Scenario,
            Some("vehicle") => Target::Vehicle,
            Some("plant-vehicle") => Target::PlantVehicle,
            _ => return Err(wrong("a key begins with scenario., vehicle. or plant-vehicle.")),
        };
        let path: Vec<String> = parts.map(str::to_owned).collect();
        if path.is_empty() || path.iter().any(String::is_empty) {
            return Err(wrong("the key names no field"));
        }
        let values = values.split(',').map(str::trim).map(|value| {
            format!("v = {value}")
                .parse::<Table>()
                .ok()
                .and_then(|mut table| table.remove("v"))
                .unwrap_or_else(|| Value::String(value.to_owned()))
        });
        Ok(Self {
            key: key.to_owned(),
            target,
            path,
            values: values.collect(),
        })
    }
}

/// A file's name and text.
#[derive(Debug, Clone)]
pub(super) struct OverrideSource {
    pub(super) name: String,
    pub(super) folder: PathBuf,
    pub(super) text: String,
}

impl OverrideSource {
    pub(super) fn read(path: &Path) -> Result<Self, CampaignError> {
        let name = path.display().to_string();
        let text = vehicle_file::read_text(path).map_err(|reason| CampaignError::Unreadable(name.clone(), reason))?;
        Ok(Self {
            name,
            folder: path.parent().map(Path::to_owned).unwrap_or_default(),
            text,
        })
    }

    /// The vehicle file `file` of a scenario in `folder`; the reference vehicle's if the scenario names no file.
    pub(super) fn read_own(folder: &Path, file: Option<&Path>) -> Result<Self, CampaignError> {
        match file {
            Some(file) => Self::read(&folder.join(file)),
            None => Ok(Self {
                name: vehicle_file::REFERENCE_NAME.to_owned(),
                folder: PathBuf::new(),
                text: vehicle_file::REFERENCE.to_owned(),
            }),
        }
    }

    /// The text with these overrides.
    pub(super) fn with(&self, changes: &[(&Axis, &Value)]) -> Result<String, CampaignError> {
        if changes.is_empty() {
            return Ok(self.text.clone());
        }
        // The file's own reader reports an error for a text that is not TOML.
        let Ok(root) = self.text.parse::<Table>() else {
            return Ok(self.text.clone());
        };
        let mut root = Value::Table(root);
        for (axis, value) in changes {
            let place = place(&mut root, &axis.path)
                .map_err(|reason| CampaignError::Override(axis.key.clone(), format!("{}: {reason}", self.name)))?;
            *place = (*value).clone();
        }
        match root {
            Value::Table(root) => Ok(root.to_string()),
            _ => Ok(self.text.clone()),
        }
    }
}

/// The place `path` below `at`. Missing tables are created, missing lists are not.
fn place<'a>(at: &'a mut Value, path: &[String]) -> Result<&'a mut Value, String> {
    let Some((name, rest)) = path.split_first() else {
        return Ok(at);
    };
    match at {
        Value::Table(table) => {
            let names_an_entry = rest.first().is_some_and(|next| next.parse::<usize>().is_ok());
            if names_an_entry && !table.contains_key(name) {
                return Err(format!("there is no list `{name}`"));
            }
            let next = table.entry(name.clone());
            place(next.or_insert_with(|| Value::Table(Table::new())), rest)
        }
        Value::Array(list) => place(entry(list, name)?, rest),
        _ => Err(format!("`{name}` lies in a value, not in a table")),
    }
}

fn entry<'a>(list: &'a mut [Value], name: &str) -> Result<&'a mut Value, String> {
    let count = list.len();
    name.parse::<usize>()
        .ok()
        .and_then(|index| list.get_mut(index))
        .ok_or_else(|| format!("`{name}` is not an index of this list: it has {count} entries, counted from 0"))
}
