//! The critical input: the smallest final value whose response leaves the basin of its start.
//!
//! A final voltage only shifts the wheel's speed error at the start (erratum E9), so the starts for all final
//! values form a curve. The critical value is the point at which that curve crosses the stable manifold of a saddle: of
//! the forward saddle, `pi - phi_0`, or, on the return swing, of the backward saddle. The search first walks
//! along the curve in steps that keep the change of the largest swing small, because values beyond a failing
//! value may return again. It then finds the crossing from the time spent near the saddle, which grows like
//! the logarithm of the distance from the manifold.

use std::cell::Cell;

use model::dynamics::planar::PlanarParameters;

use super::equilibrium::poles;
use super::input::Input;
use super::response::{Fate, Judge, PlanarPoint, Response};
use super::roots::maximum_between;
use super::step_budget::{OutOfSteps, StepBudget};

/// Direction in which the final value is searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Direction {
    /// Above the initial value: the hold voltage, or rest.
    Forward,
    /// Below the initial value.
    Reverse,
}

impl Direction {
    /// +1 or -1.
    pub fn sign(self) -> f64 {
        match self {
            Self::Forward => 1.0,
            Self::Reverse => -1.0,
        }
    }
}

/// The result of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CriticalValue {
    /// The smallest final value (in the direction searched) at which responses that return become
    /// responses that leave; the initial value if no response near it returns.
    pub value: f64,
    /// Direction in which the arm turns: +1 forward, -1 backward.
    pub whirl_direction: i8,
    /// Whether the response leaves its basin even at the initial value, e.g. because the start rolls too fast. Then
    /// the search began at the nearest final value whose response returns.
    pub hold_fails: bool,
}

/// Why the search cannot find a critical value.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoCriticalValue {
    /// (3.16) is violated.
    #[error("the slope has no static equilibrium to start from")]
    NoEquilibrium,
    /// The closed loop is unstable at its equilibrium, so there is no basin.
    #[error(
        "the loop is unstable at its equilibrium, so there is no basin to leave: its poles (see `equilibrium`) must be negative"
    )]
    Unstable,
    /// Without damping no final voltage has a steady speed.
    #[error("without damping there is no steady speed: zeta must be positive")]
    NoDamping,
    /// The responses are too slow or too stiff to be followed to their ends.
    #[error(
        "no critical value found in {steps} integration steps: responses up to {returns} return, beyond it they take too long to follow"
    )]
    TooLong {
        /// The integration steps that the search made.
        steps: u64,
        /// The farthest final value whose response returns.
        returns: f64,
    },
}

/// Tolerance of the walk's integrations.
const WALK_TOLERANCE: f64 = 1e-7;
/// Tolerance of the final integrations; the first integrations in a wide bracket need less precision.
const FINAL_TOLERANCE: f64 = 1e-12;
/// Width of the bracket at which the crossing counts as found, relative to 1 + the final value's size.
const RESOLUTION: f64 = 2e-11;
/// Distance from the manifold below which the secant of two verified ends is exact to `RESOLUTION`.
const LINEAR: f64 = 1e-6;
/// The longest step of the walk as a share of the distance walked. Slow moves fail only far from the initial value,
/// and there the failing values lie in windows a few per cent wide.
const LONGEST_STEP: f64 = 0.01;
/// The largest final value tried, as a steady speed per time unit of the move (plus one time unit).
const FARTHEST: f64 = 2000.0;

/// The critical final value from `start` (phi, theta', phi') for inputs like `input` (its target is
/// ignored); `Ok(None)` if no final value fails.
///
/// # Errors
/// [`NoCriticalValue`] if the vehicle has no basin to leave.
pub fn critical(
    p: &PlanarParameters<f64>,
    input: &Input,
    start: PlanarPoint,
    direction: Direction,
) -> Result<Option<CriticalValue>, NoCriticalValue> {
    critical_within(&StepBudget::default(), p, input, start, direction)
}

/// [`critical()`] with integration steps from `budget`.
///
/// # Errors
/// [`NoCriticalValue`], as for [`critical()`].
pub fn critical_within(
    budget: &StepBudget,
    p: &PlanarParameters<f64>,
    input: &Input,
    start: PlanarPoint,
    direction: Direction,
) -> Result<Option<CriticalValue>, NoCriticalValue> {
    let judge = Judge::new(p, input).ok_or(NoCriticalValue::NoEquilibrium)?;
    if p.zeta <= 0.0 && input.law.is_none() {
        return Err(NoCriticalValue::NoDamping);
    }
    if input.law.is_some()
        && poles(p, judge.static_phi(), input.law.as_ref())
            .iter()
            .any(|z| z[0] > 0.0)
    {
        return Err(NoCriticalValue::Unstable);
    }
    let speed = if input.law.is_some() { 1.0 } else { p.zeta };
    let search = Search {
        judge,
        input: *input,
        start,
        sign: direction.sign(),
        unit: speed,
        budget,
        returned: Cell::new(0.0),
    };
    search.run().map_err(|OutOfSteps { allowed }| NoCriticalValue::TooLong {
        steps: allowed,
        returns: search.target(search.returned.get()),
    })
}

