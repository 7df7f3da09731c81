//! The fate of a response: whether the arm returns to its initial equilibrium or turns over.
//!
//! Between the saddles `-pi - phi_0` and `pi - phi_0` (shifted by full turns) lie the wells of the
//! potential `V = -alpha l cos(phi) - sin(beta) phi`. In the frame that moves at the steady speed
//! `(U - sin(beta)) / zeta` an open loop at constant voltage U is the vehicle at the hold, and
//! `W = T + V` obeys `W' = -zeta (theta' + phi')^2` (erratum E9): once W is below the lower edge of a well, the
//! response stays in this well for ever. The verdict is therefore exact and early.

use std::f64::consts::{PI, TAU};

use model::dynamics::planar::{Planar, PlanarParameters};

use super::dop853::{Dense, Dop853};
use super::equilibrium::{saddle_growth, static_phi};
use super::input::Input;
use super::roots::root_between;
use super::step_budget::{OutOfSteps, StepBudget};

/// State of the response: phi, theta', phi' (theta is cyclic).
pub type PlanarPoint = [f64; 3];

/// How a response ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// The arm settles (at the steady speed) in the well in which it started.
    Returns,
    /// The arm leaves its well for good, or turns fully, forward (+1) or backward (-1).
    Leaves(i8),
}

/// The verdict on a response. Nondimensional, in the units of ch. 3; angles in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// How the response ends.
    pub fate: Fate,
    /// The largest swing towards a saddle: 0 at the equilibrium, 1 at the saddle.
    pub excursion: f64,
    /// `exp(-growth * the longest stay near a saddle)`: proportional to the distance of the start from
    /// the saddle's stable manifold when that is small; `None` if no saddle was visited.
    pub manifold_distance: Option<f64>,
    /// Time at which the verdict was certain.
    pub decided_at: f64,
}

/// Half width in phi of a saddle's neighbourhood. The judge measures the length of a response's stay there.
const NEIGHBOURHOOD: f64 = 0.3;
/// Largest half width as a share of the way from the equilibrium to the nearest saddle: near the static
/// limit the two lie close together, and a response at rest must lie outside the neighbourhood.
const NEIGHBOURHOOD_SHARE: f64 = 0.3;
/// Number of successively smaller swings after which a closed loop counts as returning.
const SHRINKING_SWINGS: usize = 4;
/// Deviation from the equilibrium below which a closed loop counts as returned.
const SMALL: f64 = 1e-3;
/// Integration tolerance after the deciding visit to a saddle.
const LOOSE: f64 = 1e-7;
/// Time units after the input's arrival at which an undecided response counts as returning.
const REST_PATIENCE: f64 = 3000.0;

/// The planar vehicle on its slope, with the quantities that the verdicts need.
#[derive(Debug, Clone, Copy)]
pub struct Judge {
    planar: Planar<f64>,
    phi_0: f64,
    /// Half width in phi of a saddle's neighbourhood.
    neighbourhood: f64,
    /// Growth rate at the saddle; `None` where the loop makes more than one direction unstable.
    growth: Option<f64>,
    /// Whether a speed law or a voltage limit acts: decides which proof of return applies.
    closed_loop: bool,
}

impl Judge {
    /// Prepares the verdicts for `p` under inputs like `input`; `None` where the slope has no equilibrium.
    pub fn new(p: &PlanarParameters<f64>, input: &Input) -> Option<Self> {
        let phi_0 = static_phi(p)?;
        let growth = saddle_growth(p, input.law.as_ref());
        Some(Self {
            planar: Planar::new(*p),
            phi_0,
            neighbourhood: NEIGHBOURHOOD.min(NEIGHBOURHOOD_SHARE * (PI - 2.0 * phi_0.abs())),
            growth,
            closed_loop: input.law.is_some() || input.u_max.is_finite(),
        })
    }

    /// phi of the stable equilibrium.
    pub fn static_phi(&self) -> f64 {
        self.phi_0
    }

    /// The number of the well that `phi` lies in: 0 between `-pi - phi_0` and `pi - phi_0`.
    fn well(&self, phi: f64) -> i64 {
        ((phi + self.phi_0 + PI) / TAU).floor() as i64
    }

