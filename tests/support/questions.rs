//! Questions about the parameters over the link of the virtual board.

use firmware::protocol::message::{Answer, Order, ParameterAnswer, ParameterRequest};
use model::vehicle::VehicleParameters;

use crate::support::Bench;

pub fn ask(bench: &mut Bench, request: ParameterRequest) -> ParameterAnswer {
    match bench.ask(Order::Parameters(request)) {
        Some(Answer::Parameters(answer)) => answer,
        other => panic!("{request:?}: {other:?}"),
    }
}

/// The number of a parameter, as host and board count them.
pub fn number(parameters: &VehicleParameters<f64>, table: &str, name: &str) -> u16 {
    parameters.number_of(table, name).expect("known")
}
