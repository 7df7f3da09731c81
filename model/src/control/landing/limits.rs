//! Limits that follow from the vehicle file: grip, acceleration, the arm's angles, slopes.

use super::balance::Balance;
use super::command::Room;
use super::governor::Barrier;
use crate::bounded::Bounded;
use crate::control::equilibrium::ArmAngle;
use crate::vehicle::Vehicle;

/// Share of the configured grip that the governor plans with. With a larger share, the slope observer mistakes model
/// error for grip during acceleration.
pub(in crate::control) const GRIP_SHARE: f32 = 0.75;
/// Friction coefficient that the law keeps beyond the need of standing, where standing needs much of the planned share.
/// There, holding and stopping have priority over the margin, up to the configured grip.
const STANDING_RESERVE: f32 = 0.25;
/// The reserve for accelerating uphill, and the share of the configured grip that bounds it. Both are smaller than for
/// standing, because the vehicle can do without that acceleration.
const CLIMBING_RESERVE: f32 = 0.16;
const CLIMBING_SHARE: f32 = 0.9;
/// Share of the planned grip that a commanded acceleration may use; the rest is for the arm's swing.
pub(in crate::control) const STEADY_SHARE: f32 = 0.9;
/// The same share while a vehicle that is commanded to stand starts. A vehicle released on a slope rolls back until its
/// arm is up, and stopping has priority over the margin.
const START_SHARE: f32 = 0.97;
/// Acceleration that is always allowed, g, so that the law never locks up.
const ACCELERATION_MIN_G: f32 = 0.02;
/// Share of the current limit that the law uses, so that the motor gives the commanded torque.
pub(super) const CURRENT_SHARE: f32 = 0.98;
/// Share of the fault angle that the arm may use for accelerating.
const WORKING_SHARE: f32 = 0.71;
/// Margin below the fault angle for the barrier and for an arm that stands on a steep slope.
const BARRIER_MARGIN_RAD: f32 = 0.05;
const STANDING_MARGIN_RAD: f32 = 0.12;
/// Difference of sines by which the law may command a standing arm beyond its equilibrium on a steep slope.
const STANDING_LEAN: f32 = 0.08;
/// Share of the steepest slope's angle beyond which the vehicle accepts no command further uphill.
const SLOPE_SHARE: f32 = 0.95;

/// Limits that follow from the vehicle file, nondimensional.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Limits {
    acceleration: f32,
    grip_mu: f32,
    working_sin_phi: f32,
    standing_sin_phi: f32,
    /// Sine of the steepest slope on which the vehicle can stand with its arm within its limits and its wheels
    /// gripping.
    sin_slope_stood: f32,
    /// Sine of the steepest slope that the vehicle drives up.
    sin_slope_driven: f32,
    /// The arm's barrier.
    pub(super) barrier: Barrier,
}

impl Limits {
    /// The limits of `vehicle`, whose inertias are `balance`, for accelerations of at most `acceleration`, g.
    pub(super) fn new(vehicle: &Vehicle<f32>, balance: &Balance<f32>, acceleration: f32) -> Self {
        let p = vehicle.parameters();
        let motor = &p.drive_motor;
        let torque_n_m =
            2.0 * motor.current_limit_a * motor.torque_constant_n_m_per_a * motor.gear_ratio * CURRENT_SHARE;
        let torque = torque_n_m / vehicle.scales().torque_n_m;
        let phi_max = p.safety.phi_max_rad;
        // The slope that the arm's whole weight balances, and the slope that grip holds.
        let carried = libm::asinf((balance.alpha_l / balance.mass).bounded(0.0, 1.0));
        let held = libm::atanf(p.control.grip_mu);
        let standing_sin_phi = sine(phi_max - STANDING_MARGIN_RAD);
        let sin_slope_stood = (standing_sin_phi * balance.alpha_l / balance.mass).bounded(0.0, sine(held));
        Self {
            acceleration,
            grip_mu: p.control.grip_mu,
            working_sin_phi: sine(WORKING_SHARE * phi_max),
            standing_sin_phi,
            sin_slope_stood,
            sin_slope_driven: sine(SLOPE_SHARE * carried.bounded(0.0, held)).bounded(0.0, sin_slope_stood),
            barrier: Barrier::new(balance, phi_max - BARRIER_MARGIN_RAD, torque),
        }
    }

