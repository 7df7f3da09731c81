//! Plans the ballast's angle that keeps the spar level while the axle accelerates.
//!
//! For a spar that is level and at rest, Eq. 7.12 (with the far side of the bearing on the arm, and the axle
//! accelerating at `a` g up a slope beta) reduces to an equation for the ballast's angle gamma:
//!
//! ```text
//! (m2 + m3 cos(gamma)) gamma'' = m3 sin(gamma) gamma'^2 - k1 a cos(beta)
//!                              - k2 [(1 + a sin(beta)) sin(gamma) + a cos(beta) cos(gamma)] + zeta phi'
//! ```
//!
//! The motor then gives `m2 gamma'' + k2 [...] + xi gamma'`. The plan follows this equation. The equation alone
//! describes an undamped pendulum: after a step of the acceleration the ballast would swing for ever, and a second step
//! might swing the ballast over. The plan therefore damps the pendulum, at the cost of a small error in the spar's
//! level.

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
    /// Rate of the arm, rad/s. The arm carries the far side of the spar's bearing.
    pub arm_rate_rad_s: f32,
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
    pub(super) fn step(&mut self, pivot: &Pivot) -> f32 {
        let SparCoefficients { m2, m3, k1, k2, .. } = self.coefficients;
        let along = pivot.acceleration_g * pivot.cos_slope;
        let weight = 1.0 + pivot.acceleration_g * pivot.sin_slope;
        let (sin, cos) = sin_cos(self.angle_rad);
        let ballast = k2 * (weight * sin + along * cos);
        let spar = k1 * along - self.bearing_damping * self.seconds * pivot.arm_rate_rad_s;
        let swing = m3 * sin * self.rate * self.rate;
        let acceleration = (swing - spar - ballast) / (m2 + m3 * cos) - self.damping * self.rate;
        let voltage = self.turned * acceleration + ballast + self.back_emf * self.rate;
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
