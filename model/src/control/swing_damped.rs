//! Eq. 3.25 with its additions: reference governor, swing damping, friction feed-forward, slow trim, position
//! hold.
//!
//! Eq. 3.25 gives the right steady state and a small swing rate, but leaves the speed mode poorly damped
//! (erratum E11): the arm swings back and forth about its equilibrium for many seconds after every change. Eq.
//! 3.25 lacks a term in phi itself. Feeding back `-swing_gain (phi - phi_equilibrium)`, with the equilibrium
//! from the estimated slope and the governed acceleration,
//!
//! ```text
//! alpha L sin(phi_equilibrium) + a alpha L cos(beta - phi_equilibrium) = (1 + S) sin(beta) + (1 + S + mu) a
//! ```
//!
//! (a is the governed acceleration in g; [`Equilibrium`]) damps that mode and changes no steady state: at equilibrium the term is 0, so the steady-state error stays 0.

use super::LawOutput;
use super::equilibrium::Equilibrium;
use super::hold::Hold;
use super::speed::{SpeedAim, SpeedInput, SpeedTerms};
use super::speed_law::SpeedLaw;
use crate::bounded::Bounded;
use crate::vehicle::{G, Scales, Vehicle};

/// The law: nondimensional inside, SI at its interface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwingDampedLaw {
    law: SpeedLaw<f32>,
    scales: Scales<f32>,
    equilibrium: Equilibrium<f32>,
    swing_gain: f32,
    hold: Hold,
    /// The governor's smoothing gain, its slew per tick, and 1 / (g dt).
    reference_gain: f32,
    reference_step_m_s: f32,
    per_g_tick: f32,
    speed_max_m_s: f32,
    /// Coulomb friction of both gearboxes as a nondimensional voltage.
    friction: f32,
    /// Integral gain times the tick, in time units.
    trim_gain: f32,
    trim: f32,
    ramp_m_s: f32,
    reference_m_s: f32,
}

/// Largest trim, as a share of the voltage unit.
const TRIM_MAX: f32 = 0.5;
/// Time constant of the governor's smoothing, which rounds the corners of the ramp for the wheels' traction and
/// the camera.
const REFERENCE_TIME_CONSTANT_S: f32 = 0.5;
/// Speed reference, rad per time unit, at which the friction feed-forward reaches its full size.
const FRICTION_FULL: f32 = 0.05;
/// Speed error beyond which the guard acts, m/s, and its gain, nondimensional. Eq. 3.25 feeds the speed
/// error back positively and resists the arm's rate: behind an obstacle, with the arm swung far forward,
/// Eq. 3.25 alone would let the vehicle run away while the arm comes down slowly. The guard brakes it.
const GUARD_BEYOND_M_S: f32 = 0.4;
const GUARD_GAIN: f32 = 4.0;
/// Largest sine of the equilibrium angle that the swing damping aims at.
const SIN_EQUILIBRIUM_MAX: f32 = 0.9;
/// Speed reference below which the law captures and holds the place once no motion is commanded, m/s.
const CAPTURE_BELOW_M_S: f32 = 0.02;

impl SwingDampedLaw {
    /// The law for `vehicle`, called every `dt_s` seconds.
    pub fn new(vehicle: &Vehicle<f32>, dt_s: f32) -> Self {
        let (p, planar, scales) = (vehicle.parameters(), vehicle.planar(0.0), vehicle.scales());
        let alpha_l = planar.alpha * planar.l;
        Self {
            law: SpeedLaw {
                feed_forward_zeta: planar.zeta,
                alpha_l,
                kp: p.control.kp,
                kd: p.control.kd,
            },
            scales,
            equilibrium: Equilibrium {
                alpha_l,
                mass: 1.0 + vehicle.spar_mass_ratio(),
                mu: planar.mu,
            },
            swing_gain: p.control.swing_gain,
            hold: Hold::new(p.control.hold_kp_per_s),
            reference_gain: 1.0 - libm::expf(-dt_s / REFERENCE_TIME_CONSTANT_S),
            reference_step_m_s: p.control.acceleration_max_m_s2 * dt_s,
            per_g_tick: 1.0 / (G * dt_s),
            speed_max_m_s: p.control.speed_max_m_s,
            friction: 2.0 * p.drive_motor.coulomb_friction_n_m / scales.torque_n_m,
            trim_gain: p.control.ki * dt_s / scales.time_s,
            trim: 0.0,
            ramp_m_s: 0.0,
            reference_m_s: 0.0,
        }
    }

    /// Restarts at the present speed: the reference does not jump, and the trim is 0.
    pub fn reset(&mut self, speed_m_s: f32) {
        self.ramp_m_s = speed_m_s;
        self.reference_m_s = speed_m_s;
        self.trim = 0.0;
        self.hold.release();
    }

