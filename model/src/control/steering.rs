//! Yaw-rate loop and heading hold: a voltage difference between the two wheels.

use super::LawOutput;
use crate::bounded::Bounded;
use crate::vehicle::Vehicle;

/// Input of the steering loop, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteeringInput {
    /// Wanted yaw rate, rad/s, anticlockwise positive. Exactly 0 holds the heading.
    pub target_rad_s: f32,
    /// Yaw rate, rad/s.
    pub yaw_rate_rad_s: f32,
    /// Heading, rad, not wrapped.
    pub heading_rad: f32,
    /// Largest voltage in either direction, V.
    pub voltage_max_v: f32,
    /// Whether an obstacle blocks the vehicle, which then does not turn however large the integral becomes: it fades.
    pub blocked: bool,
}

/// The terms of the steering law, V at the right motor and negated at the left. Their sum is the steering
/// voltage before its limit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[allow(clippy::struct_field_names)] // Every field is a voltage.
pub struct SteeringTerms {
    /// Back-EMF and damping at the governed yaw rate.
    pub feed_forward_v: f32,
    /// The error of the governed yaw rate, fed back.
    pub proportional_v: f32,
    /// The integral of the yaw-rate error, heading hold included.
    pub integral_v: f32,
    /// The heading hold's addition to the first two terms.
    pub hold_v: f32,
}

impl SteeringTerms {
    /// Their sum: the voltage before its limit, V.
    pub fn sum_v(&self) -> f32 {
        self.feed_forward_v + self.proportional_v + self.integral_v + self.hold_v
    }
}

/// The steering loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteeringController {
    kp_v_s_per_rad: f32,
    ki_tick_v_per_rad_s: f32,
    heading_kp_per_s: f32,
    feed_forward_v_s_per_rad: f32,
    rate_max_rad_s: f32,
    rate_step_rad_s: f32,
    reference_rad_s: f32,
    /// What the last tick changed of the reference.
    reference_step_rad_s: f32,
    ticks_per_s: f32,
    integral_v: f32,
    hold_rad: Option<f32>,
}

/// Yaw rate below which the loop captures and holds the heading once no turn is commanded.
const HOLD_BELOW_RAD_S: f32 = 0.05;
/// Largest yaw rate that the heading hold commands, as a share of the vehicle's largest yaw rate.
const HOLD_SHARE: f32 = 0.5;

/// Share of the integral that a tick leaves of a vehicle that an obstacle blocks: a fifth of a second's fading.
const BLOCKED_KEPT: f32 = 0.995;

/// Share of the supply voltage that steering may take from driving.
pub const STEERING_SHARE: f32 = 0.5;

/// Largest yaw rate as a share of the yaw rate at which spinning becomes unstable (erratum E26).
const SPIN_SHARE: f32 = 0.8;

impl SteeringController {
    /// The loop for `vehicle`, called every `dt_s` seconds.
    pub fn new(vehicle: &Vehicle<f32>, dt_s: f32) -> Self {
        let p = vehicle.parameters();
        let (body, motor, control) = (&p.body, &p.drive_motor, &p.control);
        // Back-EMF and half the bearing damping of one wheel that turns at d / r times the yaw rate.
        let torque_per_volt = motor.torque_constant_n_m_per_a * motor.gear_ratio / motor.resistance_ohm;
        let volt_per_rate =
            motor.back_emf_constant_v_s_per_rad * motor.gear_ratio + 0.5 * body.bearing_damping_n_m_s / torque_per_volt;
        // In a faster spin the hanging arm swings in and out with growing amplitude: the sooner, the more the axle carries.
        let stable_rad_s = vehicle
            .spatial(0.0, 0.0)
            .carrying(1.0 + vehicle.spar_mass_ratio())
            .spin_stability_limit()
            .map_or(f32::MAX, |limit| SPIN_SHARE * limit / vehicle.scales().time_s);
        Self {
            kp_v_s_per_rad: control.yaw_kp_v_s_per_rad,
            ki_tick_v_per_rad_s: control.yaw_ki_v_per_rad * dt_s,
            heading_kp_per_s: control.heading_kp_per_s,
            feed_forward_v_s_per_rad: volt_per_rate * body.half_track_m / body.wheel_radius_m,
            rate_max_rad_s: control.yaw_rate_max_rad_s.bounded(0.0, stable_rad_s),
            rate_step_rad_s: control.yaw_acceleration_max_rad_s2 * dt_s,
            reference_rad_s: 0.0,
            reference_step_rad_s: 0.0,
            ticks_per_s: 1.0 / dt_s,
            integral_v: 0.0,
            hold_rad: None,
        }
    }

    /// Restarts: no turn, no integral, no captured heading.
    pub fn reset(&mut self) {
        self.reference_rad_s = 0.0;
        self.reference_step_rad_s = 0.0;
        self.integral_v = 0.0;
        self.hold_rad = None;
    }

