//! The vehicle to which a scenario's bounds apply.

use model::vehicle::Vehicle;

/// The vehicle to which a scenario's bounds apply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BoundsOf {
    /// The bounds apply to the vehicle that drives.
    #[default]
    ThisVehicle,
    /// The bounds apply to another vehicle, so the measured metrics of this vehicle are not
    /// judged. The scenario keeps the bounds that apply to every vehicle: faults, mode, and
    /// counts.
    AnotherVehicle,
}

/// Whether two vehicles differ only in the parameters of their controllers.
pub(super) fn are_one(flown: &Vehicle<f64>, own: &Vehicle<f64>) -> bool {
    let (mut flown, own) = (*flown.parameters(), own.parameters());
    (flown.control, flown.estimator, flown.safety) = (own.control, own.estimator, own.safety);
    if let (Some((flown, _)), Some((own, _))) = (&mut flown.spar, &own.spar) {
        (flown.spar_gain, flown.ballast_gain) = (own.spar_gain, own.ballast_gain);
        (flown.spar_rate_gain, flown.ballast_rate_gain) = (own.spar_rate_gain, own.ballast_rate_gain);
    }
    flown == *own
}
