//! The viability kernel of the arm: the angles and rates from which some torque within the limits can keep the arm,
//! compared with the vehicle's barrier.
//!
//! At torque level theta' drops out of (3.12) and (3.13), so that the arm is a system of phi and phi' alone, whose only
//! input is the torque. [`Kernel::new`] finds, for each point of a grid, the least angle within which the arm can be kept
//! for all time: the value `V(x) = max(|phi|, min over the torques of V(x after a step))`, from below, by sweeps.

use core::f64::consts::PI;

use model::control::landing::{Balance, Barrier, Interval, MotionByTorque, grip};
use rayon::prelude::*;
use serde::Serialize;

/// Limits of a vehicle's torque, nondimensional.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueLimits {
    /// Inertias.
    pub balance: Balance<f32>,
    /// Total damping, back-EMF included.
    pub zeta: f32,
    /// Largest torque by the motors' current.
    pub torque: f32,
    /// Largest voltage.
    pub voltage: f32,
    /// theta', which is constant at the vehicle's speed while the arm is being stopped.
    pub wheel_rate: f32,
    /// Slope, rad.
    pub beta: f32,
    /// Friction coefficient within which the wheels must grip, with a normal force above `NORMAL_MIN`; `None` if they
    /// may slide.
    pub grip_mu: Option<f32>,
}

/// Least normal force of a vehicle that stands on its wheels.
const NORMAL_MIN: f32 = 0.05;
/// Rate beyond which an arm counts as lost, per time unit.
const KERNEL_RATE_MAX: f64 = 7.0;
/// Half width of the states that the shares count, per time unit: rates that a push or a kerb may cause.
pub const COUNTED_RATE: f64 = 3.0;
/// Step of the sweeps, in time units.
const KERNEL_STEP: f64 = 0.02;
/// Largest number of sweeps, and the change below which the values count as converged.
const SWEEPS_MAX: usize = 1000;
const VALUE_SETTLED: f64 = 1e-4;
/// Number of torques tried between the least and the most.
const TORQUES: usize = 5;
/// Angle beyond which an arm counts as turned over.
const TURNED_OVER: f64 = PI - 0.05;
/// Time for which a drive under the barrier is followed, in time units: four periods of the hanging arm.
const FOLLOWED: f64 = 24.0;
/// Step of this simulation, in time units.
const FOLLOW_STEP: f32 = 0.005;

impl TorqueLimits {
    fn motion(&self, phi: f64, rate: f64) -> MotionByTorque<f32> {
        let slope = libm::sincosf(self.beta);
        self.balance.motion(libm::sincosf(phi as f32), rate as f32, slope)
    }

    /// The torques that current and voltage allow at the rate `rate`.
    fn driven(&self, rate: f64) -> Interval {
        let damping = self.zeta * (self.wheel_rate + rate as f32);
        Interval {
            least: (-self.voltage - damping).max(-self.torque),
            most: (self.voltage - damping).min(self.torque),
        }
    }

    /// The part of these torques that grip allows.
    fn admissible(&self, motion: &MotionByTorque<f32>, rate: f64) -> Interval {
        let driven = self.driven(rate);
        let gripping = self.grip_mu.map_or(Interval::ALL, |mu| grip(motion, mu));
        Interval {
            least: driven.least.max(gripping.least),
            most: driven.most.min(gripping.most),
        }
    }
}

/// The grid's values.
#[derive(Debug, Clone)]
pub struct Kernel {
    phis: Vec<f64>,
    rates: Vec<f64>,
    /// Least angle within which the arm can be kept, rad; a half turn if the arm turns over. Ordered by angle, then by
    /// rate.
    reach: Vec<f64>,
}

