//! Plans the ballast's angle that keeps the spar level while the axle accelerates and turns.
//!
//! For a spar that is level and at rest, Eq. 7.12 (with the far side of the bearing on the arm, and the axle
//! accelerating at `a` g up a slope beta) reduces to an equation for the ballast's angle gamma:
//!
//! ```text
//! (m2 + m3 cos(gamma)) gamma'' = m3 sin(gamma) gamma'^2 - k1 a cos(beta)
//!                              - k2 [(1 + a sin(beta)) sin(gamma) + a cos(beta) cos(gamma)] + zeta phi'
//! ```
//!
//! The motor then gives `m2 gamma'' + k2 [...] + xi gamma'`.
//!
//! A vehicle that turns on a slope changes the slope along its heading. The plane, which carries the bearing, tilts by
//!
//! ```text
//! beta'  = psi' sin(roll)
//! beta'' = psi'' sin(roll) - psi'^2 sin(beta) cos(beta)
//! ```
//!
//! to the first order in the roll. A level spar turns back against the plane by the same amount. Its inertia adds
//! `(m1 + m2 + 2 m3) beta''` to the equation, and `-(m2 + m3) beta''` to the motor's torque. A level spar leans by beta
//! from the axis of the turn, whose centrifugal force adds `-psi'^2 sin(beta) cos(beta)` to beta''; the plan neglects the
//! force on the ballast's own angle. The arm's rate against the spar includes beta'.
//!
//! The plan follows this equation. The equation alone describes an undamped pendulum: after a step of the acceleration the
//! ballast would swing for ever, and a second step might swing the ballast over. The plan therefore damps the pendulum,
//! at the cost of a small error in the spar's level.

use crate::bounded::Bounded;
use crate::dynamics::camera::SparCoefficients;
use crate::vehicle::{SparScales, Vehicle};

/// Damping ratio of the planned swing. With 0 the spar would stay level, but the ballast would never stop swinging.
/// With 0.2, alternating commands tilt the spar by more than 0.5 deg rms.
const DAMPING: f32 = 0.15;
/// Largest planned angle, rad. Beyond this angle the ballast loses its lever arm; beyond a quarter turn it pulls the
/// wrong way.
const ANGLE_MAX_RAD: f32 = 1.3;

/// Bounds of a commanded acceleration that keep the ballast below a level spar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gentleness {
    /// Largest acceleration, g. A step of this size swings the undamped ballast to twice its new equilibrium, `2 (k1 +
    /// k2) a / k2` = 1 rad.
    pub acceleration_g: f32,
    /// Time constant of the command's smoothing at that acceleration, s: twice that of the ballast's pendulum. The
    /// smoothing leaves 0.45 of an acceleration that alternates at the pendulum's frequency.
    pub smoothing_s: f32,
}

impl Gentleness {
    /// The bounds for the spar of `vehicle`; `None` if the vehicle has no levelled spar.
    pub fn new(vehicle: &Vehicle<f32>) -> Option<Self> {
        vehicle.spar_gains()?;
        let SparCoefficients { m2, m3, k1, k2, .. } = vehicle.camera()?.coefficients();
        let pendulum = square_root::sqrtf((m2 + m3) / k2);
        Some(Self {
            acceleration_g: 0.5 * k2 / (k1 + k2),
            smoothing_s: 2.0 * pendulum * vehicle.spar_scales()?.time_s,
        })
    }
}

/// Motion of the spar's pivot. The speed law knows this motion before any sensor shows it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pivot {
    /// Acceleration of the axle along the slope, g, forward positive.
    pub acceleration_g: f32,
    /// Sine of the slope, uphill positive.
    pub sin_slope: f32,
    /// Cosine of the slope.
    pub cos_slope: f32,
    /// Rate of the arm as its gyro shows it, without the plane's tilt in a turn, rad/s. The arm carries the far side of the
    /// spar's bearing.
    pub arm_rate_rad_s: f32,
    /// Yaw rate, rad/s, anticlockwise positive.
    pub yaw_rate_rad_s: f32,
    /// Its commanded change, rad/s^2.
    pub yaw_rad_s2: f32,
    /// Sine of the axle's roll: positive with its left end up.
    pub sin_roll: f32,
}

