//! The camera platform's controller: the LQR law of ch. 7 in the vehicle's units.

use super::camera_law::CameraLaw;
use crate::limit::Limit;
use crate::vehicle::{CameraScales, Vehicle};

/// State of the platform, SI. Angles as in ch. 7: the spar's from the vertical and the ballast's
/// relative to the spar, both in the sense of phi (lower end forward positive).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraState {
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
pub struct CameraController {
    law: CameraLaw<f32>,
    scales: CameraScales<f32>,
    voltage_max_v: f32,
}

impl CameraController {
    /// The controller for `vehicle`, with its gains; `None` if it has no camera spar. One that is not
    /// levelled gets no voltage.
    pub fn new(vehicle: &Vehicle<f32>) -> Option<Self> {
        Some(Self {
            law: CameraLaw {
                gains: vehicle.camera_gains().unwrap_or_default(),
            },
            scales: vehicle.camera_scales()?,
            voltage_max_v: vehicle.parameters().control.camera_voltage_max_v,
        })
    }

    /// One tick: the camera motor's voltage, V, within the camera's and the supply's limit.
    pub fn step(&self, state: &CameraState, supply_v: f32) -> f32 {
        let v = self.law.voltage(
            state.spar_rad,
            state.ballast_rad,
            self.scales.rate_from_si(state.spar_rate_rad_s),
            self.scales.rate_from_si(state.ballast_rate_rad_s),
        );
        let limit = self.voltage_max_v.limit(0.0, supply_v);
        self.scales.voltage_to_si(v).limit(-limit, limit)
    }
}