impl Kernel {
    /// The values within `limits` on a grid of `count` angles of a whole turn and as many rates.
    pub fn new(limits: &TorqueLimits, count: usize) -> Self {
        let axis = |most: f64| -> Vec<f64> {
            (0..count)
                .map(|k| most * (2.0 * k as f64 / (count - 1) as f64 - 1.0))
                .collect()
        };
        let (phis, rates) = (axis(PI), axis(KERNEL_RATE_MAX));
        let mut kernel = Self {
            reach: phis.iter().flat_map(|phi| vec![phi.abs(); count]).collect(),
            phis,
            rates,
        };
        // The successors of a point under each torque do not change from sweep to sweep.
        let next: Vec<Vec<(f64, f64)>> = (0..count * count)
            .into_par_iter()
            .map(|at| kernel.steps(limits, at))
            .collect();
        for sweep in 0..SWEEPS_MAX {
            let mut change = 0.0_f64;
            for k in 0..count * count {
                // The sweeps alternate in direction, so a value travels across the grid in few sweeps.
                let at = if sweep % 2 == 0 { k } else { count * count - 1 - k };
                let best = next[at].iter().map(|x| kernel.at(*x)).fold(PI, f64::min);
                if best > kernel.reach[at] {
                    change = change.max(best - kernel.reach[at]);
                    kernel.reach[at] = best;
                }
            }
            if change < VALUE_SETTLED {
                break;
            }
        }
        kernel
    }

    /// Successors of the point `at` under every torque that neither whirls the arm nor lifts the wheels.
    fn steps(&self, limits: &TorqueLimits, at: usize) -> Vec<(f64, f64)> {
        let (phi, rate) = (self.phis[at / self.rates.len()], self.rates[at % self.rates.len()]);
        let motion = limits.motion(phi, rate);
        let torques = limits.admissible(&motion, rate);
        if torques.is_empty() {
            return Vec::new();
        }
        let tries = (0..TORQUES).map(|k| k as f32 / (TORQUES - 1) as f32);
        tries
            .map(|share| torques.least + share * (torques.most - torques.least))
            .filter(|torque| limits.grip_mu.is_none() || motion.normal.at(*torque) >= NORMAL_MIN)
            .map(|torque| {
                let acceleration = f64::from(motion.arm.at(torque));
                (
                    phi + KERNEL_STEP * (rate + 0.5 * KERNEL_STEP * acceleration),
                    rate + KERNEL_STEP * acceleration,
                )
            })
            .filter(|(phi, rate)| phi.abs() < PI && rate.abs() < KERNEL_RATE_MAX)
            .collect()
    }

    /// The value between the grid's points.
    fn at(&self, (phi, rate): (f64, f64)) -> f64 {
        let count = self.rates.len();
        let place = |x: f64, most: f64| {
            let x = (x / most + 1.0) * 0.5 * (count - 1) as f64;
            let cell = (x as usize).min(count - 2);
            (cell, x - cell as f64)
        };
        let ((i, a), (j, b)) = (place(phi, PI), place(rate, KERNEL_RATE_MAX));
        let value = |i: usize, j: usize| self.reach[i * count + j];
        (value(i, j) * (1.0 - a) + value(i + 1, j) * a) * (1.0 - b)
            + (value(i, j + 1) * (1.0 - a) + value(i + 1, j + 1) * a) * b
    }

    /// The points that the shares count: angles within `phi_max`, rates within [`COUNTED_RATE`]. Angle, rate, value.
    pub fn counted(&self, phi_max: f64) -> impl Iterator<Item = (f64, f64, f64)> {
        let count = self.rates.len();
        let points = self.reach.iter().enumerate();
        points
            .map(move |(at, reach)| (self.phis[at / count], self.rates[at % count], *reach))
            .filter(move |(phi, rate, _)| phi.abs() <= phi_max && rate.abs() <= COUNTED_RATE)
    }
}

