//! What the ground's grip leaves to a turn.
//!
//! Grip has one budget: what speeds the vehicle up and slows it down, what holds it on its slope and what turns it must
//! together lie within `mu N`. A turn asks for the acceleration `v psi'` across the heading, and takes it to every heading of
//! the plane in turn: there is one at which the slope adds all of itself to it. The vehicle therefore holds a turn while
//!
//! ```text
//! |v psi'| <= g (mu cos(steepness) - sin(steepness))
//! ```
//!
//! with the steepness of the plane itself, whichever way the vehicle faces. Speed goes before the turn: a stop needs its grip at
//! once, and so does the arm, which nothing but the wheels' grip holds up; and a yaw rate can yield within some tenths of a
//! second, while a speed yields by braking only, which takes of the same grip. So the yaw rate yields, and the way becomes wider.
//! It never yields altogether: on the spot every slope leaves a turn.

use super::landing::{GRIP_SHARE, STEADY_SHARE};
use crate::bounded::Bounded;
use crate::vehicle::{G, Vehicle};

/// Share of the configured grip that a turn takes at most. Forces along and across add up as the sides of a right angle: nine
/// tenths across leave 0.44 along.
const TURN_SHARE: f32 = 0.9;
/// Share of the configured grip that the acceleration takes which the law plans with.
const ACCELERATION_SHARE: f32 = GRIP_SHARE * STEADY_SHARE;
/// Acceleration across the heading that is always allowed, g: the vehicle turns on every slope.
const LATERAL_MIN_G: f32 = 0.02;
/// Least sine of the steepness that is reckoned with: the level.
const STEEP_MIN: f32 = 0.01;
/// What the cosine loses at most per square of the sine, up to a sine of 0.6, where nothing is left for a turn.
const COSINE_LOSS: f32 = 0.56;

/// The ground and how fast it passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurningGround {
    /// Sine of the slope.
    pub sin_slope: f32,
    /// Sine of the axle's roll.
    pub sin_roll: f32,
    /// The larger of the speed and its reference, m/s, without their signs.
    pub speed_m_s: f32,
}

/// Bounds the yaw rate by what grip leaves to a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurningGrip {
    /// Friction coefficient that a turn takes at most.
    mu: f32,
    /// Sine of the plane's steepness.
    steep: f32,
}

impl TurningGrip {
    /// The bound for `vehicle`.
    pub fn new(vehicle: &Vehicle<f32>) -> Self {
        let control = &vehicle.parameters().control;
        let mu = control.grip_mu;
        let along = (control.acceleration_max_m_s2 / G).bounded(0.0, ACCELERATION_SHARE * mu);
        Self {
            mu: libm::sqrtf(mu * mu - along * along).bounded(0.0, TURN_SHARE * mu),
            steep: STEEP_MIN,
        }
    }

    /// The yaw rate that is nearest to `wanted_rad_s` within grip, rad/s. One call a tick.
    #[inline]
    pub fn yaw_rate_rad_s(&mut self, wanted_rad_s: f32, ground: &TurningGround) -> f32 {
        // The square root, by one step of Newton's a tick.
        let square = ground.sin_slope * ground.sin_slope + ground.sin_roll * ground.sin_roll;
        self.steep = (0.5 * (self.steep + square / self.steep)).bounded(STEEP_MIN, 1.0);
        let left_g = self.mu * (1.0 - COSINE_LOSS * square) - self.steep;
        let most_m_s2 = G * left_g.bounded(LATERAL_MIN_G, f32::MAX);
        if ground.speed_m_s * wanted_rad_s.abs() <= most_m_s2 {
            return wanted_rad_s;
        }
        let most_rad_s = most_m_s2 / ground.speed_m_s;
        wanted_rad_s.bounded(-most_rad_s, most_rad_s)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::vehicle::test_vehicle;

    /// The bound of a vehicle with `grip_mu` and `acceleration_max_m_s2`, once it knows its ground.
    fn bounded(grip_mu: f32, acceleration_m_s2: f32, wanted_rad_s: f32, ground: &TurningGround) -> f32 {
        let mut parameters = *test_vehicle::reference().parameters();
        parameters.control.grip_mu = grip_mu;
        parameters.control.acceleration_max_m_s2 = acceleration_m_s2;
        let vehicle = Vehicle::new(parameters).expect("valid");
        let mut grip = TurningGrip::new(&vehicle);
        (0..50).fold(0.0, |_, _| grip.yaw_rate_rad_s(wanted_rad_s, ground))
    }

    proptest! {
        /// At every heading of the plane the friction that turn, slope and the file's acceleration ask for together is within the
        /// configured grip, wherever more than the least turn is allowed: to 4 %, because the share that the acceleration is
        /// reckoned with is that of the level. And the bound is as good as the share of the grip that it is made of.
        #[test]
        fn a_turn_is_held_at_every_heading_of_its_plane(
            slope in 0.0_f32..0.5, facing in -3.2_f32..3.2, grip_mu in 0.3_f32..1.0, acceleration_m_s2 in 0.5_f32..2.5,
            speed_m_s in 0.1_f32..2.5, wanted_rad_s in -20.0_f32..20.0,
        ) {
            let steep = libm::sinf(slope);
            let ground = TurningGround {
                sin_slope: steep * libm::cosf(facing), sin_roll: steep * libm::sinf(facing), speed_m_s,
            };
            let yaw_rad_s = bounded(grip_mu, acceleration_m_s2, wanted_rad_s, &ground);
            prop_assert!(yaw_rad_s * wanted_rad_s >= 0.0 && yaw_rad_s.abs() <= wanted_rad_s.abs());
            let across_g = speed_m_s * yaw_rad_s / G;
            let held_g = grip_mu * libm::cosf(slope);
            if across_g.abs() > LATERAL_MIN_G + 1e-4 {
                // Along: the file's acceleration, as far as the law plans with it.
                let along_g = (acceleration_m_s2 / G).min(ACCELERATION_SHARE * held_g);
                let asked_g = libm::hypotf(along_g, across_g.abs() + steep);
                prop_assert!(asked_g <= 1.04 * held_g, "{asked_g} of {held_g}");
                prop_assert!(across_g.abs() + steep <= held_g, "{across_g} and {steep} of {held_g}");
            }
            if yaw_rad_s != wanted_rad_s {
                let along_share = ((acceleration_m_s2 / G) / grip_mu).min(ACCELERATION_SHARE);
                let share = libm::sqrtf(1.0 - along_share * along_share).min(TURN_SHARE);
                prop_assert!(across_g.abs() >= share * held_g - steep.max(STEEP_MIN) - 0.01 * grip_mu, "{across_g}");
                prop_assert!(across_g.abs() >= LATERAL_MIN_G - 1e-4);
            }
        }
    }

    /// The reference file's 2 rad/s at 2.5 m/s need 0.51 g of 0.54; on the spot nothing is asked of grip, however steep.
    #[test]
    fn the_file_s_own_turn_is_left_alone_on_the_level_and_any_turn_on_the_spot() {
        let ground = |sin_slope, speed_m_s| TurningGround {
            sin_slope,
            sin_roll: 0.0,
            speed_m_s,
        };
        assert_eq!(bounded(0.6, 2.0, 2.0, &ground(0.0, 2.5)), 2.0);
        assert_eq!(bounded(0.6, 2.0, -2.0, &ground(0.5, 0.0)), -2.0);
        let steep = bounded(0.6, 2.0, 2.0, &ground(0.342, 2.5));
        assert!((0.6..0.7).contains(&steep), "{steep} rad/s");
    }
}
