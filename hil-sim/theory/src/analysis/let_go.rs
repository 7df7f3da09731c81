//! The whirl of a vehicle that is released on a slope with its arm hanging, as after open bridges.

use model::dynamics::planar::PlanarParameters;

use super::equilibrium::static_phi;
use super::input::Input;
use super::response::{Fate, Judge};
use super::step_budget::{OutOfSteps, StepBudget};

/// Integration tolerance, sufficient for a limit in hundredths of a degree.
const SLOPE_TOLERANCE: f64 = 1e-9;
/// Halvings of the slopes between the level and the static limit.
const HALVINGS: u32 = 24;

/// The steepest slope, rad, on which a step to the hold voltage raises the hanging arm to its equilibrium. On a steeper
/// slope the arm overshoots its saddle and turns over, although the vehicle could stand there. `level` is the vehicle on
/// the level.
///
/// # Errors
/// [`OutOfSteps`]: the responses take too long to follow.
pub fn steepest_let_go(level: &PlanarParameters<f64>) -> Result<f64, OutOfSteps> {
    let budget = StepBudget::default();
    let [mut returns, mut fails] = [0.0, (level.alpha * level.l).min(1.0).asin()];
    for _ in 0..HALVINGS {
        let beta = 0.5 * (returns + fails);
        if comes_to_rest(level, beta, &budget)? {
            returns = beta;
        } else {
            fails = beta;
        }
    }
    Ok(returns)
}

/// Whether an arm that is released hanging on the slope `beta` comes to rest at its equilibrium.
fn comes_to_rest(level: &PlanarParameters<f64>, beta: f64, budget: &StepBudget) -> Result<bool, OutOfSteps> {
    let p = PlanarParameters { beta, ..*level };
    let hold = Input::voltage_step(&p, beta.sin());
    let Some(judge) = static_phi(&p).and_then(|_| Judge::new(&p, &hold)) else {
        return Ok(false);
    };
    let response = judge.judge(&hold, [0.0; 3], SLOPE_TOLERANCE, budget)?;
    Ok(response.fate == Fate::Returns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::dynamics::planar::Planar;

    /// Whether the arm turns over within 200 time units, by fixed steps.
    fn turns_over(p: &PlanarParameters<f64>) -> bool {
        let planar = Planar::new(*p);
        let u = p.beta.sin();
        let rate = |x: &[f64; 4]| {
            let [theta, phi] = planar.accelerations(x, u);
            [x[2], x[3], theta, phi]
        };
        let h = 1e-3;
        let mut x = [0.0; 4];
        for _ in 0..200_000 {
            let moved = |x: &[f64; 4], k: &[f64; 4], h: f64| -> [f64; 4] { std::array::from_fn(|i| x[i] + h * k[i]) };
            let k1 = rate(&x);
            let k2 = rate(&moved(&x, &k1, 0.5 * h));
            let k3 = rate(&moved(&x, &k2, 0.5 * h));
            let k4 = rate(&moved(&x, &k3, h));
            x = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
            if x[1].abs() > std::f64::consts::PI {
                return true;
            }
        }
        false
    }

    /// Compared with fixed-step integration on either side of the result, for vehicles with little and with much
    /// damping.
    #[test]
    fn on_either_side_of_the_slope_the_arm_ends_as_told() {
        let thesis = PlanarParameters::<f64>::thesis();
        for zeta in [8.0, 2.2, 0.9] {
            let level = PlanarParameters { zeta, ..thesis };
            let found = steepest_let_go(&level).expect("found");
            for (beta, over) in [(found - 1e-3, false), (found + 1e-3, true)] {
                assert_eq!(
                    turns_over(&PlanarParameters { beta, ..level }),
                    over,
                    "{zeta} {found} {beta}"
                );
            }
            // The limit is below the static limit because the arm swings beyond the equilibrium.
            assert!(found < (0.72_f64).asin() && found > 0.0, "{found}");
        }
    }
}
