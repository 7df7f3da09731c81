//! One run of the planar vehicle: sampled motion and contact forces, and their extremes between the samples.

use std::f64::consts::TAU;

use model::control::speed_law::SpeedLaw;
use model::dynamics::contact::ContactForces;
use model::dynamics::planar::{PHI, PHI_RATE, Planar, PlanarParameters, PlanarState, THETA, THETA_RATE};
use serde::Serialize;

use super::dop853::{Dense, Dop853, MOST_STEPS, StepTooSmall};
use super::input::Input;
use super::roots::{maximum_between, root_between};
use super::step_budget::StepBudget;
use super::trajectory::TOLERANCE;

/// Points at which a step's polynomial is searched for extremes.
const EXTREME_PIECES: i32 = 8;

/// A sampled run of the planar vehicle. Forces over `(M + m) g`. Nondimensional, in the units of ch. 3; angles in rad.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct PlanarRun {
    /// Times of the samples.
    pub t: Vec<f64>,
    /// Wheel angle, rad.
    pub theta: Vec<f64>,
    /// Arm angle from the vertical, rad.
    pub phi: Vec<f64>,
    /// Wheel rate, rad per time unit.
    pub theta_rate: Vec<f64>,
    /// Arm rate, rad per time unit.
    pub phi_rate: Vec<f64>,
    /// Nondimensional voltage.
    pub voltage: Vec<f64>,
    /// Friction on the wheel, positive up-slope.
    pub friction: Vec<f64>,
    /// Normal force.
    pub normal: Vec<f64>,
    /// Whether the arm made a full turn in either direction.
    pub whirled: bool,
    /// The largest phi of the run (not only of the samples).
    pub phi_max: f64,
    /// The smallest phi of the run.
    pub phi_min: f64,
    /// The largest `|F| / N` of the run; `None` (null) if the normal force was not positive
    /// throughout, as the ratio then grows without bound where N passes through 0.
    pub friction_coefficient_required: Option<f64>,
    /// Whether `N <= 0` anywhere.
    pub lifted: bool,
}

/// The extremes so far.
#[derive(Debug, Clone, Copy)]
struct Extremes {
    phi_start: f64,
    phi_max: f64,
    phi_min: f64,
    coefficient: f64,
    lifted: bool,
}

impl Extremes {
    fn new(phi: f64) -> Self {
        Self {
            phi_start: phi,
            phi_max: phi,
            phi_min: phi,
            coefficient: 0.0,
            lifted: false,
        }
    }

    fn angle(&mut self, phi: f64) {
        self.phi_max = self.phi_max.max(phi);
        self.phi_min = self.phi_min.min(phi);
    }

    fn forces(&mut self, forces: &ContactForces<f64>) {
        match forces.friction_coefficient() {
            Some(c) => self.coefficient = self.coefficient.max(c),
            None => self.lifted = true,
        }
    }

    fn finish(&self, run: &mut PlanarRun) {
        run.phi_max = self.phi_max;
        run.phi_min = self.phi_min;
        run.whirled = self.phi_max - self.phi_start >= TAU || self.phi_start - self.phi_min >= TAU;
        run.lifted = self.lifted;
        run.friction_coefficient_required = (!self.lifted).then_some(self.coefficient);
    }
}

/// Runs from `start` to `t_end`, sampled every `sample` time units.
///
/// # Errors
/// [`StepTooSmall`] if the motion cannot be followed.
pub fn simulate(
    p: &PlanarParameters<f64>,
    input: &Input,
    start: PlanarState<f64>,
    t_end: f64,
    sample: f64,
) -> Result<PlanarRun, StepTooSmall> {
    simulate_within(&StepBudget::of(MOST_STEPS), p, input, start, t_end, sample)
}

/// [`simulate()`] with integration steps from `budget`.
///
/// # Errors
/// [`StepTooSmall`], as for [`simulate()`].
pub fn simulate_within(
    budget: &StepBudget,
    p: &PlanarParameters<f64>,
    input: &Input,
    start: PlanarState<f64>,
    t_end: f64,
    sample: f64,
) -> Result<PlanarRun, StepTooSmall> {
    let planar = Planar::new(*p);
    let mut run = PlanarRun::default();
    let mut extremes = Extremes::new(start[PHI]);
    let record = |run: &mut PlanarRun, t: f64, x: &PlanarState<f64>| {
        let u = input.voltage(t, x);
        run.push(t, x, u, &planar.contact_forces(x, u));
    };
    record(&mut run, 0.0, &start);
    let u = input.voltage(0.0, &start);
    extremes.forces(&planar.contact_forces(&start, u));
    let rate = |t: f64, x: &PlanarState<f64>| planar.rate(x, input.voltage(t, x));
    let mut integration = Dop853::new(rate, 0.0, start, TOLERANCE).limited(budget.left());
    let arrival = input.arrival();
    let mut next = 1;
    while integration.time() < t_end {
        let limit = if integration.time() < arrival {
            arrival.min(t_end)
        } else {
            t_end
        };
        let advanced = integration.advance(limit);
        budget.leave(integration.steps_left());
        advanced?;
        let dense = integration.dense();
        search(&planar, input, &dense, &mut extremes);
        loop {
            let t = f64::from(next) * sample;
            if t > dense.end() + 1e-12 * t || t > t_end * (1.0 + 1e-12) {
                break;
            }
            record(&mut run, t, &dense.at(t));
            next += 1;
        }
    }
    extremes.finish(&mut run);
    Ok(run)
}

