//! Helpers that the tests of chapters 3 to 5 share.

use model::dynamics::planar::PlanarParameters;

/// The thesis's vehicle on another slope.
pub fn thesis(beta: f64) -> PlanarParameters<f64> {
    PlanarParameters {
        beta,
        ..PlanarParameters::thesis()
    }
}

/// Fails unless `found` is `wanted` to within `within`.
#[track_caller]
pub fn close(found: f64, wanted: f64, within: f64) {
    assert!(
        (found - wanted).abs() <= within,
        "{found} is not {wanted} within {within}"
    );
}