/// The largest angle that the arm reaches from `start` under the vehicle's barrier, for a law that asks for the largest
/// torque to either side and plans with the friction `planned_mu`. The simulation ends when the arm has turned over.
pub fn under_barrier(limits: &TorqueLimits, barrier: &Barrier, planned_mu: f32, start: (f64, f64)) -> f64 {
    let slope = libm::sincosf(limits.beta);
    let mut worst = 0.0_f64;
    for asked in [-limits.torque, limits.torque] {
        let (mut phi, mut rate) = (start.0 as f32, start.1 as f32);
        for _ in 0..(FOLLOWED / f64::from(FOLLOW_STEP)) as u32 {
            let motion = limits.balance.motion(libm::sincosf(phi), rate, slope);
            let torque = barrier.guard(&motion, (phi, rate), slope, asked, grip(&motion, planned_mu));
            let torque = limits.driven(f64::from(rate)).nearest(torque);
            rate += FOLLOW_STEP * motion.arm.at(torque);
            phi += FOLLOW_STEP * rate;
            worst = worst.max(f64::from(phi.abs()));
            if worst >= TURNED_OVER {
                return PI;
            }
        }
    }
    worst
}

/// Comparison of the barrier with the kernel.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// Share of the counted states from which the arm can be kept within `phi_max` while the wheels grip.
    pub viable_share: f64,
    /// Share of those states from which the vehicle's barrier keeps the arm there.
    pub kept_share: f64,
    /// Share of the counted states from which a whirl can be avoided by current and voltage.
    pub avoidable_share: f64,
    /// Share of those states from which the vehicle's barrier avoids the whirl.
    pub avoided_share: f64,
    /// Angles, rad.
    pub phi: Vec<f64>,
    /// The largest rate at each angle from which the arm can be kept within `phi_max`, per time unit.
    pub kernel_rate: Vec<f64>,
    /// The largest rate at each angle from which the vehicle's barrier keeps the arm.
    pub barrier_rate: Vec<f64>,
}

/// Whether a state, its angle and rate and how far the arm goes with and without a limit of grip, and how far it goes
/// under the barrier, is counted.
type Holds<'a> = &'a dyn Fn(&(f64, f64, f64, f64), f64) -> bool;

/// Compares on a grid of `count` by `count` points: the kernel within `phi_max` where the wheels grip with `limits`' friction,
/// and the whirls that current and voltage can avoid.
pub fn compare(limits: &TorqueLimits, barrier: &Barrier, planned_mu: f32, phi_max: f64, count: usize) -> Comparison {
    let gripping = Kernel::new(limits, count);
    let sliding = Kernel::new(
        &TorqueLimits {
            grip_mu: None,
            ..*limits
        },
        count,
    );
    let states: Vec<(f64, f64, f64, f64)> = gripping
        .counted(phi_max)
        .zip(sliding.counted(phi_max))
        .map(|((phi, rate, grip), (_, _, slide))| (phi, rate, grip, slide))
        .collect();
    let flown: Vec<f64> = states
        .par_iter()
        .map(|(phi, rate, ..)| under_barrier(limits, barrier, planned_mu, (*phi, *rate)))
        .collect();
    let share = |part: usize, whole: usize| part as f64 / whole.max(1) as f64;
    let number = |holds: Holds<'_>| states.iter().zip(&flown).filter(|(x, reach)| holds(x, **reach)).count();
    let viable = number(&|x, _| x.2 <= phi_max);
    let kept = number(&|x, reach| x.2 <= phi_max && reach <= phi_max);
    let avoidable = number(&|x, _| x.3 < TURNED_OVER);
    let avoided = number(&|x, reach| x.3 < TURNED_OVER && reach < TURNED_OVER);
    let mut phi: Vec<f64> = states.iter().map(|x| x.0).collect();
    phi.dedup();
    let largest = |holds: Holds<'_>| -> Vec<f64> {
        phi.iter()
            .map(|at| {
                let here = states
                    .iter()
                    .zip(&flown)
                    .filter(|(x, reach)| x.0 == *at && holds(x, **reach));
                here.map(|(x, _)| x.1).fold(f64::NAN, f64::max)
            })
            .collect()
    };
    Comparison {
        viable_share: share(viable, states.len()),
        kept_share: share(kept, viable),
        avoidable_share: share(avoidable, states.len()),
        avoided_share: share(avoided, avoidable),
        kernel_rate: largest(&|x, _| x.2 <= phi_max),
        barrier_rate: largest(&|_, reach| reach <= phi_max),
        phi,
    }
}
