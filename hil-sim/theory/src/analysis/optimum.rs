//! The fastest step of the speed that a search finds with full knowledge of the state: the yardstick for every law.
//!
//! The joint torque is a share of the torque that current, voltage and grip allow at each moment; the share is constant
//! over each of some arcs. Then a separate landing law brings speed and arm home. The search varies the arcs and that
//! law's numbers. It knows the state without delay and error. The result is the best step found, not a proven optimum.

use model::control::equilibrium::Equilibrium;
use model::control::landing::MotionByTorque;
use model::integrate::rk4_step;

use super::cma_es::minimise;
use super::sampled::{SampledPlant, SampledRow};
use super::settling::{BAND, Settling, SpeedSample};

/// A step of the speed from rest on a slope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepTask {
    /// The vehicle, its slope, torque and voltage.
    pub plant: SampledPlant,
    /// Friction coefficient within which the wheels roll.
    pub grip_mu: f64,
    /// Largest angle of the arm, rad.
    pub phi_max_rad: f64,
    /// The target speed, in speed units, positive.
    pub target: f64,
}

/// The best step found.
#[derive(Debug, Clone, PartialEq)]
pub struct BestStep {
    /// Its settling.
    pub settling: Settling,
    /// Its course.
    pub rows: Vec<SampledRow>,
}

/// Arcs of constant share.
const ARCS: usize = 5;
/// Longest arc, in time units per unit of the target speed, and at least.
const ARC_MAX: f64 = 1.2;
/// Least and largest numbers of the law that ends the step: poles of the arm's servo, pole of the speed, and the share of
/// the grip that it accelerates with.
const SERVO: [f64; 2] = [1.5, 6.0];
const SPEED_RANGE: [f64; 2] = [0.5, 20.0];
const SHARE: [f64; 2] = [0.3, 1.0];
/// Number of searched values.
const NUMBERS: usize = 2 * ARCS + 4;
/// Longest integration step, and the time after the arcs, in time units.
const OPTIMUM_STEP: f64 = 0.02;
const HOME: f64 = 5.0;
/// Searches from different starts, and their length.
const STARTS: usize = 3;
/// Shares of the first three arcs at each start.
const SIGNS: [[f64; 3]; STARTS] = [[0.7, 0.7, 0.7], [-0.7, 0.7, 0.7], [-0.7, 0.7, -0.7]];
const OPTIMUM_GENERATIONS: usize = 300;

impl StepTask {
    /// The least time from rest to the target speed with the arm at rest at both ends. Over this time the arm's momentum
    /// cancels, so friction less the weight's component accelerates the whole mass, and the mean normal force is that of
    /// the weight. Infinite if grip cannot hold the slope.
    pub fn time_to_rest(&self) -> f64 {
        let (sin, cos) = (libm::sin(self.plant.beta), libm::cos(self.plant.beta));
        let room = self.grip_mu * cos - sin;
        if room > 0.0 { self.target / room } else { f64::INFINITY }
    }

    /// Runs the search. `normal` returns numbers with mean 0 and deviation 1. `None` if the vehicle cannot stand on the
    /// slope.
    pub fn best(&self, mut normal: impl FnMut() -> f64) -> Option<BestStep> {
        if self.plant.standing_sin_phi().abs() >= libm::sin(self.phi_max_rad.min(core::f64::consts::FRAC_PI_2)) {
            return None;
        }
        let best = (0..STARTS)
            .map(|k| {
                let mut start = vec![-1.0; NUMBERS];
                for (arc, share) in start[..ARCS].iter_mut().enumerate() {
                    *share = SIGNS[k][arc % 3];
                }
                start[2 * ARCS + 3] = 0.0;
                minimise(&start, 0.8, OPTIMUM_GENERATIONS, &mut normal, |x| {
                    self.fly(x, &mut |_| {})
                })
            })
            .min_by(|a, b| a.value.total_cmp(&b.value))?;
        let mut rows = Vec::new();
        self.fly(&best.at, &mut |row| rows.push(*row));
        let samples = rows.iter().map(|row| SpeedSample {
            time: row.time,
            speed: row.theta_rate,
        });
        Some(BestStep {
            settling: Settling::of(samples, 0.0, self.target),
            rows,
        })
    }

