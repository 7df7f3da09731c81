//! The thesis's planar vehicle at rest on its slope: what the figures of chapters 3 to 5 start from.

use model::dynamics::planar::PlanarParameters;

use super::figure::FigureError;
use crate::analysis::critical::{Direction, critical};
use crate::analysis::equilibrium::static_phi;
use crate::analysis::input::Input;
use crate::analysis::simulate::{PlanarRun, simulate};

/// Time between two points of a curve, in time units.
const SAMPLE: f64 = 0.02;

/// The thesis's vehicle on its slope of 0.0873 rad.
pub fn vehicle() -> PlanarParameters<f64> {
    PlanarParameters::thesis()
}

/// phi of the static equilibrium.
pub fn rest(p: &PlanarParameters<f64>) -> Result<f64, FigureError> {
    static_phi(p).ok_or_else(|| FigureError("no static equilibrium".into()))
}

/// A run from rest.
pub fn run(p: &PlanarParameters<f64>, input: &Input, t_end: f64) -> Result<PlanarRun, FigureError> {
    simulate(p, input, [0.0, rest(p)?, 0.0, 0.0], t_end, SAMPLE).map_err(FigureError::from_error)
}

/// The critical final value from rest, forward.
pub fn limit(p: &PlanarParameters<f64>, input: &Input) -> Result<f64, FigureError> {
    let found = critical(p, input, [rest(p)?, 0.0, 0.0], Direction::Forward).map_err(FigureError::from_error)?;
    found
        .map(|c| c.value)
        .ok_or_else(|| FigureError("no final value whirls".into()))
}