    /// Friction coefficient that the law plans with.
    pub(super) fn planned_mu(&self) -> f32 {
        GRIP_SHARE * self.grip_mu
    }

    /// Whether a slope is steeper than the vehicle drives up.
    pub(super) fn too_steep(&self, sin_slope: f32) -> bool {
        sin_slope.abs() > self.sin_slope_driven
    }

    /// The excess of a slope's absolute sine over that of the steepest slope on which the vehicle can stand.
    pub(super) fn excess(&self, sin_slope: f32) -> f32 {
        sin_slope.abs() - self.sin_slope_stood
    }

    /// The largest commanded sine of the arm's angle: the working limit for accelerating, or a little more than
    /// standing at `home` needs. The result is never so large that the arm cannot stand.
    pub(super) fn most_sin_phi(&self, home: &ArmAngle<f32>) -> f32 {
        (home.sin.abs() + STANDING_LEAN).bounded(self.working_sin_phi, self.standing_sin_phi)
    }

    /// The acceleration that grip and the vehicle file leave at the landing speed `landing`. `starts` means that the
    /// vehicle has just been released and is commanded to stand.
    pub(super) fn room(&self, (sin_slope, cos_slope): (f32, f32), landing: f32, starts: bool) -> Room {
        let standing = sin_slope.abs() / cos_slope;
        let planned = self.planned_mu();
        // Where standing alone needs more than the planned share, holding has priority over the margin; speeding up has
        // not.
        let mu = (standing + STANDING_RESERVE).bounded(planned, self.grip_mu);
        let climbing = (standing + CLIMBING_RESERVE).bounded(planned, CLIMBING_SHARE * self.grip_mu);
        let uphill = if landing * sin_slope > 0.0 { climbing } else { mu };
        let (ahead, back) = if sin_slope > 0.0 { (uphill, mu) } else { (mu, uphill) };
        let share = if starts { START_SHARE } else { STEADY_SHARE };
        let bound = |room: f32| {
            room.bounded(f32::MIN, self.acceleration)
                .bounded(ACCELERATION_MIN_G, f32::MAX)
        };
        Room {
            mu,
            forward: bound(share * ahead * cos_slope - sin_slope),
            backward: bound(share * back * cos_slope + sin_slope),
        }
    }
}

/// Sine of an angle within a quarter turn.
fn sine(angle: f32) -> f32 {
    libm::sinf(angle.bounded(0.0, core::f32::consts::FRAC_PI_2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::landing::LandingLaw;
    use crate::vehicle::test_vehicle;

    /// The limits of the reference vehicle on ground with the grip `grip_mu`.
    fn limits(grip_mu: f32) -> Limits {
        let mut parameters = *test_vehicle::reference().parameters();
        parameters.control.grip_mu = grip_mu;
        let vehicle = Vehicle::new(parameters).expect("valid");
        Limits::new(&vehicle, LandingLaw::new(&vehicle, 0.001).balance(), 0.2)
    }

    /// The vehicle drives up slopes of up to 0.95 of the steepest slope that grip holds, and stands on slopes up to the
    /// steepest.
    #[test]
    fn grip_bounds_the_slopes_that_are_driven_and_stood_on() {
        let limits = limits(0.6);
        let held = libm::atanf(0.6);
        for way in [1.0, -1.0] {
            let sin = |share: f32| way * libm::sinf(share * held);
            assert!(!limits.too_steep(sin(0.94)) && limits.too_steep(sin(0.96)));
            assert!(limits.excess(sin(0.999)) < 0.0 && limits.excess(sin(1.001)) > 0.0);
        }
    }

    /// On ground with enough grip, the arm's largest standing angle bounds both slopes: alpha L sin(phi) = (1 + S)
    /// sin(beta).
    #[test]
    fn the_arm_s_weight_bounds_the_slopes_that_are_stood_on() {
        let limits = limits(1.5);
        let vehicle = test_vehicle::reference();
        let standing_rad = vehicle.parameters().safety.phi_max_rad - 0.12;
        let planar = vehicle.planar(0.0);
        let stood = planar.alpha * planar.l * libm::sinf(standing_rad) / (1.0 + vehicle.spar_mass_ratio());
        assert!(limits.excess(0.999 * stood) < 0.0 && limits.excess(1.001 * stood) > 0.0);
        assert!(limits.too_steep(1.001 * stood));
    }
}