    /// Simulates the arcs `x` and returns their cost: the time until the speed stays within 2 %, plus penalties for
    /// leaving the arm's range or the grip.
    fn fly(&self, x: &[f64], see: &mut dyn FnMut(&SampledRow)) -> f64 {
        let plant = &self.plant;
        let slope = (libm::sin(plant.beta), libm::cos(plant.beta));
        let home = libm::asin(plant.standing_sin_phi().clamp(-1.0, 1.0));
        let longest = ARC_MAX * self.target.max(1.0);
        let landing = FinalLaw {
            home,
            servo: between(SERVO, x[2 * ARCS]),
            speed: between(SPEED_RANGE, x[2 * ARCS + 1]),
            share: between(SHARE, x[2 * ARCS + 2]),
            target: self.target * (1.0 + BAND * libm::tanh(x[2 * ARCS + 3])),
        };
        let mut state = [home, 0.0, 0.0];
        let (mut time, mut beyond, mut settled, mut before) = (0.0, 0.0_f64, 0.0, 1.0);
        for arc in 0..=ARCS {
            let length = if arc < ARCS {
                longest * logistic(x[ARCS + arc])
            } else {
                HOME
            };
            let steps = libm::ceil(length / OPTIMUM_STEP).max(1.0);
            let h = length / steps;
            for _ in 0..steps as usize {
                let torque_of = |state: &[f64; 3]| {
                    let motion = plant
                        .balance
                        .motion((libm::sin(state[0]), libm::cos(state[0])), state[1], slope);
                    let (low, high, outside) = self.allowed(state, &motion);
                    let wanted = if arc < ARCS {
                        0.5 * (low + high) + 0.5 * (high - low) * libm::tanh(x[arc])
                    } else {
                        self.landing_torque(&landing, state, &motion, slope)
                    };
                    (motion, wanted.clamp(low, high), outside)
                };
                let rate = |state: &[f64; 3]| {
                    let (motion, torque, _) = torque_of(state);
                    [state[1], motion.arm.at(torque), motion.wheel.at(torque)]
                };
                let (motion, torque, outside) = torque_of(&state);
                see(&SampledRow {
                    time,
                    phi: state[0],
                    theta_rate: state[2],
                    phi_rate: state[1],
                    friction: motion.friction.at(torque),
                    normal: motion.normal.at(torque),
                });
                beyond += h * outside;
                state = rk4_step(&state, h, rate);
                beyond += h * 20.0 * (state[0].abs() - self.phi_max_rad).max(0.0);
                time += h;
                // Time at which the speed leaves or enters the band of 2 %, interpolated within the step.
                let error = ((state[2] - self.target) / self.target).abs() / BAND;
                if error > 1.0 {
                    settled = time;
                } else if before > 1.0 {
                    settled = time - h * (1.0 - error) / (before - error);
                }
                before = error;
                if !state[0].is_finite() || state[0].abs() > 3.2 {
                    return 100.0 - time;
                }
            }
        }
        let unsettled = if before > 1.0 { 10.0 + before } else { 0.0 };
        settled + unsettled + 10.0 * beyond
    }

    /// The torque of the law that ends the step: the acceleration that removes the error of the landing speed, the arm's
    /// angle for it, and the servo.
    fn landing_torque(
        &self,
        law: &FinalLaw,
        state: &[f64; 3],
        motion: &MotionByTorque<f64>,
        (sin_slope, cos_slope): (f64, f64),
    ) -> f64 {
        let balance = &self.plant.balance;
        let (sin_home, cos_home) = (libm::sin(law.home), libm::cos(law.home));
        let along = balance.alpha_l * (cos_slope * cos_home + sin_slope * sin_home);
        let swing = 2.0 * (libm::sin(state[0]) - sin_home) / law.servo + cos_home * state[1] / (law.servo * law.servo);
        let landing = state[2]
            + (balance.alpha_l * swing + (along - balance.alpha_l2) * state[1]) / (balance.mass + balance.mu - along);
        let room = law.share * self.grip_mu * cos_slope;
        let acceleration = (law.speed * (law.target - landing)).clamp(-room - sin_slope, (room - sin_slope).max(0.0));
        let equilibrium = Equilibrium {
            alpha_l: balance.alpha_l,
            mass: balance.mass,
            mu: balance.mu,
        };
        let most = libm::sin(self.phi_max_rad.min(core::f64::consts::FRAC_PI_2));
        let wanted = equilibrium.arm(acceleration, sin_slope, cos_slope);
        let commanded = libm::asin(wanted.sin.clamp(-most, most));
        motion
            .arm
            .solve(-law.servo * law.servo * (state[0] - commanded) - 2.0 * law.servo * state[1])
    }

    /// The torques that current, voltage and grip allow, and the missing grip if no torque is allowed.
    fn allowed(&self, state: &[f64; 3], motion: &MotionByTorque<f64>) -> (f64, f64, f64) {
        let plant = &self.plant;
        let damping = plant.zeta * (state[1] + state[2]);
        let reach = plant.torque_per_voltage * plant.voltage_max;
        let mut low = (-plant.torque_max).max(-reach - damping);
        let mut high = plant.torque_max.min(reach - damping);
        if low > high {
            // Beyond the speed that the supply can sustain, the nearest torque brakes.
            let nearest = if damping > 0.0 {
                -plant.torque_max
            } else {
                plant.torque_max
            };
            (low, high) = (nearest, nearest);
        }
        let (mut grip_low, mut grip_high) = (low, high);
        for sign in [1.0, -1.0] {
            let per = sign * motion.friction.per_torque - self.grip_mu * motion.normal.per_torque;
            let room = self.grip_mu * motion.normal.at_zero - sign * motion.friction.at_zero;
            if per > 0.0 {
                grip_high = grip_high.min(room / per);
            } else if per < 0.0 {
                grip_low = grip_low.max(room / per);
            }
        }
        if grip_low <= grip_high {
            (grip_low, grip_high, 0.0)
        } else {
            let middle = (0.5 * (grip_low + grip_high)).clamp(low, high);
            (middle, middle, grip_low - grip_high)
        }
    }
}

/// The law that ends the step.
struct FinalLaw {
    home: f64,
    servo: f64,
    speed: f64,
    share: f64,
    target: f64,
}

fn between([least, most]: [f64; 2], x: f64) -> f64 {
    least + (most - least) * logistic(x)
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-x))
}
