//! Inputs with jumps: a first jump, a ramp, a last jump. Chapter 5 rates continuous waveforms only. Inputs
//! with jumps show that the ramp is not the best of all inputs (erratum E19).

use model::dynamics::planar::{Planar, PlanarParameters};

use super::dop853::integrate;
use super::equilibrium::static_phi;
use super::input::Input;
use super::response::{Fate, Judge};
use super::step_budget::StepBudget;

/// The shares of the move that are jumps at the start and at the end; a ramp covers the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jumps {
    /// Share of the jump at t = 0.
    pub first: f64,
    /// Share of the jump at t = T.
    pub last: f64,
}

/// The largest final voltage up to `highest` below which every response from rest returns, to 1e-9;
/// `None` without an equilibrium, or if every response up to `highest` returns.
pub fn critical_voltage(p: &PlanarParameters<f64>, jumps: Jumps, ramp_time: f64, highest: f64) -> Option<f64> {
    let phi = static_phi(p)?;
    let hold = p.beta.sin();
    let planar = Planar::new(*p);
    let judge = Judge::new(p, &Input::voltage_step(p, hold))?;
    let budget = StepBudget::default();
    let returns = |u: f64| {
        let voltage = |t: f64| {
            let share = jumps.first + (1.0 - jumps.first - jumps.last) * (t / ramp_time).min(1.0);
            hold + (u - hold) * share
        };
        let start = [0.0, phi, 0.0, 0.0];
        let Ok(x) = integrate(|t, x| planar.rate(x, voltage(t)), 0.0, start, ramp_time, 1e-11) else {
            return false;
        };
        // Within the well of the start or, on the way back, not yet beyond its far edge.
        let inside = x[1] < std::f64::consts::PI - phi && x[1] > -std::f64::consts::PI - phi;
        inside
            && judge
                .judge(&Input::voltage_step(p, u), [x[1], x[2], x[3]], 1e-11, &budget)
                .is_ok_and(|response| response.fate == Fate::Returns)
    };
    let step = 0.02;
    let count = ((highest - hold) / step) as i32;
    let first = (1..=count).find(|k| !returns(hold + step * f64::from(*k)))?;
    let mut high = hold + step * f64::from(first);
    let mut low = high - step;
    while high - low > 1e-9 {
        let middle = 0.5 * (low + high);
        *(if returns(middle) { &mut low } else { &mut high }) = middle;
    }
    Some(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(first: f64, last: f64, ramp_time: f64) -> f64 {
        critical_voltage(&PlanarParameters::thesis(), Jumps { first, last }, ramp_time, 16.0).unwrap()
    }

    /// Erratum E19.
    #[test]
    fn jumps_beat_the_ramp() {
        assert!((of(0.0, 0.0, 5.0) - 9.442547).abs() < 1e-6);
        assert!((of(0.5, 0.5, 1.0) - 5.881).abs() < 5e-4 && (of(0.0, 0.0, 1.0) - 5.508).abs() < 5e-4);
        assert!((of(0.06, 0.36, 5.0) - 13.095).abs() < 5e-4);
        assert!(of(0.5, 0.5, 3.0) > of(0.0, 0.0, 3.0) && of(0.5, 0.5, 5.0) < of(0.0, 0.0, 5.0));
    }
}