    /// Follows `input` from `start` with the integration `tolerance` until the verdict is certain.
    ///
    /// # Errors
    /// [`OutOfSteps`] when `budget` is spent.
    pub fn judge(
        &self,
        input: &Input,
        start: PlanarPoint,
        tolerance: f64,
        budget: &StepBudget,
    ) -> Result<Response, OutOfSteps> {
        // After a visit to a saddle the response is usually far from every limit and needs less precision.
        let loose = self.follow(input, start, tolerance, tolerance.max(LOOSE), budget)?;
        let found = match loose {
            None => self.follow(input, start, tolerance, tolerance, budget)?,
            found => found,
        };
        Ok(found.unwrap_or(Response {
            fate: Fate::Returns,
            excursion: 0.0,
            manifold_distance: None,
            decided_at: 0.0,
        }))
    }

    /// Follows the response, with the tolerance `after_visit` once it has visited a saddle; `None` if a
    /// later visit came closer, so that the tolerance was loosened too early.
    fn follow(
        &self,
        input: &Input,
        start: PlanarPoint,
        tolerance: f64,
        after_visit: f64,
        budget: &StepBudget,
    ) -> Result<Option<Response>, OutOfSteps> {
        let rate = |t: f64, x: &PlanarPoint| {
            let full = [0.0, x[0], x[1], x[2]];
            let [theta_acceleration, phi_acceleration] = self.planar.accelerations(&full, input.voltage(t, &full));
            [x[2], theta_acceleration, phi_acceleration]
        };
        // Wells are counted from the well of the start.
        let mut start = start;
        start[0] -= TAU * self.well(start[0]) as f64;
        let arrival = input.arrival();
        let mut run = Dop853::new(rate, 0.0, start, tolerance);
        let mut watch = StayWatch::new(self, start[0]);
        let (mut decided, mut turns_to_see, mut visited) = (None, 0, None);
        loop {
            budget.take()?;
            let limit = if run.time() < arrival { arrival } else { f64::INFINITY };
            if run.advance(limit).is_err() {
                // Only a runaway whose state overflows makes the integration fail.
                let way = if run.state()[2] >= 0.0 { 1 } else { -1 };
                return Ok(Some(watch.verdict(Fate::Leaves(way), run.time())));
            }
            let (before, now, t) = (*run.before(), *run.state(), run.time());
            let turns = before[2] * now[2] < 0.0;
            let crosses_edge = watch.near(before[0]) != watch.near(now[0]);
            if turns || crosses_edge {
                let dense = run.dense();
                if turns {
                    watch.extreme(&dense);
                }
                if crosses_edge {
                    watch.cross_edge(&dense, before[0]);
                }
            }
            watch.swing(now[0]);
            if let Some(fate) = watch.full_turn() {
                return Ok(Some(watch.verdict(fate, t)));
            }
            if t < arrival {
                watch.swings.clear();
                continue;
            }
            let well = self.well(now[0]);
            watch.keep_well(well);
            if decided.is_none()
                && (self.stays(&watch, input, &now, run.state_rate(), well) || t > arrival + REST_PATIENCE)
            {
                decided = Some(match well {
                    0 => Fate::Returns,
                    k => Fate::Leaves(k.signum() as i8),
                });
                // An open loop still shows its forward and its backward swing; a closed loop has shown both.
                turns_to_see = watch.swings.len() + if well == 0 && !self.closed_loop { 2 } else { 0 };
            }
            // A swing or a visit to a saddle is followed to its end, because it measures the margin.
            if let Some(fate) = decided
                && watch.entered.is_none()
                && (watch.swings.len() >= turns_to_see || now[2].abs() < SMALL * SMALL)
            {
                return Ok(Some(watch.verdict(fate, t)));
            }
            match visited {
                None if watch.longest_stay > self.decisive_stay() => {
                    visited = Some(watch.longest_stay);
                    run.set_tolerance(after_visit);
                }
                Some(stay) if watch.longest_stay > stay && after_visit > tolerance => return Ok(None),
                _ => {}
            }
        }
    }

    /// Length of a stay above which the start's distance from the saddle's stable manifold is below a tenth.
    fn decisive_stay(&self) -> f64 {
        self.growth.map_or(f64::INFINITY, |growth| 2.3 / growth)
    }

    /// Whether the state can no longer leave its present well.
    fn stays(&self, watch: &StayWatch<'_>, input: &Input, x: &PlanarPoint, rate: &PlanarPoint, well: i64) -> bool {
        if self.closed_loop {
            let deviation = x[0] - self.phi_0 - TAU * well as f64;
            let at_rest = deviation.abs() < SMALL && x[2].abs() < SMALL && rate[1].abs() < SMALL;
            return at_rest || (input.u_max.is_infinite() && watch.swings_shrink());
        }
        self.energy(input, x) < self.lower_edge(well)
    }