/// The planned ballast, in the units of ch. 7.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BallastPlan {
    coefficients: SparCoefficients<f32>,
    /// Inertia that the ballast motor turns: the ballast about the motor's shaft, and the rotor as reflected by its
    /// gear.
    turned: f32,
    bearing_damping: f32,
    back_emf: f32,
    /// Damping of the planned swing: twice the damping ratio times the pendulum's frequency.
    damping: f32,
    /// One tick and one second, in time units.
    tick: f32,
    seconds: f32,
    angle_rad: f32,
    rate: f32,
}

impl BallastPlan {
    /// The plan for the spar of `vehicle`, called every `dt_s` seconds; `None` without a spar.
    pub(super) fn new(vehicle: &Vehicle<f32>, scales: &SparScales<f32>, dt_s: f32) -> Option<Self> {
        let (spar, motor) = vehicle.parameters().spar.as_ref()?;
        let camera = vehicle.camera()?;
        let coefficients = camera.coefficients();
        let inertia_kg_m2 = spar.camera_mass_kg * spar.spar_length_m * spar.spar_length_m;
        let rotor = motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia_kg_m2 / inertia_kg_m2;
        Some(Self {
            coefficients,
            turned: coefficients.m2 + rotor,
            bearing_damping: camera.zeta,
            back_emf: camera.xi,
            damping: 2.0 * DAMPING * square_root::sqrtf(coefficients.k2 / (coefficients.m2 + coefficients.m3)),
            tick: dt_s / scales.time_s,
            seconds: scales.time_s,
            angle_rad: 0.0,
            rate: 0.0,
        })
    }

    /// Restarts the plan at the ballast's present angle and rate (in the units of ch. 7).
    pub(super) fn reset(&mut self, angle_rad: f32, rate: f32) {
        self.angle_rad = angle_rad.bounded(-ANGLE_MAX_RAD, ANGLE_MAX_RAD);
        self.rate = rate;
    }

    /// The ballast's planned angle, rad.
    pub(super) fn angle_rad(&self) -> f32 {
        self.angle_rad
    }

    /// The ballast's planned rate, in the units of ch. 7.
    pub(super) fn rate(&self) -> f32 {
        self.rate
    }

    /// The inertia that the ballast motor turns, in the units of ch. 7.
    pub(super) fn turned(&self) -> f32 {
        self.turned
    }

    /// The back-EMF of the ballast motor, in the units of ch. 7.
    pub(super) fn back_emf(&self) -> f32 {
        self.back_emf
    }

    /// The weight's torque on a ballast at the angle `from_vertical_rad`, in the units of ch. 7.
    pub(super) fn weight(&self, from_vertical_rad: f32) -> f32 {
        self.coefficients.k2 * libm::sinf(from_vertical_rad)
    }

    /// One tick: returns the motor's voltage for the planned motion, in the units of ch. 7, and advances the plan to
    /// the end of the tick.
    // Inlined on the host: its one caller has what it needs in registers.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub(super) fn step(&mut self, pivot: &Pivot) -> f32 {
        let SparCoefficients { m1, m2, m3, k1, k2 } = self.coefficients;
        let along = pivot.acceleration_g * pivot.cos_slope;
        let weight = 1.0 + pivot.acceleration_g * pivot.sin_slope;
        let (sin, cos) = sin_cos(self.angle_rad);
        let ballast = k2 * (weight * sin + along * cos);
        let yaw_rate = self.seconds * pivot.yaw_rate_rad_s;
        let outwards = 2.0 * yaw_rate * yaw_rate * pivot.sin_slope * pivot.cos_slope;
        let tipping = self.seconds * self.seconds * pivot.yaw_rad_s2 * pivot.sin_roll - outwards;
        let arm_rate = self.seconds * pivot.arm_rate_rad_s + yaw_rate * pivot.sin_roll;
        let spar = k1 * along - self.bearing_damping * arm_rate - (m1 + m2 + 2.0 * m3) * tipping;
        let swing = m3 * sin * self.rate * self.rate;
        let acceleration = (swing - spar - ballast) / (m2 + m3 * cos) - self.damping * self.rate;
        let voltage = self.turned * acceleration + ballast + self.back_emf * self.rate - (m2 + m3) * tipping;
        let angle = self.angle_rad + self.tick * (self.rate + 0.5 * self.tick * acceleration);
        self.rate += self.tick * acceleration;
        self.angle_rad = angle.bounded(-ANGLE_MAX_RAD, ANGLE_MAX_RAD);
        if self.angle_rad != angle {
            self.rate = 0.0;
        }
        voltage
    }
}

