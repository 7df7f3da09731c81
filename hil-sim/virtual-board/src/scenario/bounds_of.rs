//! Whose bounds a scenario's metrics have: those of the vehicle that it was written for.

use model::vehicle::Vehicle;

/// Whose bounds a scenario has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BoundsOf {
    /// Those of the vehicle that drives.
    #[default]
    ThisVehicle,
    /// Those of another vehicle: what is measured of this one is not judged. The scenario keeps the bounds that hold of any
    /// vehicle: its faults, its mode, and what is counted.
    AnotherVehicle,
}

/// Whether two vehicles differ in nothing but what their controllers make of them.
pub(super) fn are_one(flown: &Vehicle<f64>, own: &Vehicle<f64>) -> bool {
    let (mut flown, own) = (*flown.parameters(), own.parameters());
    (flown.control, flown.estimator, flown.safety) = (own.control, own.estimator, own.safety);
    if let (Some((flown, _)), Some((own, _))) = (&mut flown.spar, &own.spar) {
        (flown.spar_gain, flown.ballast_gain) = (own.spar_gain, own.ballast_gain);
        (flown.spar_rate_gain, flown.ballast_rate_gain) = (own.spar_rate_gain, own.ballast_rate_gain);
    }
    flown == *own
}
