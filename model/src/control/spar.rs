//! The controller that levels the camera spar: the LQR law of ch. 7 in the vehicle's units.

use super::LawOutput;
use super::spar_law::SparLaw;
use crate::bounded::Bounded;
use crate::vehicle::{SparScales, Vehicle};

/// State of the spar, SI. Angles as in ch. 7: the spar's from the vertical and the ballast's relative to the
/// spar, both in the sense of phi (lower end forward positive).
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

/// The terms of the spar law (Eq. 7.19), V at the ballast motor; their sum is the voltage before its limit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[allow(clippy::struct_field_names)] // Every field is a voltage.
pub struct SparTerms {
    /// -g1 times the spar's angle.
    pub spar_v: f32,
    /// -g2 times the ballast's angle.
    pub ballast_v: f32,
    /// -g3 times the spar's rate.
    pub spar_rate_v: f32,
    /// -g4 times the ballast's rate.
    pub ballast_rate_v: f32,
}

impl SparTerms {
    /// Their sum: the voltage before its limit, V.
    pub fn sum_v(&self) -> f32 {
        self.spar_v + self.ballast_v + self.spar_rate_v + self.ballast_rate_v
    }
}

/// The spar's controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparController {
    law: SparLaw<f32>,
    scales: SparScales<f32>,
    voltage_max_v: f32,
}

impl SparController {
    /// The controller for `vehicle`, with its gains; `None` if the vehicle has no spar. A spar that is not
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

    /// One tick: the ballast motor's voltage within its own and the supply's limit, and its terms.
    pub fn step(&self, state: &SparState, supply_v: f32) -> LawOutput<SparTerms> {
        let terms = self.law.terms(
            state.spar_rad,
            state.ballast_rad,
            self.scales.rate_from_si(state.spar_rate_rad_s),
            self.scales.rate_from_si(state.ballast_rate_rad_s),
        );
        let limit = self.voltage_max_v.bounded(0.0, supply_v);
        let [spar_v, ballast_v, spar_rate_v, ballast_rate_v] = terms.map(|term| self.scales.voltage_to_si(term));
        LawOutput {
            voltage_v: self.scales.voltage_to_si(SparLaw::sum(terms)).bounded(-limit, limit),
            terms: SparTerms {
                spar_v,
                ballast_v,
                spar_rate_v,
                ballast_rate_v,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::vehicle::test_vehicle::reference;

    proptest! {
        #[test]
        fn the_terms_sum_to_the_voltage_before_its_limit(
            spar_rad in -1.0_f32..1.0, ballast_rad in -3.0_f32..3.0, spar_rate_rad_s in -5.0_f32..5.0,
            ballast_rate_rad_s in -20.0_f32..20.0,
        ) {
            let mut controller = SparController::new(&reference()).expect("the reference vehicle has a spar");
            let state = SparState { spar_rad, ballast_rad, spar_rate_rad_s, ballast_rate_rad_s };
            let bound = controller.step(&state, 20.0);
            controller.voltage_max_v = 1e6;
            let free = controller.step(&state, 1e6);
            prop_assert_eq!(bound.terms, free.terms, "the limit changes no term");
            prop_assert_eq!(bound.voltage_v, free.voltage_v.bounded(-20.0, 20.0));
            let t = free.terms;
            let size = t.spar_v.abs() + t.ballast_v.abs() + t.spar_rate_v.abs() + t.ballast_rate_v.abs();
            prop_assert!((t.sum_v() - free.voltage_v).abs() <= 1e-5 * (1.0 + size), "{t:?} {}", free.voltage_v);
        }
    }
}
