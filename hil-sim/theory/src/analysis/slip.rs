//! The largest step that the tyre's grip allows, and the longest pulse that the whirl limit allows (chapter 4).

use model::dynamics::planar::{Planar, PlanarParameters};

use super::critical::{Direction, NoCriticalValue, critical};
use super::dop853::{StepTooSmall, integrate};
use super::equilibrium::static_phi;
use super::input::Input;
use super::response::{Fate, Judge};
use super::roots::{maximum_between, root_between};
use super::simulate::simulate_within;
use super::step_budget::{OutOfSteps, StepBudget};

/// Time units within which a step's response makes its largest swing.
const SLIP_SPAN: f64 = 40.0;
/// Number of steps of the walk from the hold to the whirl limit.
const WALK: usize = 80;

/// The most integration steps of the responses of a search for the slip limit; the thesis's vehicle needs 73,874 at most.
const SLIP_STEPS_MAX: u64 = 500_000;

/// The limits of a forward voltage step from the static equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlipLimit {
    /// The largest step that neither slips nor lifts the wheel: at most the whirl limit, and `None` if the
    /// vehicle slides even at the hold.
    pub critical_voltage: Option<f64>,
    /// The largest step that does not whirl.
    pub whirl_voltage: f64,
    /// Whether slip comes before whirl.
    pub slips_first: bool,
    /// The friction coefficient above which whirl comes first; `None` if a step below the whirl limit
    /// lifts the wheel, so that no grip is enough.
    pub mu_s_where_whirl_comes_first: Option<f64>,
}

/// Why there is no slip limit.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoSlipLimit {
    /// No whirl limit.
    #[error(transparent)]
    NoCriticalValue(#[from] NoCriticalValue),
    /// No step whirls.
    #[error("no step whirls")]
    NeverWhirls,
    /// The motion could not be followed.
    #[error(transparent)]
    Integration(#[from] StepTooSmall),
    /// The responses are too slow or too stiff to be followed to their ends.
    #[error(transparent)]
    OutOfSteps(#[from] OutOfSteps),
}

/// The friction coefficient that the whole response to the voltage step `u` from the static equilibrium
/// needs; infinite if the response lifts the wheel.
///
/// # Errors
/// [`NoSlipLimit`] beyond the static limit, and where the steps of `budget` are spent.
fn required_within(budget: &StepBudget, p: &PlanarParameters<f64>, u: f64) -> Result<f64, NoSlipLimit> {
    let phi = static_phi(p).ok_or(NoCriticalValue::NoEquilibrium)?;
    let start = [0.0, phi, 0.0, 0.0];
    let run = simulate_within(budget, p, &Input::voltage_step(p, u), start, SLIP_SPAN, SLIP_SPAN)?;
    Ok(run.friction_coefficient_required.unwrap_or(f64::INFINITY))
}

/// The slip limit for the static friction coefficient `mu_s`.
///
/// # Errors
/// [`NoSlipLimit`].
pub fn slip_limit(p: &PlanarParameters<f64>, mu_s: f64) -> Result<SlipLimit, NoSlipLimit> {
    slip_limit_within(SLIP_STEPS_MAX, p, mu_s)
}

/// [`slip_limit`], with at most `allowed` integration steps of the responses below the whirl limit.
///
/// # Errors
/// [`NoSlipLimit`], as for [`slip_limit`].
pub fn slip_limit_within(allowed: u64, p: &PlanarParameters<f64>, mu_s: f64) -> Result<SlipLimit, NoSlipLimit> {
    let phi = static_phi(p).ok_or(NoCriticalValue::NoEquilibrium)?;
    let whirl = critical(p, &Input::voltage_step(p, 0.0), [phi, 0.0, 0.0], Direction::Forward)?
        .ok_or(NoSlipLimit::NeverWhirls)?
        .value;
    // Just inside the whirl limit, so that the last response returns.
    let (hold, end) = (p.beta.sin(), whirl - 1e-9 * (1.0 + whirl.abs()));
    let at = |k: usize| hold + (end - hold) * k as f64 / WALK as f64;
    let budget = StepBudget::of(allowed);
    let needed: Result<Vec<f64>, _> = (0..=WALK).map(|k| required_within(&budget, p, at(k))).collect();
    // A response that ended with the budget is not a response that cannot be followed.
    budget.check()?;
    let needed = needed?;
    let of_step = |u: f64| required_within(&budget, p, u).unwrap_or(f64::INFINITY);
    let worst = needed
        .iter()
        .copied()
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(0, |(k, _)| k);
    let most = if needed.iter().any(|n| n.is_infinite()) {
        f64::INFINITY
    } else {
        let (a, b) = (at(worst.saturating_sub(1)), at((worst + 1).min(WALK)));
        maximum_between(of_step, a, b, 1e-9).1.max(of_step(end))
    };
    let first = needed.iter().position(|n| *n > mu_s);
    let critical_voltage = match first {
        Some(0) => None,
        Some(k) => Some(root_between(|u| of_step(u) - mu_s, at(k - 1), at(k), 1e-12)),
        None => Some(whirl),
    };
    budget.check()?;
    Ok(SlipLimit {
        critical_voltage,
        whirl_voltage: whirl,
        slips_first: first.is_some(),
        mu_s_where_whirl_comes_first: most.is_finite().then_some(most),
    })
}

/// The longest pulse of the voltage `amplitude` (from the hold and back to the hold) from which the arm
/// returns, in time units. The end of the pulse is a step, too, and may turn the arm over backwards. `None`
/// if the arm returns from every pulse up to 40 time units.
///
/// # Errors
/// [`NoSlipLimit`].
pub fn longest_pulse(p: &PlanarParameters<f64>, amplitude: f64) -> Result<Option<f64>, NoSlipLimit> {
    let phi = static_phi(p).ok_or(NoCriticalValue::NoEquilibrium)?;
    let hold = Input::voltage_step(p, p.beta.sin());
    let judge = Judge::new(p, &hold).ok_or(NoCriticalValue::NoEquilibrium)?;
    let planar = Planar::new(*p);
    let budget = StepBudget::default();
    let start = [0.0, phi, 0.0, 0.0];
    let saddle = std::f64::consts::PI - phi;
    let returns = |duration: f64| -> Result<bool, NoSlipLimit> {
        let x = integrate(|_, x| planar.rate(x, amplitude), 0.0, start, duration, 1e-12)?;
        let within = x[1].abs() < saddle + std::f64::consts::PI;
        Ok(within && judge.judge(&hold, [x[1], x[2], x[3]], 1e-12, &budget)?.fate == Fate::Returns)
    };
    let step = 0.02;
    let mut last = 0.0;
    while last < SLIP_SPAN {
        if !returns(last + step)? {
            let (mut low, mut high) = (last, last + step);
            while high - low > 1e-11 {
                let middle = 0.5 * (low + high);
                *(if returns(middle)? { &mut low } else { &mut high }) = middle;
            }
            return Ok(Some(low));
        }
        last += step;
    }
    Ok(None)
}
