//! Parameters over the link: by name, and whole sets as vehicle files.

use std::path::Path;

use firmware::protocol::message::{ParameterAnswer, ParameterRequest};
use model::vehicle::VehicleParameters;
use report::error::CommandError;
use vehicle_file::{Difference, diff};
use virtual_board::link_client::board_kind;

use super::session::{Link, not_changed};
use super::wire::Wire;

impl<W: Wire> Link<W> {
    /// The kind of vehicle that the board's parameters describe.
    ///
    /// # Errors
    /// The board has not sent its identity, or has other parameters than this tool.
    fn kind(&self) -> Result<VehicleParameters<f32>, CommandError> {
        let schema = self
            .client
            .identity()
            .ok_or_else(|| CommandError::Checks("the board has not said who it is".into()))?
            .about
            .schema;
        board_kind(schema).ok_or_else(|| {
            CommandError::Checks(
                "the board's firmware has other parameters than this tool: build both from one tree".into(),
            )
        })
    }

    /// Whether the board's vehicle has a spar.
    pub(in crate::cli) fn has_spar(&self) -> Result<bool, CommandError> {
        Ok(self.kind()?.spar.is_some())
    }

    /// The number of a parameter.
    pub(in crate::cli) fn number_of(&self, table: &str, name: &str) -> Result<u16, CommandError> {
        self.kind()?
            .number_of(table, name)
            .ok_or_else(|| CommandError::Checks(format!("the board has no {table}.{name}")))
    }

    /// One value of the set in force.
    pub(in crate::cli) fn read(&mut self, number: u16) -> Result<f32, CommandError> {
        match self.ask(ParameterRequest::Read { number })? {
            ParameterAnswer::Value {
                number: echoed, value, ..
            } if echoed == number => Ok(value),
            other => Err(not_changed(&other)),
        }
    }

    /// Stages one change. The board must return the same number and value.
    fn write(&mut self, number: u16, value: f32) -> Result<(), CommandError> {
        match self.ask(ParameterRequest::Write { number, value })? {
            ParameterAnswer::Value {
                number: echoed,
                value: changed,
                ..
            } if echoed == number && changed.to_bits() == value.to_bits() => Ok(()),
            ParameterAnswer::Value { .. } => Err(CommandError::Checks(
                "the board echoed another number or value: nothing is stored".into(),
            )),
            other => Err(not_changed(&other)),
        }
    }

    /// Every parameter of the board's set in force.
    ///
    /// # Errors
    /// No answer, or a firmware with other parameters.
    pub fn parameters(&mut self) -> Result<VehicleParameters<f32>, CommandError> {
        let mut parameters = self.kind()?;
        for number in 0..parameters.count() {
            let value = self.read(number)?;
            parameters.set(number, value).map_err(|_| {
                CommandError::Checks(format!("the board's parameter {number} is {value}, out of range"))
            })?;
        }
        Ok(parameters)
    }

    /// Changes parameters, `table.name=value` each, and stores the set.
    ///
    /// # Errors
    /// An unknown name, a name given twice, or an invalid value (then nothing is changed), or the board refuses.
    pub fn set(&mut self, assignments: &[String]) -> Result<(), CommandError> {
        let kind = self.kind()?;
        let mut changes: Vec<(u16, f32)> = Vec::new();
        for assignment in assignments {
            let bad = |why: String| CommandError::Input(format!("{assignment}: {why}"));
            let (name, text) = assignment
                .split_once('=')
                .ok_or_else(|| bad("expected table.name=value".into()))?;
            let (number, field) = name
                .split_once('.')
                .and_then(|(table, name)| kind.number_of(table, name))
                .and_then(|number| Some((number, kind.field(number)?.1)))
                .ok_or_else(|| bad("unknown parameter; `parameters list` shows them".into()))?;
            let allowed = format!("allowed is {} to {}", field.min, field.max);
            let value: f64 = text
                .parse()
                .map_err(|_| bad(format!("`{text}` is not a number: {allowed}")))?;
            if !field.allows(value) {
                return Err(bad(allowed));
            }
            if changes.iter().any(|(other, _)| *other == number) {
                return Err(bad(format!("{name} is given twice")));
            }
            changes.push((number, value as f32));
        }
        self.change(&changes)
    }

    /// Changes every parameter that differs from `wanted`, and stores the set, even if no parameter differs, because
    /// the board may have lost its stored set. Returns the differences. `file` is the source of `wanted`, for
    /// messages.
    ///
    /// # Errors
    /// The vehicle is of another kind, or the board refuses.
    pub fn load(&mut self, file: &Path, wanted: &VehicleParameters<f32>) -> Result<Vec<Difference<f32>>, CommandError> {
        let differences = self.differences(file, wanted)?;
        let changes: Vec<(u16, f32)> = differences
            .iter()
            .filter_map(|difference| {
                let number = wanted.number_of(difference.table, difference.name)?;
                Some((number, difference.after?))
            })
            .collect();
        self.change(&changes)?;
        Ok(differences)
    }

    /// Every parameter in which the board's set in force differs from `wanted`, the set of `file`.
    ///
    /// # Errors
    /// The vehicle is of another kind, or no answer.
    pub fn differences(
        &mut self,
        file: &Path,
        wanted: &VehicleParameters<f32>,
    ) -> Result<Vec<Difference<f32>>, CommandError> {
        let kind = self.kind()?;
        if kind.spar.is_some() != wanted.spar.is_some() {
            let (board, file_has) = match kind.spar {
                Some(_) => ("has a spar", "has none"),
                None => ("has no spar", "has one"),
            };
            return Err(CommandError::Input(format!(
                "{}: the board's vehicle {board}, the file's {file_has}: that needs firmware built for the file",
                file.display()
            )));
        }
        Ok(diff(&self.parameters()?, wanted))
    }

    /// Stages only these changes, and stores the set.
    fn change(&mut self, changes: &[(u16, f32)]) -> Result<(), CommandError> {
        // Changes that an earlier host staged and abandoned must not be stored with these.
        match self.ask(ParameterRequest::Discard)? {
            ParameterAnswer::Discarded => {}
            other => return Err(not_changed(&other)),
        }
        for (number, value) in changes {
            self.write(*number, *value)?;
        }
        self.store()
    }

    /// Restores the built-in set.
    ///
    /// # Errors
    /// The board refuses.
    pub fn built_in(&mut self) -> Result<(), CommandError> {
        match self.ask(ParameterRequest::BuiltIn)? {
            ParameterAnswer::BuiltInReady => self.store(),
            other => Err(not_changed(&other)),
        }
    }

    fn store(&mut self) -> Result<(), CommandError> {
        match self.ask(ParameterRequest::Store)? {
            ParameterAnswer::Stored => Ok(()),
            other => Err(not_changed(&other)),
        }
    }
}
