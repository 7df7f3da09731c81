//! The speed loop of the vehicle: reference governor, Eq. 3.25, friction feed-forward, slow trim.

use super::speed_law::SpeedLaw;
use crate::vehicle::{Scales, Vehicle};

/// What the speed loop reads, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedInput {
    /// Wanted speed of the axle, m/s.
    pub target_m_s: f32,
    /// Arm angle from the vertical, rad.
    pub phi_rad: f32,
    /// Mean wheel rate theta', rad/s.
    pub theta_rate_rad_s: f32,
    /// Arm rate phi', rad/s.
    pub phi_rate_rad_s: f32,
    /// Largest voltage either way, V.
    pub voltage_max_v: f32,
}

/// The speed loop. Nondimensional inside, SI at the edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedController {
    law: SpeedLaw<f32>,
    scales: Scales<f32>,
    /// Governor's smoothing and slew, per tick.
    reference_gain: f32,
    reference_step_m_s: f32,
    speed_max_m_s: f32,
    /// Two gearboxes' Coulomb friction as a nondimensional voltage.
    friction: f32,
    /// Integral gain times the tick in time units.
    trim_gain: f32,
    trim: f32,
    ramp_m_s: f32,
    reference_m_s: f32,
}

/// Largest share of the supply that the trim may take.
const TRIM_MAX: f32 = 0.5;
/// Time constant of the governor's smoothing: it rounds the corners of the ramp, which would
/// otherwise excite the poorly damped speed mode.
const REFERENCE_TIME_CONSTANT_S: f32 = 0.3;
/// Speed reference, rad per time unit, at which the friction feed-forward is whole.
const FRICTION_FULL: f32 = 0.05;

impl SpeedController {
    /// The loop for `vehicle`, called every `dt_s` seconds.
    pub fn new(vehicle: &Vehicle<f32>, dt_s: f32) -> Self {
        let (p, planar, scales) = (vehicle.parameters(), vehicle.planar(0.0), vehicle.scales());
        Self {
            law: SpeedLaw {
                feed_forward_zeta: planar.zeta,
                alpha_l: planar.alpha * planar.l,
                kp: p.control.kp,
                kd: p.control.kd,
            },
            scales,
            reference_gain: 1.0 - libm::expf(-dt_s / REFERENCE_TIME_CONSTANT_S),
            reference_step_m_s: p.control.acceleration_max_m_s2 * dt_s,
            speed_max_m_s: p.control.speed_max_m_s,
            friction: 2.0 * p.drive_motor.coulomb_friction_n_m / scales.torque_n_m,
            trim_gain: p.control.ki * dt_s / scales.time_s,
            trim: 0.0,
            ramp_m_s: 0.0,
            reference_m_s: 0.0,
        }
    }

    /// Starts anew at the present speed: no jump of the reference, no trim.
    pub fn reset(&mut self, speed_m_s: f32) {
        self.ramp_m_s = speed_m_s;
        self.reference_m_s = speed_m_s;
        self.trim = 0.0;
    }

    /// One tick: the voltage for both motors, V, within `voltage_max_v`.
    pub fn step(&mut self, input: &SpeedInput) -> f32 {
        let target = input.target_m_s.clamp(-self.speed_max_m_s, self.speed_max_m_s);
        let step = self.reference_step_m_s;
        self.ramp_m_s += (target - self.ramp_m_s).clamp(-step, step);
        self.reference_m_s += self.reference_gain * (self.ramp_m_s - self.reference_m_s);

        let reference = self.reference_m_s / self.scales.speed_m_s;
        let theta_rate = self.scales.rate_from_si(input.theta_rate_rad_s);
        let phi_rate = self.scales.rate_from_si(input.phi_rate_rad_s);
        let law = self.law.voltage(reference, input.phi_rad, theta_rate, phi_rate);
        let friction = self.friction * (reference / FRICTION_FULL).clamp(-1.0, 1.0);
        let u = law + friction + self.trim;
        let u_max = self.scales.voltage_from_si(input.voltage_max_v);
        let limited = u.clamp(-u_max, u_max);
        // Anti-windup: the trim does not grow into a limit, and is bounded for ever.
        let error = reference - theta_rate;
        if limited == u || (u - limited) * error < 0.0 {
            self.trim = (self.trim + self.trim_gain * error).clamp(-TRIM_MAX, TRIM_MAX);
        }
        self.scales.voltage_to_si(limited)
    }

    /// The governed reference, m/s.
    pub fn reference_m_s(&self) -> f32 {
        self.reference_m_s
    }
}