    /// One tick: returns the voltage of each drive motor, within `voltage_max_v`, and its terms.
    pub fn step(&mut self, input: &SpeedInput) -> LawOutput<SpeedTerms> {
        let target = input.target_m_s.bounded(-self.speed_max_m_s, self.speed_max_m_s);
        let slow = self.reference_m_s.abs() < CAPTURE_BELOW_M_S;
        let hold_m_s = self.hold.speed_m_s(target, input.distance_m, slow);
        let acceleration_g = self.govern(target + hold_m_s);

        let reference = self.reference_m_s / self.scales.speed_m_s;
        let theta_rate = self.scales.rate_from_si(input.theta_rate_rad_s);
        let phi_rate = self.scales.rate_from_si(input.phi_rate_rad_s);
        let law = self.law.terms(reference, input.phi_rad, theta_rate, phi_rate);
        let (sin_slope, cos_slope) = input.slope_sin_cos;
        let equilibrium = self.equilibrium.arm(acceleration_g, sin_slope, cos_slope);
        let sin_equilibrium = equilibrium.sin.bounded(-SIN_EQUILIBRIUM_MAX, SIN_EQUILIBRIUM_MAX);
        let commanded_phi = libm::asinf(sin_equilibrium);
        let swing_damping = -(self.swing_gain * (input.phi_rad - commanded_phi));
        let friction = self.friction * (reference / FRICTION_FULL).bounded(-1.0, 1.0);
        let error = reference - theta_rate;
        let beyond = GUARD_BEYOND_M_S / self.scales.speed_m_s;
        let guard = GUARD_GAIN * (error - error.bounded(-beyond, beyond));
        let trim = self.trim;
        let u = law.sum() + guard + swing_damping + friction + trim;
        let u_max = self.scales.voltage_from_si(input.voltage_max_v);
        let limited = u.bounded(-u_max, u_max);
        // Anti-windup: the trim does not grow into a limit, and stays bounded.
        if limited == u || (u - limited) * error < 0.0 {
            self.trim = (self.trim + self.trim_gain * error).bounded(-TRIM_MAX, TRIM_MAX);
        }
        let volts = |u: f32| self.scales.voltage_to_si(u);
        LawOutput {
            voltage_v: volts(limited),
            terms: SpeedTerms {
                feed_forward_v: volts(law.feed_forward),
                weight_v: volts(law.weight),
                speed_feedback_v: volts(law.speed_feedback),
                swing_rate_v: volts(law.swing_rate),
                swing_damping_v: volts(swing_damping),
                friction_v: volts(friction),
                guard_v: volts(guard),
                trim_v: volts(trim),
                governed_v: 0.0,
                aim: SpeedAim {
                    landing_speed_m_s: 0.0,
                    acceleration_m_s2: acceleration_g * G,
                    phi_rad: commanded_phi,
                },
            },
        }
    }

    /// Slews and smooths the reference; returns its acceleration in g.
    fn govern(&mut self, target_m_s: f32) -> f32 {
        let step = self.reference_step_m_s;
        self.ramp_m_s += (target_m_s - self.ramp_m_s).bounded(-step, step);
        let change = self.reference_gain * (self.ramp_m_s - self.reference_m_s);
        self.reference_m_s += change;
        change * self.per_g_tick
    }

    /// The governed reference, m/s.
    pub fn reference_m_s(&self) -> f32 {
        self.reference_m_s
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::vehicle::test_vehicle::reference;

    proptest! {
        /// The terms add up to the voltage before its limit, in the first tick and after the trim has grown.
        #[test]
        fn the_terms_sum_to_the_voltage_before_its_limit(
            target_m_s in -3.0_f32..3.0, phi_rad in -1.4_f32..1.4, theta_rate_rad_s in -12.0_f32..12.0,
            phi_rate_rad_s in -6.0_f32..6.0, sin_slope in -0.3_f32..0.3, ticks in 1_usize..400,
        ) {
            let mut unlimited = SwingDampedLaw::new(&reference(), 0.001);
            let mut input = SpeedInput {
                target_m_s, phi_rad, phi_sin_cos: libm::sincosf(phi_rad), theta_rate_rad_s, phi_rate_rad_s,
                slope_sin_cos: (sin_slope, square_root::sqrtf(1.0 - sin_slope * sin_slope)), slope_turn_per_s: 0.0, turns: false,
                distance_m: 0.0, sliding_over_m_s: None, voltage_max_v: 1e6,
            };
            for _ in 1..ticks {
                unlimited.step(&input);
            }
            let mut limited = unlimited;
            let free = unlimited.step(&input);
            let t = free.terms;
            let size: f32 = t.voltages_v().iter().map(|term| term.abs()).sum();
            prop_assert!((t.sum_v() - free.voltage_v).abs() <= 1e-5 * (1.0 + size), "{t:?} {}", free.voltage_v);
            input.voltage_max_v = 3.0;
            let bound = limited.step(&input);
            prop_assert_eq!(bound.terms, free.terms, "the limit changes no term");
            prop_assert!((bound.voltage_v - free.voltage_v.bounded(-3.0, 3.0)).abs() < 1e-5);
        }
    }

    #[test]
    fn each_term_stands_for_its_own_cause() {
        let still = SpeedInput {
            target_m_s: 0.0,
            phi_rad: 0.0,
            phi_sin_cos: (0.0, 1.0),
            theta_rate_rad_s: 0.0,
            phi_rate_rad_s: 0.0,
            slope_sin_cos: (0.0, 1.0),
            slope_turn_per_s: 0.0,
            turns: false,
            distance_m: 0.0,
            sliding_over_m_s: None,
            voltage_max_v: 24.0,
        };
        let terms = |input: &SpeedInput| SwingDampedLaw::new(&reference(), 0.001).step(input).terms;
        assert_eq!(terms(&still), SpeedTerms::default());
        let leaning = terms(&SpeedInput { phi_rad: 0.2, ..still });
        assert!(leaning.weight_v > 0.0 && leaning.swing_damping_v < 0.0 && leaning.feed_forward_v == 0.0);
        let swinging = terms(&SpeedInput {
            phi_rate_rad_s: 1.0,
            ..still
        });
        assert!(swinging.swing_rate_v < 0.0 && swinging.weight_v == 0.0);
        let pushed = terms(&SpeedInput {
            theta_rate_rad_s: 1.0,
            ..still
        });
        assert!(pushed.speed_feedback_v > 0.0 && pushed.guard_v == 0.0);
        let runaway = terms(&SpeedInput {
            theta_rate_rad_s: 8.0,
            ..still
        });
        assert!(
            runaway.guard_v < -runaway.speed_feedback_v,
            "the guard outweighs the positive feedback"
        );
    }
}
