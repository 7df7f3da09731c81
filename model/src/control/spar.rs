//! The camera platform's controller: the LQR law of ch. 7 in the vehicle's units.

use super::spar_law::SparLaw;
use crate::bounded::Bounded;
use crate::vehicle::{SparScales, Vehicle};

/// State of the platform, SI. Angles as in ch. 7: the spar's from the vertical and the ballast's
/// relative to the spar, both in the sense of phi (lower end forward positive).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SparState {
    /// Spar angle, rad.
    pub spar_rad: f32,
    /// Ballast angle relative to the spar, rad.
    pub ballast_rad: f32,
    /// Spar rate, rad/s.
    pub spar_rate_rad_s: f32,
    /// Ballast rate relative to the spar, rad/s.
    pub ballast_rate_rad_s: f32,
}

/// The platform's controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparController {
    law: SparLaw<f32>,
    scales: SparScales<f32>,
    voltage_max_v: f32,
}

impl SparController {
    /// The controller for `vehicle`, with its gains; `None` if it has no camera spar. One that is not
    /// levelled gets no voltage.
    pub fn new(vehicle: &Vehicle<f32>) -> Option<Self> {
        Some(Self {
            law: SparLaw {
                gains: vehicle.spar_gains().unwrap_or_default(),
            },
            scales: vehicle.spar_scales()?,
            voltage_max_v: vehicle.parameters().control.ballast_voltage_max_v,
        })
    }

    /// One tick: the camera motor's voltage, V, within the camera's and the supply's limit.
    pub fn step(&self, state: &SparState, supply_v: f32) -> f32 {
        let v = self.law.voltage(
            state.spar_rad,
            state.ballast_rad,
            self.scales.rate_from_si(state.spar_rate_rad_s),
            self.scales.rate_from_si(state.ballast_rate_rad_s),
        );
        let limit = self.voltage_max_v.bounded(0.0, supply_v);
        self.scales.voltage_to_si(v).bounded(-limit, limit)
    }
}