/// Sine and cosine of an angle within [`ANGLE_MAX_RAD`], accurate to 0.01. The series cost a tenth of the exact
/// functions.
fn sin_cos(angle: f32) -> (f32, f32) {
    let square = angle * angle;
    (
        angle * (1.0 - square * (1.0 / 6.0) * (1.0 - square * 0.05)),
        1.0 - 0.5 * square * (1.0 - square * (1.0 / 12.0)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::test_vehicle::reference;

    /// A level spar on an axle that turns on a plane of the steepness `steep`, in the units of ch. 7. At the time t it faces
    /// `facing + yaw t + turn t^2 / 2` away from uphill, and its ballast is at `angle + swing t^2 / 2`. The coordinates of its
    /// points are along the plane's fixed axes: uphill, to the left of uphill, normal.
    struct Level {
        steep: f64,
        facing: f64,
        yaw: f64,
        turn: f64,
        angle: f64,
        swing: f64,
    }

    impl Level {
        /// The direction in which the vehicle faces, and the direction of the vertical in the plane of its wheels, at `t`.
        fn axes(&self, t: f64) -> ([f64; 2], [f64; 2]) {
            let heading = self.facing + self.yaw * t + 0.5 * self.turn * t * t;
            let (along, normal) = (self.steep.sin() * heading.cos(), self.steep.cos());
            let length = along.hypot(normal);
            (
                [heading.cos(), heading.sin()],
                // Components of the spar, whose lower end points down: along the heading, and along the plane's normal.
                [-along / length, -normal / length],
            )
        }

        /// A point at `along` down the spar, and `beyond` from there in the ballast's direction.
        fn point(&self, t: f64, along: f64, beyond: f64) -> [f64; 3] {
            let (facing, down) = self.axes(t);
            let (sin, cos) = (self.angle + 0.5 * self.swing * t * t).sin_cos();
            // The ballast's angle turns it forward, as phi does the arm.
            let out = [down[0] * cos - down[1] * sin, down[1] * cos + down[0] * sin];
            let forward = along * down[0] + beyond * out[0];
            [
                forward * facing[0],
                forward * facing[1],
                along * down[1] + beyond * out[1],
            ]
        }

        /// The torque about the axle's direction, at the pivot `from`, of the weight and the inertia of `mass` at the point.
        fn torque(&self, mass: f64, (along, beyond): (f64, f64), from: f64) -> f64 {
            let h = 1e-3;
            let at = |t| self.point(t, along, beyond);
            let (before, now, after) = (at(-h), at(0.0), at(h));
            let up = [self.steep.sin(), 0.0, self.steep.cos()];
            let pull: [f64; 3] =
                core::array::from_fn(|i| mass * (-up[i] - (after[i] - 2.0 * now[i] + before[i]) / (h * h)));
            let pivot = self.point(0.0, from, 0.0);
            let arm: [f64; 3] = core::array::from_fn(|i| now[i] - pivot[i]);
            let ([x, y], _) = self.axes(0.0);
            // Forward times up is to the right; a positive torque turns the lower end forward.
            let (lever, force) = ([arm[0] * x + arm[1] * y, arm[2]], [pull[0] * x + pull[1] * y, pull[2]]);
            lever[0] * force[1] - lever[1] * force[0]
        }
    }

    /// The oracle: a turn on a plane carries three point masses through space, and the test differentiates their positions
    /// numerically. With the ballast's acceleration by the plan, no torque tilts the spar, and the plan's voltage is the torque
    /// that holds the ballast.
    #[test]
    fn a_turn_on_a_slope_leaves_the_spar_level() {
        let mut parameters = *reference().parameters();
        let (spar, motor) = parameters.spar.as_mut().expect("a spar");
        (spar.spar_damping_n_m_s, motor.rotor_inertia_kg_m2) = (0.0, 1e-12);
        let vehicle = Vehicle::new(parameters).expect("valid");
        let (camera, scales) = (
            vehicle.camera().expect("a spar"),
            vehicle.spar_scales().expect("a spar"),
        );
        let time_s = f64::from(scales.time_s);
        let [lm, lr, mm, mr] = [camera.lm, camera.lr, camera.mm, camera.mr].map(f64::from);
        for (steep_deg, facing_deg, yaw_rad_s, yaw_rad_s2, angle) in [
            (15.0_f64, 0.0_f64, 2.0, 0.0, 0.0),
            (15.0, 180.0, -2.0, 4.0, 0.1),
            (20.0, 90.0, 0.0, 4.0, 0.0),
            (20.0, -90.0, 1.0, -4.0, -0.2),
            (10.0, 45.0, 2.0, 4.0, 0.1),
            (0.0, 0.0, 2.0, 4.0, 0.2),
        ] {
            let (steep, facing) = (steep_deg.to_radians(), facing_deg.to_radians());
            let mut plan = BallastPlan::new(&vehicle, &scales, 0.001).expect("a spar");
            plan.reset(angle as f32, 0.0);
            let sin_slope = steep.sin() * facing.cos();
            let voltage = f64::from(plan.step(&Pivot {
                sin_slope: sin_slope as f32,
                cos_slope: (1.0 - sin_slope * sin_slope).sqrt() as f32,
                yaw_rate_rad_s: yaw_rad_s as f32,
                yaw_rad_s2: yaw_rad_s2 as f32,
                sin_roll: (-steep.sin() * facing.sin()) as f32,
                ..Pivot::default()
            }));
            let level = Level {
                steep,
                facing,
                yaw: yaw_rad_s * time_s,
                turn: yaw_rad_s2 * time_s * time_s,
                angle,
                swing: f64::from(plan.rate / plan.tick),
            };
            let ballast = level.torque(mr, (lm, lr), 0.0);
            let tilts = level.torque(1.0, (-1.0, 0.0), 0.0) + level.torque(mm, (lm, 0.0), 0.0) + ballast;
            let holds = -level.torque(mr, (lm, lr), lm);
            let story = (steep_deg, facing_deg, yaw_rad_s, yaw_rad_s2);
            // The plan is linear in the axle's roll. Level is meant in the plane of the wheels, in which less of the weight
            // acts, so an error remains that is quadratic in the roll. The plan neglects the ballast's centrifugal force,
            // at most 3 % of its weight.
            let c = vehicle.camera().expect("a spar").coefficients();
            let tipping = (yaw_rad_s2.abs() + 2.0 * yaw_rad_s * yaw_rad_s) * time_s * time_s * steep.sin();
            let size = f64::from(c.k2) * angle.sin().abs() + f64::from(c.m1 + c.m2 + 2.0 * c.m3) * tipping;
            let thrown = f64::from(c.m2 + c.m3) * (yaw_rad_s * time_s).powi(2) * angle.sin().abs();
            let allowed = 1e-4 + thrown + (steep.sin() * facing.sin()).powi(2) * size;
            assert!(tilts.abs() < allowed, "{story:?}: {tilts} of {allowed}");
            assert!((voltage - holds).abs() < allowed, "{story:?}: {voltage} for {holds}");
        }
    }
}