struct Search<'a> {
    judge: Judge,
    input: Input,
    start: PlanarPoint,
    sign: f64,
    /// The change of the final value that changes the steady speed by one.
    unit: f64,
    budget: &'a StepBudget,
    /// The farthest distance from the initial value whose response is known to return.
    returned: Cell<f64>,
}

/// A final value whose response returns and a failing value beyond it, as distances from the initial value.
#[derive(Debug, Clone, Copy)]
struct Bracket {
    returns: f64,
    fails: f64,
}

impl Search<'_> {
    fn target(&self, distance: f64) -> f64 {
        self.input.initial + self.sign * distance
    }

    fn response(&self, distance: f64, tolerance: f64) -> Result<Response, OutOfSteps> {
        let input = self.input.towards(self.target(distance));
        let response = self.judge.judge(&input, self.start, tolerance, self.budget)?;
        if response.fate == Fate::Returns {
            self.returned.set(self.returned.get().max(distance));
        }
        Ok(response)
    }

    fn run(&self) -> Result<Option<CriticalValue>, OutOfSteps> {
        let Some(begin) = self.first_return()? else {
            return Ok(Some(self.found(&self.sharp(0.0, 1.0)?, 0.0, true)));
        };
        match self.walk(begin)? {
            Some(bracket) => self.refine(bracket, begin > 0.0).map(Some),
            None => Ok(None),
        }
    }

    /// The nearest final value whose response returns: the initial value, or a value whose steady speed is nearer to
    /// the speed of the start.
    fn first_return(&self) -> Result<Option<f64>, OutOfSteps> {
        let span = 10.0 + 2.0 * self.start[1].abs();
        let steps = (span / 0.1) as i32;
        for k in 0..steps {
            let distance = 0.1 * f64::from(k) * self.unit;
            if self.response(distance, WALK_TOLERANCE)?.fate == Fate::Returns {
                return Ok(Some(distance));
            }
        }
        Ok(None)
    }

    /// Walks away from the initial value, from `begin` on, until a response fails.
    fn walk(&self, begin: f64) -> Result<Option<Bracket>, OutOfSteps> {
        let walk = |d: f64| self.response(d, WALK_TOLERANCE);
        let (smallest, farthest) = (0.02 * self.unit, FARTHEST * self.unit * (1.0 + self.input.arrival()));
        // The last two accepted points: distance and excursion.
        let mut last = (begin, walk(begin)?.excursion);
        let mut before = last;
        let mut step = 0.2 * self.unit;
        while last.0 < farthest {
            let d = last.0 + step;
            let next = walk(d)?;
            let change = (next.excursion - last.1).abs();
            let fails = next.fate != Fate::Returns;
            let rough = if fails { last.1 < 0.75 } else { change > 0.12 };
            if rough && step > smallest {
                step = (0.4 * step).max(smallest);
                continue;
            }
            if fails {
                return Ok(Some(Bracket {
                    returns: last.0,
                    fails: d,
                }));
            }
            if last.1 > before.1 && last.1 > next.excursion && last.1 > 0.5 {
                // A swing that peaks between its neighbours may hide a narrow window of failures.
                if let Some(bracket) = self.window(before.0, last.0, d)? {
                    return Ok(Some(bracket));
                }
            }
            (before, last) = (last, (d, next.excursion));
            if change < 0.05 {
                step = (1.6 * step).min((LONGEST_STEP * d).max(0.2 * self.unit));
            }
        }
        Ok(None)
    }

    /// The first failing value around the peak of the swing between `a` and `c`, if there is one.
    fn window(&self, a: f64, b: f64, c: f64) -> Result<Option<Bracket>, OutOfSteps> {
        let mut failing: Option<f64> = None;
        let mut spent = Ok(());
        let swing = |d: f64| match self.response(d, WALK_TOLERANCE) {
            Ok(response) if response.fate == Fate::Returns => response.excursion,
            Ok(_) => {
                failing = Some(failing.map_or(d, |f| f.min(d)));
                f64::INFINITY
            }
            Err(error) => {
                spent = Err(error);
                0.0
            }
        };
        maximum_between(swing, a, c, 1e-6 * (1.0 + b));
        spent?;
        Ok(failing.map(|fails| Bracket { returns: a, fails }))
    }

    /// The crossing within the bracket.
    fn refine(&self, bracket: Bracket, hold_fails: bool) -> Result<CriticalValue, OutOfSteps> {
        let first = bracket.fails - bracket.returns;
        let mut low = self.sharp(bracket.returns, first)?;
        let mut high = self.sharp(bracket.fails, first)?;
        if low.fate != Fate::Returns {
            // The walk's verdict was wrong within its tolerance of the limit.
            return Ok(self.found(&low, low.distance, hold_fails));
        }
        while high.fate == Fate::Returns {
            // The failing end may be wrong in the same way, so the search checks just beyond it.
            low = high;
            high = self.sharp(low.distance + 1e-3 * self.unit, first)?;
        }
        let resolution = RESOLUTION * (1.0 + self.target(high.distance).abs());
        for k in 0..100 {
            let width = high.distance - low.distance;
            if width <= resolution {
                break;
            }
            let slope = (high.offset - low.offset) / width;
            let secant = low.distance - low.offset / slope;
            // The offsets are proportional to the distance only near the crossing: halve every fourth time.
            let inside = secant > low.distance && secant < high.distance;
            let converged = low.offset.abs().max(high.offset.abs()) < LINEAR && width < 1e2 * resolution;
            if inside && converged {
                return Ok(self.found(&high, secant, hold_fails));
            }
            let middle = low.distance + 0.5 * width;
            let probe = self.sharp(if inside && k % 4 != 3 { secant } else { middle }, width)?;
            // A second probe, as far beyond the crossing, moves the other end as well.
            let step = probe.offset / slope;
            let beyond = probe.distance - step - step.signum() * step.abs().max(0.4 * resolution);
            Self::keep(probe, &mut low, &mut high);
            if inside && beyond > low.distance && beyond < high.distance {
                Self::keep(self.sharp(beyond, width)?, &mut low, &mut high);
            }
        }
        Ok(self.found(&high, 0.5 * (low.distance + high.distance), hold_fails))
    }

    /// Tries a final value within a bracket of `width`. A secant may land `width^2` from the crossing, and
    /// the tolerance keeps the verdict right even there.
    fn sharp(&self, distance: f64, width: f64) -> Result<Point, OutOfSteps> {
        let tolerance = (1e-3 * (width / self.unit).powi(2)).clamp(FINAL_TOLERANCE, 1e-8);
        let response = self.response(distance, tolerance)?;
        let size = response.manifold_distance.unwrap_or(f64::NAN);
        let offset = if response.fate == Fate::Returns { -size } else { size };
        Ok(Point {
            distance,
            fate: response.fate,
            offset,
        })
    }

    fn keep(point: Point, low: &mut Point, high: &mut Point) {
        *(if point.fate == Fate::Returns { low } else { high }) = point;
    }

    fn found(&self, failing: &Point, distance: f64, hold_fails: bool) -> CriticalValue {
        let whirl_direction = match failing.fate {
            Fate::Leaves(way) => way,
            Fate::Returns => self.sign as i8,
        };
        CriticalValue {
            value: self.target(distance),
            whirl_direction,
            hold_fails,
        }
    }
}

/// A tried final value: its distance from the initial value, the fate of its response, and (near the crossing) its
/// signed distance from the stable manifold, NaN if the response visited no saddle.
#[derive(Debug, Clone, Copy)]
struct Point {
    distance: f64,
    fate: Fate,
    offset: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parameters with which responses take extremely long: almost no damping, stiff damping, a stiff law, a
    /// tiny arm.
    #[test]
    fn a_search_that_would_not_end_ends_and_says_how_far_it_came() {
        let thesis = PlanarParameters::thesis();
        for p in [
            PlanarParameters { zeta: 5e-324, ..thesis },
            PlanarParameters { zeta: 1e-6, ..thesis },
            PlanarParameters { zeta: 1e5, ..thesis },
            PlanarParameters { mu: 1e6, ..thesis },
        ] {
            let found = critical(&p, &Input::voltage_step(&p, 0.0), [0.1, 0.0, 0.0], Direction::Forward);
            assert!(
                matches!(found, Err(NoCriticalValue::TooLong { .. })),
                "{p:?}: {found:?}"
            );
        }
    }
}