/// Finds the extremes of phi, of the friction coefficient and of the normal force within a step.
fn search(planar: &Planar<f64>, input: &Input, dense: &Dense<4>, extremes: &mut Extremes) {
    let (start, width) = (dense.start(), dense.end() - dense.start());
    let at = |k: i32| start + width * f64::from(k) / f64::from(EXTREME_PIECES);
    let forces = |t: f64| {
        let x = dense.at(t);
        planar.contact_forces(&x, input.voltage(t, &x))
    };
    let pressing = |t: f64| -forces(t).normal;
    let coefficient = |t: f64| forces(t).friction_coefficient().unwrap_or(f64::INFINITY);
    let mut rate = dense.at(at(0))[PHI_RATE];
    let (mut lightest, mut hardest) = ((f64::NEG_INFINITY, 0), (f64::NEG_INFINITY, 0));
    for k in 0..=EXTREME_PIECES {
        let x = dense.at(at(k));
        extremes.angle(x[PHI]);
        if k > 0 && rate * x[PHI_RATE] < 0.0 {
            let t = root_between(|t| dense.at(t)[PHI_RATE], at(k - 1), at(k), 1e-12);
            extremes.angle(dense.at(t)[PHI]);
        }
        rate = x[PHI_RATE];
        let f = planar.contact_forces(&x, input.voltage(at(k), &x));
        extremes.forces(&f);
        if -f.normal > lightest.0 {
            lightest = (-f.normal, k);
        }
        let c = f.friction_coefficient().unwrap_or(f64::INFINITY);
        if c > hardest.0 {
            hardest = (c, k);
        }
    }
    let around = |k: i32| (at((k - 1).max(0)), at((k + 1).min(EXTREME_PIECES)));
    if lightest.0 > -0.2 && !extremes.lifted {
        let (a, b) = around(lightest.1);
        extremes.lifted |= maximum_between(pressing, a, b, 1e-9 * width).1 >= 0.0;
    }
    if hardest.0 > 0.8 * extremes.coefficient && !extremes.lifted {
        let (a, b) = around(hardest.1);
        let (t, _) = maximum_between(coefficient, a, b, 1e-9 * width);
        extremes.forces(&forces(t));
    }
}

/// As [`simulate`], in the vehicle's own arithmetic: fixed RK4 steps of `dt` in f32, with one voltage per
/// step. Each sample is the step nearest to its time.
pub fn simulate_f32(
    p: &PlanarParameters<f64>,
    input: &Input,
    start: PlanarState<f64>,
    t_end: f64,
    sample: f64,
    dt: f64,
) -> PlanarRun {
    let planar: Planar<f32> = Planar::new(p.cast());
    let law = input.law.map(|law| SpeedLaw {
        feed_forward_zeta: law.feed_forward_zeta as f32,
        alpha_l: law.alpha_l as f32,
        kp: law.kp as f32,
        kd: law.kd as f32,
    });
    let limit = input.u_max as f32;
    let step = dt as f32;
    let mut x = start.map(|v| v as f32);
    let mut run = PlanarRun::default();
    let mut extremes = Extremes::new(f64::from(x[PHI]));
    let steps = (t_end / dt).round() as u64;
    let mut next: f64 = 0.0;
    for k in 0..=steps {
        let t = k as f64 * dt;
        let value = input.value(t) as f32;
        let u = match &law {
            Some(law) => law.voltage(value, x[PHI], x[THETA_RATE], x[PHI_RATE]),
            None => value,
        };
        let u = u.clamp(-limit, limit);
        let f = planar.contact_forces(&x, u);
        let forces = ContactForces {
            friction: f64::from(f.friction),
            normal: f64::from(f.normal),
        };
        extremes.angle(f64::from(x[PHI]));
        extremes.forces(&forces);
        if t >= next * sample - 0.5 * dt {
            run.push(t, &x.map(f64::from), f64::from(u), &forces);
            next += 1.0;
        }
        x = planar.rk4(&x, u, step);
    }
    extremes.finish(&mut run);
    run
}

impl PlanarRun {
    fn push(&mut self, t: f64, x: &PlanarState<f64>, u: f64, forces: &ContactForces<f64>) {
        self.t.push(t);
        self.theta.push(x[THETA]);
        self.phi.push(x[PHI]);
        self.theta_rate.push(x[THETA_RATE]);
        self.phi_rate.push(x[PHI_RATE]);
        self.voltage.push(u);
        self.friction.push(forces.friction);
        self.normal.push(forces.normal);
    }

    /// `|F| / N` at the samples; NaN where the normal force is not positive.
    pub fn friction_coefficient(&self) -> Vec<f64> {
        let ratio = |(f, n): (&f64, &f64)| if *n > 0.0 { f.abs() / n } else { f64::NAN };
        self.friction.iter().zip(&self.normal).map(ratio).collect()
    }
}
