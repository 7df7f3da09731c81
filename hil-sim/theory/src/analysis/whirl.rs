//! Sustained whirl: the limit cycle in which the arm turns over for ever.

use std::f64::consts::TAU;

use model::dynamics::planar::{PHI, PHI_RATE, Planar, PlanarParameters, THETA};

use super::dop853::{Dop853, StepTooSmall};
use super::roots::{maximum_between, root_between};

/// One turn of the cycle, averaged. Nondimensional, in the units of ch. 3; angles in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WhirlCycle {
    /// Duration of a turn.
    pub period: f64,
    /// Mean phi'.
    pub mean_phi_rate: f64,
    /// Mean theta'.
    pub mean_theta_rate: f64,
    /// The largest normal force of a turn, over `(M + m) g`.
    pub normal_max: f64,
    /// The smallest normal force of a turn; below 0 the wheel would leave the ground, and the cycle is not
    /// physical.
    pub normal_min: f64,
}

/// The most turns simulated until the cycle settles.
const MOST_TURNS: usize = 20_000;
/// Relative change of a turn's duration below which the cycle has settled.
const ROOT_SETTLED: f64 = 1e-11;
/// Pieces of a step searched for extremes of the normal force.
const FORCE_PIECES: i32 = 8;

/// The whirl of `p` under the constant voltage `u`, started with a given rate: forward on an uphill slope,
/// backward on a downhill slope. `None` if the arm settles instead.
///
/// # Errors
/// [`StepTooSmall`] if the motion cannot be followed.
pub fn whirl_cycle(p: &PlanarParameters<f64>, u: f64) -> Result<Option<WhirlCycle>, StepTooSmall> {
    let planar = Planar::new(*p);
    let way = if p.beta < 0.0 { -1.0 } else { 1.0 };
    // Fast enough to turn over from the bottom, with the mean torque of the cycle.
    let rate = 7.0 * way / p.l.sqrt();
    let start = [0.0, 0.0, (u - p.beta.sin()) / p.zeta - rate, rate];
    let mut run = Dop853::new(|_, x| planar.rate(x, u), 0.0, start, 1e-12);
    // A turn ends where the arm hangs straight down.
    let (mut turns, mut last_end, mut last_period, mut last_theta) = (0, 0.0, 0.0, 0.0);
    let mut normal = (f64::INFINITY, f64::NEG_INFINITY);
    while turns < MOST_TURNS {
        run.advance(f64::INFINITY)?;
        let dense = run.dense();
        let x = *run.state();
        if x[PHI_RATE] * way < 0.0 {
            // A sustained whirl never stops turning.
            return Ok(None);
        }
        let force = |t: f64| planar.contact_forces(&dense.at(t), u).normal;
        let at = |k: i32| dense.start() + (dense.end() - dense.start()) * f64::from(k) / f64::from(FORCE_PIECES);
        for k in 1..FORCE_PIECES {
            let (a, b, c) = (force(at(k - 1)), force(at(k)), force(at(k + 1)));
            if b >= a && b >= c {
                normal.1 = normal.1.max(maximum_between(force, at(k - 1), at(k + 1), 1e-9).1);
            }
            if b <= a && b <= c {
                normal.0 = normal
                    .0
                    .min(-maximum_between(|t| -force(t), at(k - 1), at(k + 1), 1e-9).1);
            }
            normal = (normal.0.min(b), normal.1.max(b));
        }
        let goal = way * TAU * (turns + 1) as f64;
        if (x[PHI] - goal) * way >= 0.0 {
            let t = root_between(|t| dense.at(t)[PHI] - goal, dense.start(), dense.end(), 1e-13);
            let theta = dense.at(t)[THETA];
            let (period, advance) = (t - last_end, theta - last_theta);
            if turns > 20 && (period - last_period).abs() < ROOT_SETTLED * period {
                return Ok(Some(WhirlCycle {
                    period,
                    mean_phi_rate: way * TAU / period,
                    mean_theta_rate: advance / period,
                    normal_max: normal.1,
                    normal_min: normal.0,
                }));
            }
            (last_end, last_period, last_theta) = (t, period, theta);
            normal = (f64::INFINITY, f64::NEG_INFINITY);
            turns += 1;
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cycle(beta: f64, u: f64) -> Option<WhirlCycle> {
        whirl_cycle(
            &PlanarParameters {
                beta,
                ..PlanarParameters::thesis()
            },
            u,
        )
        .unwrap()
    }

    /// Erratum E10.
    #[test]
    fn the_whirl_of_the_thesis_drifts_down_but_not_at_every_voltage() {
        let found = cycle(0.0873, 5.0345).unwrap();
        assert!((found.mean_phi_rate - 2.907243).abs() < 1e-6, "{found:?}");
        assert!((found.mean_theta_rate + 0.6585).abs() < 1e-4, "{found:?}");
        // mean theta' + mean phi' = (U - sin beta) / zeta, exactly.
        let sum = found.mean_theta_rate + found.mean_phi_rate;
        assert!((sum - (5.0345 - 0.0873_f64.sin()) / 2.2).abs() < 1e-9);
        // The cycle violates the no-bounce constraint by far.
        assert!(
            (found.normal_min + 3.1).abs() < 0.05 && (found.normal_max - 54.7).abs() < 0.05,
            "{found:?}"
        );
        // The turning rate does not depend on the voltage, so above U = 6.483 the vehicle climbs.
        let (below, above) = (cycle(0.0873, 6.482).unwrap(), cycle(0.0873, 6.484).unwrap());
        assert!((below.mean_phi_rate - above.mean_phi_rate).abs() < 1e-9);
        assert!(below.mean_theta_rate < 0.0 && above.mean_theta_rate > 0.0);
    }

    #[test]
    fn whirl_needs_a_slope() {
        // The fold of cycles, from both sides; on the level the arm settles.
        assert!(cycle(0.00449, 6.0).is_some() && cycle(0.00447, 6.0).is_none() && cycle(0.0, 6.0).is_none());
        let (up, down) = (cycle(0.2, 5.0).unwrap(), cycle(-0.2, -5.0).unwrap());
        assert!((up.mean_phi_rate + down.mean_phi_rate).abs() < 1e-9 && (up.normal_max - down.normal_max).abs() < 1e-6);
    }
}