    /// W in the frame of the steady speed.
    fn energy(&self, input: &Input, x: &PlanarPoint) -> f64 {
        let p = self.planar.parameters();
        let al = p.alpha * p.l;
        let relative = x[1] - (input.target - p.beta.sin()) / p.zeta;
        let m12 = al * (p.beta - x[0]).cos() + p.nu;
        let kinetic = 0.5 * (1.0 + p.mu + p.nu) * relative * relative
            + m12 * relative * x[2]
            + 0.5 * (al * p.l + p.nu) * x[2] * x[2];
        kinetic + self.potential(x[0])
    }

    fn potential(&self, phi: f64) -> f64 {
        let p = self.planar.parameters();
        -p.alpha * p.l * phi.cos() - p.beta.sin() * phi
    }

    fn lower_edge(&self, well: i64) -> f64 {
        let forward = PI - self.phi_0 + TAU * well as f64;
        self.potential(forward).min(self.potential(forward - TAU))
    }
}

/// The judge's memory of a response.
struct StayWatch<'a> {
    judge: &'a Judge,
    start: f64,
    highest: f64,
    lowest: f64,
    /// phi at each turning point. The start is no turning point, even where it is an extreme.
    swings: Vec<f64>,
    well: i64,
    entered: Option<f64>,
    longest_stay: f64,
}

impl<'a> StayWatch<'a> {
    fn new(judge: &'a Judge, start: f64) -> Self {
        let mut watch = Self {
            judge,
            start,
            highest: start,
            lowest: start,
            swings: Vec::new(),
            well: 0,
            entered: None,
            longest_stay: 0.0,
        };
        if watch.near(start) {
            watch.entered = Some(0.0);
        }
        watch
    }

    fn swing(&mut self, phi: f64) {
        self.highest = self.highest.max(phi);
        self.lowest = self.lowest.min(phi);
    }

    /// Whether `phi` is in the neighbourhood of a saddle.
    fn near(&self, phi: f64) -> bool {
        (phi - self.nearest_saddle(phi)).abs() < self.judge.neighbourhood
    }

    fn nearest_saddle(&self, phi: f64) -> f64 {
        let first = PI - self.judge.phi_0;
        first + TAU * ((phi - first) / TAU).round()
    }

    /// Records the extreme of phi within a step in which phi' changes sign.
    fn extreme(&mut self, dense: &Dense<3>) {
        let t = root_between(|t| dense.at(t)[2], dense.start(), dense.end(), 1e-12);
        let phi = dense.at(t)[0];
        self.swing(phi);
        self.swings.push(phi);
    }

    /// Records the time at which the response crosses the edge of a saddle's neighbourhood.
    fn cross_edge(&mut self, dense: &Dense<3>, before: f64) {
        let inside = dense.at(dense.end())[0];
        let saddle = self.nearest_saddle(if self.near(before) { before } else { inside });
        let edge = |t: f64| (dense.at(t)[0] - saddle).abs() - self.judge.neighbourhood;
        let t = root_between(edge, dense.start(), dense.end(), 1e-12);
        match self.entered.take() {
            Some(entered) => self.longest_stay = self.longest_stay.max(t - entered),
            None => self.entered = Some(t),
        }
    }

    fn full_turn(&self) -> Option<Fate> {
        if self.highest - self.start >= TAU {
            Some(Fate::Leaves(1))
        } else if self.start - self.lowest >= TAU {
            Some(Fate::Leaves(-1))
        } else {
            None
        }
    }

    /// Forgets the swings once the response is in another well.
    fn keep_well(&mut self, well: i64) {
        if well != self.well {
            self.well = well;
            self.swings.clear();
        }
    }

    /// Whether each of the last swings was smaller than the one before it.
    fn swings_shrink(&self) -> bool {
        let n = self.swings.len();
        n > SHRINKING_SWINGS && {
            let last = &self.swings[n - SHRINKING_SWINGS - 1..];
            last.windows(3)
                .all(|e| (e[2] - e[1]).abs() < 0.999 * (e[1] - e[0]).abs())
        }
    }

    fn verdict(&self, fate: Fate, decided_at: f64) -> Response {
        let phi_0 = self.judge.phi_0;
        let forward = (self.highest - phi_0) / (PI - 2.0 * phi_0);
        let backward = (phi_0 - self.lowest) / (PI + 2.0 * phi_0);
        let manifold_distance = self
            .judge
            .growth
            .filter(|_| self.longest_stay > 0.0)
            .map(|g| (-g * self.longest_stay).exp());
        Response {
            fate,
            excursion: forward.max(backward),
            manifold_distance,
            decided_at,
        }
    }
}
