//! The observation of a vehicle at one instant.

use core::f64::consts::PI;

use model::status::Status;
use plant::Truth;

/// The observation of a vehicle at one instant: its status and, in a simulation, the truth.
#[derive(Debug, Clone, Copy)]
pub struct Sight<'a> {
    /// The vehicle's status.
    pub status: &'a Status,
    /// The truth; `None` for a real vehicle, where nobody knows it.
    pub truth: Option<&'a Truth>,
}

impl Sight<'_> {
    /// Time of the status, s.
    pub(super) fn time_s(&self) -> f64 {
        self.status.time_us as f64 * 1e-6
    }

    /// Whether a wheel slides; for a real vehicle, according to its own estimate.
    pub(super) fn slides(&self) -> bool {
        self.truth
            .map_or(self.status.estimate.sliding, |truth| truth.sliding != [false; 2])
    }

    /// Whether a wheel is off the ground.
    pub(super) fn flies(&self) -> bool {
        self.truth.is_some_and(|truth| truth.lifted != [false; 2])
    }

    /// Whether the arm has passed the vertical above the axle.
    pub(super) fn is_over(&self) -> bool {
        let estimated_rad = f64::from(self.status.estimate.phi_rad);
        self.truth.map_or(estimated_rad, |truth| truth.phi_rad).abs() > PI
    }
}
