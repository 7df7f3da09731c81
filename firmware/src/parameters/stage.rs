//! The set in force and the staged changes: a transaction.
//!
//! Changes are staged one by one and come into force together, or not at all: a refused change or a refused store drops
//! every staged change. A change that a host considers refused therefore never comes into force with a later change.

use model::vehicle::{NotSet, Vehicle, VehicleParameters};

use super::numbered::{drivable, number_of, schema};
use crate::protocol::message::ParameterAnswer;

/// The set in force, and the staged set where it differs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stage {
    in_force: Vehicle<f32>,
    staged: Option<VehicleParameters<f32>>,
}

impl Stage {
    /// Nothing staged.
    pub(super) fn new(in_force: &Vehicle<f32>) -> Self {
        Self {
            in_force: *in_force,
            staged: None,
        }
    }

    /// Whether there are staged changes.
    pub(super) fn has_changes(&self) -> bool {
        self.staged.is_some()
    }

    /// Drops every staged change.
    pub(super) fn discard(&mut self) {
        self.staged = None;
    }

    /// Stages a whole set.
    pub(super) fn stage(&mut self, parameters: &VehicleParameters<f32>) {
        self.staged = Some(*parameters);
    }

    /// One value of the set in force.
    pub(super) fn read(&self, number: u16) -> ParameterAnswer {
        answer(self.in_force.parameters(), number)
    }

    /// One value of the staged set, which is the set in force where nothing is staged.
    pub(super) fn read_staged(&self, number: u16) -> ParameterAnswer {
        answer(&self.staged(), number)
    }

    /// Stages one change; a refusal drops every staged change.
    pub(super) fn write(&mut self, number: u16, value: f32) -> ParameterAnswer {
        let mut staged = self.staged();
        match staged.set(number, value) {
            Ok(()) => {
                self.staged = Some(staged);
                answer(&staged, number)
            }
            Err(refused) => {
                self.discard();
                match refused {
                    NotSet::NoSuchNumber => ParameterAnswer::NoSuchNumber,
                    NotSet::OutOfRange(out) => ParameterAnswer::OutOfRange {
                        min: out.field.min as f32,
                        max: out.field.max as f32,
                    },
                }
            }
        }
    }

    /// Ends the transaction: takes the staged set, checked, which the caller stores and then puts in force.
    ///
    /// # Errors
    /// Number of the value that contradicts another.
    pub(super) fn take(&mut self) -> Result<Vehicle<f32>, u16> {
        let staged = self.staged();
        self.discard();
        drivable(&staged).map_err(|error| number_of(&staged, &error))
    }

    /// Records the set that is now in force.
    pub(super) fn put_in_force(&mut self, vehicle: &Vehicle<f32>) {
        *self = Self::new(vehicle);
    }

    fn staged(&self) -> VehicleParameters<f32> {
        self.staged.unwrap_or(*self.in_force.parameters())
    }
}

/// The answer with one value.
fn answer(parameters: &VehicleParameters<f32>, number: u16) -> ParameterAnswer {
    match parameters.value(number) {
        Some(value) => ParameterAnswer::Value {
            number,
            count: parameters.count(),
            value,
            schema: schema(parameters),
        },
        None => ParameterAnswer::NoSuchNumber,
    }
}
