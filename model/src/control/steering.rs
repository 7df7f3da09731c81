//! Yaw-rate loop and heading hold: a voltage difference between the two wheels.

use crate::bounded::Bounded;
use crate::vehicle::Vehicle;

/// What the steering loop reads, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteeringInput {
    /// Wanted yaw rate, rad/s, anticlockwise positive. Exactly 0 holds the heading.
    pub target_rad_s: f32,
    /// Yaw rate, rad/s.
    pub yaw_rate_rad_s: f32,
    /// Heading, rad, not wrapped.
    pub heading_rad: f32,
    /// Largest voltage difference to either side, V.
    pub voltage_max_v: f32,
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
    integral_v: f32,
    hold_rad: Option<f32>,
}

/// Yaw rate below which the heading is caught and held once no turn is asked for.
const HOLD_BELOW_RAD_S: f32 = 0.05;
/// Largest yaw rate that the heading hold asks for, as a share of the largest yaw rate.
const HOLD_SHARE: f32 = 0.5;

impl SteeringController {
    /// The loop for `vehicle`, called every `dt_s` seconds.
    pub fn new(vehicle: &Vehicle<f32>, dt_s: f32) -> Self {
        let p = vehicle.parameters();
        let (body, motor, control) = (&p.body, &p.drive_motor, &p.control);
        // Back-EMF and half the bearing damping of one wheel that turns at d / r times the yaw rate.
        let torque_per_volt = motor.torque_constant_n_m_per_a * motor.gear_ratio / motor.resistance_ohm;
        let volt_per_rate =
            motor.back_emf_constant_v_s_per_rad * motor.gear_ratio + 0.5 * body.bearing_damping_n_m_s / torque_per_volt;
        Self {
            kp_v_s_per_rad: control.yaw_kp_v_s_per_rad,
            ki_tick_v_per_rad_s: control.yaw_ki_v_per_rad * dt_s,
            heading_kp_per_s: control.heading_kp_per_s,
            feed_forward_v_s_per_rad: volt_per_rate * body.half_track_m / body.wheel_radius_m,
            rate_max_rad_s: control.yaw_rate_max_rad_s,
            rate_step_rad_s: control.yaw_acceleration_max_rad_s2 * dt_s,
            reference_rad_s: 0.0,
            integral_v: 0.0,
            hold_rad: None,
        }
    }

    /// Starts anew: no turn, no integral, the heading to be caught.
    pub fn reset(&mut self) {
        self.reference_rad_s = 0.0;
        self.integral_v = 0.0;
        self.hold_rad = None;
    }

    /// One tick: the voltage to add to the right wheel and to take from the left, V.
    pub fn step(&mut self, input: &SteeringInput) -> f32 {
        let step = self.rate_step_rad_s;
        let target = input.target_rad_s.bounded(-self.rate_max_rad_s, self.rate_max_rad_s);
        self.reference_rad_s += (target - self.reference_rad_s).bounded(-step, step);
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
        let limited = wanted.bounded(-input.voltage_max_v, input.voltage_max_v);
        // Anti-windup: the integral does not grow into the limit, and never beyond it.
        if limited == wanted || (wanted - limited) * error < 0.0 {
            self.integral_v =
                (self.integral_v + self.ki_tick_v_per_rad_s * error).bounded(-input.voltage_max_v, input.voltage_max_v);
        }
        limited
    }

    /// The governed yaw-rate reference, rad/s.
    pub fn reference_rad_s(&self) -> f32 {
        self.reference_rad_s
    }
}