    /// One tick: returns the voltage to add to the right motor and to subtract from the left motor, and its
    /// terms.
    #[inline]
    pub fn step(&mut self, input: &SteeringInput) -> LawOutput<SteeringTerms> {
        let step = self.rate_step_rad_s;
        let target = input.target_rad_s.bounded(-self.rate_max_rad_s, self.rate_max_rad_s);
        self.reference_step_rad_s = (target - self.reference_rad_s).bounded(-step, step);
        self.reference_rad_s += self.reference_step_rad_s;
        let turning = target != 0.0 || self.reference_rad_s != 0.0;
        if turning {
            self.hold_rad = None;
        } else if self.hold_rad.is_none() && input.yaw_rate_rad_s.abs() < HOLD_BELOW_RAD_S {
            self.hold_rad = Some(input.heading_rad);
        }
        let hold_max = HOLD_SHARE * self.rate_max_rad_s;
        let hold = self.hold_rad.map_or(0.0, |held| {
            (self.heading_kp_per_s * (held - input.heading_rad)).bounded(-hold_max, hold_max)
        });
        let reference = self.reference_rad_s + hold;
        let error = reference - input.yaw_rate_rad_s;
        let wanted = self.feed_forward_v_s_per_rad * reference + self.kp_v_s_per_rad * error + self.integral_v;
        let terms = SteeringTerms {
            feed_forward_v: self.feed_forward_v_s_per_rad * self.reference_rad_s,
            proportional_v: self.kp_v_s_per_rad * (self.reference_rad_s - input.yaw_rate_rad_s),
            integral_v: self.integral_v,
            hold_v: (self.feed_forward_v_s_per_rad + self.kp_v_s_per_rad) * hold,
        };
        let limited = wanted.bounded(-input.voltage_max_v, input.voltage_max_v);
        // Anti-windup: the integral does not grow into the limit, and stays bounded. While an obstacle holds the wheels it
        // fades: what it had gathered on the way there would let one wheel push alone, and the other wheel's gears carry
        // nothing.
        if input.blocked {
            self.integral_v *= BLOCKED_KEPT;
        } else if limited == wanted || (wanted - limited) * error < 0.0 {
            self.integral_v =
                (self.integral_v + self.ki_tick_v_per_rad_s * error).bounded(-input.voltage_max_v, input.voltage_max_v);
        }
        LawOutput {
            voltage_v: limited,
            terms,
        }
    }

    /// Change of the governed yaw-rate reference in the last tick, rad/s^2.
    pub fn reference_rad_s2(&self) -> f32 {
        self.reference_step_rad_s * self.ticks_per_s
    }

    /// The governed yaw-rate reference, rad/s.
    pub fn reference_rad_s(&self) -> f32 {
        self.reference_rad_s
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::vehicle::test_vehicle::reference;

    #[test]
    fn the_yaw_rate_stays_below_the_one_at_which_spinning_becomes_unstable() {
        let mut parameters = *reference().parameters();
        parameters.control.yaw_rate_max_rad_s = 20.0;
        let vehicle = Vehicle::new(parameters).expect("valid");
        assert!(vehicle.spar_mass_ratio() > 0.1);
        let carrying = vehicle.spatial(0.0, 0.0).carrying(1.0 + vehicle.spar_mass_ratio());
        let limit = carrying.spin_stability_limit().expect("a limit");
        let limit_rad_s = limit / vehicle.scales().time_s;
        assert!(limit_rad_s < 20.0, "{limit_rad_s}");
        for way in [1.0, -1.0] {
            let mut steering = SteeringController::new(&vehicle, 0.001);
            let input = SteeringInput {
                target_rad_s: 20.0 * way,
                yaw_rate_rad_s: 0.0,
                heading_rad: 0.0,
                voltage_max_v: 12.0,
                blocked: false,
            };
            for _ in 0..10_000 {
                steering.step(&input);
            }
            let found = way * steering.reference_rad_s();
            assert!(
                found > 0.5 * limit_rad_s && found < 0.9 * limit_rad_s,
                "{found} of {limit_rad_s}"
            );
        }
    }

    #[test]
    fn the_integral_fades_while_an_obstacle_holds_the_wheels() {
        let mut steering = SteeringController::new(&reference(), 0.001);
        let mut integral_v = |heading_rad: f32, blocked: bool| {
            let input = SteeringInput {
                target_rad_s: 0.0,
                yaw_rate_rad_s: 0.0,
                heading_rad,
                voltage_max_v: 12.0,
                blocked,
            };
            (0..1000).fold(0.0, |_, _| steering.step(&input).terms.integral_v)
        };
        assert_eq!(integral_v(0.0, false), 0.0);
        let free_v = integral_v(0.001, false);
        assert!(free_v < -0.1, "{free_v}");
        let blocked_v = integral_v(0.001, true);
        assert!(blocked_v.abs() < 0.01 * free_v.abs(), "{blocked_v} {free_v}");
    }

    proptest! {
        /// The terms add up to the voltage before its limit, during a turn and while the heading is held.
        #[test]
        fn the_terms_sum_to_the_voltage_before_its_limit(
            target_rad_s in prop_oneof![Just(0.0_f32), -2.0_f32..2.0], yaw_rate_rad_s in -0.04_f32..0.04,
            heading_rad in -3.0_f32..3.0, ticks in 1_usize..400,
        ) {
            let mut unlimited = SteeringController::new(&reference(), 0.001);
            let mut input = SteeringInput { target_rad_s, yaw_rate_rad_s, heading_rad: 0.0, voltage_max_v: 1e6, blocked: false };
            for _ in 0..ticks {
                unlimited.step(&input);
            }
            input.heading_rad = heading_rad;
            let mut limited = unlimited;
            let free = unlimited.step(&input);
            prop_assert!((free.terms.sum_v() - free.voltage_v).abs() < 1e-4, "{:?} {}", free.terms, free.voltage_v);
            prop_assert_eq!(free.terms.hold_v != 0.0, target_rad_s == 0.0 && heading_rad != 0.0);
            input.voltage_max_v = 0.5;
            let bound = limited.step(&input);
            prop_assert_eq!(bound.terms, free.terms, "the limit changes no term");
            prop_assert_eq!(bound.voltage_v, free.voltage_v.bounded(-0.5, 0.5));
        }
    }
}
