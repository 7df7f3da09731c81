//! The controller that levels the spar: the LQR law of ch. 7 in the vehicle's units, about the ballast's planned motion.
//!
//! The law holds the spar near its level. Far from level the law would swing the ballast over, so the controller catches
//! the spar first: it keeps the ballast below the spar within a bound and moves the ballast against the spar's swing.

use super::LawOutput;
use super::ballast_plan::{BallastPlan, Pivot};
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
    /// -g2 times the ballast's angle less the planned angle; while the spar is caught, the term that holds the ballast.
    pub ballast_v: f32,
    /// -g3 times the spar's rate.
    pub spar_rate_v: f32,
    /// -g4 times the ballast's rate less the planned rate; while the spar is caught, the term that damps the ballast.
    pub ballast_rate_v: f32,
    /// The voltage for the planned motion of the ballast; while the spar is caught, the voltage that carries the
    /// ballast's weight.
    pub feed_forward_v: f32,
}

impl SparTerms {
    /// Their sum: the voltage before its limit, V.
    pub fn sum_v(&self) -> f32 {
        self.spar_v + self.ballast_v + self.spar_rate_v + self.ballast_rate_v + self.feed_forward_v
    }
}

/// Spar angle, and ballast angle relative to the spar, beyond which the controller catches the spar, rad: the law alone
/// loses a spar of 0.33 rad (erratum E31). A ballast returns by itself from somewhat beyond a quarter turn, but not from
/// further.
const CATCH_SPAR_RAD: f32 = 0.2;
const CATCH_BALLAST_RAD: f32 = 2.2;
/// Spar angle, rad, its rate in the units of ch. 7, and ballast angle, rad, within which the law takes over again.
const CAUGHT_SPAR_RAD: f32 = 0.12;
const CAUGHT_SPAR_RATE: f32 = 0.15;
const CAUGHT_BALLAST_RAD: f32 = 1.0;
/// Ballast angle per spar rate in the units of ch. 7 while the spar is caught, its bound in rad, and the poles of the
/// ballast on its way there.
const CATCH_LEAD: f32 = 4.0;
const CATCH_LEAD_MAX_RAD: f32 = 1.0;
const CATCH_POLE: f32 = 4.0;

/// The spar's controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparController {
    law: SparLaw<f32>,
    scales: SparScales<f32>,
    voltage_max_v: f32,
    plan: BallastPlan,
    /// False for a vehicle file without gains: the spar is then not levelled.
    levels: bool,
    catching: bool,
}

impl SparController {
    /// The controller for `vehicle` with the gains of its file, called every `dt_s` seconds; `None` if the vehicle has
    /// no spar. A spar that is not levelled gets no voltage.
    pub fn new(vehicle: &Vehicle<f32>, dt_s: f32) -> Option<Self> {
        let scales = vehicle.spar_scales()?;
        let gains = vehicle.spar_gains();
        Some(Self {
            law: SparLaw {
                gains: gains.unwrap_or_default(),
            },
            scales,
            voltage_max_v: vehicle.parameters().control.ballast_voltage_max_v,
            plan: BallastPlan::new(vehicle, &scales, dt_s)?,
            levels: gains.is_some(),
            catching: false,
        })
    }

    /// Restarts: the ballast's plan begins at the ballast's present angle.
    pub fn reset(&mut self, state: &SparState) {
        self.plan
            .reset(state.ballast_rad, self.scales.rate_from_si(state.ballast_rate_rad_s));
        self.catching = false;
    }

    /// One tick: returns the ballast motor's voltage, within the limits of motor and supply, and its terms. `pivot` is
    /// the motion of the axle in this tick.
    #[inline]
    pub fn step(&mut self, state: &SparState, pivot: &Pivot, supply_v: f32) -> LawOutput<SparTerms> {
        if !self.levels {
            return LawOutput::default();
        }
        let spar_rate = self.scales.rate_from_si(state.spar_rate_rad_s);
        let ballast_rate = self.scales.rate_from_si(state.ballast_rate_rad_s);
        self.catching = if self.catching {
            state.spar_rad.abs() > CAUGHT_SPAR_RAD
                || spar_rate.abs() > CAUGHT_SPAR_RATE
                || state.ballast_rad.abs() > CAUGHT_BALLAST_RAD
        } else {
            state.spar_rad.abs() > CATCH_SPAR_RAD || state.ballast_rad.abs() > CATCH_BALLAST_RAD
        };
        let (terms, feed_forward) = if self.catching {
            self.plan.reset(state.ballast_rad, ballast_rate);
            self.catch(state, spar_rate, ballast_rate)
        } else {
            let (angle_rad, rate) = (self.plan.angle_rad(), self.plan.rate());
            let feed_forward = self.plan.step(pivot);
            let ballast_rad = state.ballast_rad - angle_rad;
            (
                self.law
                    .terms(state.spar_rad, ballast_rad, spar_rate, ballast_rate - rate),
                feed_forward,
            )
        };
        let limit = self.voltage_max_v.bounded(0.0, supply_v);
        let volts = |u: f32| self.scales.voltage_to_si(u);
        let [spar_v, ballast_v, spar_rate_v, ballast_rate_v] = terms.map(volts);
        LawOutput {
            voltage_v: volts(SparLaw::sum(terms) + feed_forward).bounded(-limit, limit),
            terms: SparTerms {
                spar_v,
                ballast_v,
                spar_rate_v,
                ballast_rate_v,
                feed_forward_v: volts(feed_forward),
            },
        }
    }

    /// A servo that moves the ballast towards an angle against the spar's swing. Returns the terms in the law's order,
    /// and the weight's term.
    fn catch(&self, state: &SparState, spar_rate: f32, ballast_rate: f32) -> ([f32; 4], f32) {
        let lead_rad = (CATCH_LEAD * spar_rate).bounded(-CATCH_LEAD_MAX_RAD, CATCH_LEAD_MAX_RAD);
        let stiffness = self.plan.turned() * CATCH_POLE * CATCH_POLE;
        let damping = 2.0 * self.plan.turned() * CATCH_POLE - self.plan.back_emf();
        let held = stiffness * (lead_rad - state.ballast_rad);
        (
            [0.0, held, 0.0, -damping * ballast_rate],
            self.plan.weight(state.spar_rad + state.ballast_rad),
        )
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
            let mut controller = SparController::new(&reference(), 0.001).expect("the reference vehicle has a spar");
            let state = SparState { spar_rad, ballast_rad, spar_rate_rad_s, ballast_rate_rad_s };
            let pivot = Pivot {
                acceleration_g: 0.1, sin_slope: 0.1, cos_slope: 0.995, arm_rate_rad_s: 0.5, yaw_rate_rad_s: 1.0,
                yaw_rad_s2: 4.0, sin_roll: 0.2,
            };
            let mut unbound = controller;
            let bound = controller.step(&state, &pivot, 20.0);
            unbound.voltage_max_v = 1e6;
            let free = unbound.step(&state, &pivot, 1e6);
            prop_assert_eq!(bound.terms, free.terms, "the limit changes no term");
            prop_assert_eq!(bound.voltage_v, free.voltage_v.bounded(-20.0, 20.0));
            let t = free.terms;
            let size = t.spar_v.abs() + t.ballast_v.abs() + t.spar_rate_v.abs() + t.ballast_rate_v.abs()
                + t.feed_forward_v.abs();
            prop_assert!((t.sum_v() - free.voltage_v).abs() <= 1e-5 * (1.0 + size), "{t:?} {}", free.voltage_v);
        }
    }
}
