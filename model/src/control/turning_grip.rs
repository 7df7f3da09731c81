//! The grip that the ground leaves for a turn.
//!
//! Grip is one budget: the forces that change the speed, hold the vehicle on its slope and turn it must together lie
//! within `mu N`. A turn needs the acceleration `v psi'` across the heading. The turn passes through every heading of
//! the plane; at one heading the whole slope adds to this acceleration. The vehicle therefore holds a turn while
//!
//! ```text
//! |v psi'| <= g (mu cos(steepness) - sin(steepness))
//! ```
//!
//! with the steepness of the plane itself, whichever way the vehicle faces. Speed has priority over the turn. A stop
//! needs its grip at once, and so does the arm, which only the wheels' grip holds up. A yaw rate can be reduced within
//! some tenths of a second, but a speed only by braking, which uses the same grip. So the law reduces the yaw rate, and
//! the vehicle turns in a wider arc. The yaw rate never becomes 0: on the spot every slope allows a turn.

use super::landing::{GRIP_SHARE, STEADY_SHARE};
use crate::bounded::Bounded;
use crate::vehicle::{G, Vehicle};

/// Largest share of the configured grip that a turn may use. Forces along and across the heading add as the sides of a
/// right angle: nine tenths across leave 0.44 along.
const TURN_SHARE: f32 = 0.9;
/// Share of the configured grip that the law's planned acceleration uses.
const ACCELERATION_SHARE: f32 = GRIP_SHARE * STEADY_SHARE;
/// Acceleration across the heading that is always allowed, g: the vehicle turns on every slope.
const LATERAL_MIN_G: f32 = 0.02;
/// Least sine of the steepness that the law computes with; a smaller sine counts as level.
const STEEP_MIN: f32 = 0.01;
/// Upper bound of (1 - cosine) per square of the sine, up to a sine of 0.6, where no grip is left for a turn.
const COSINE_LOSS: f32 = 0.56;

/// The ground and the speed over it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurningGround {
    /// Sine of the slope.
    pub sin_slope: f32,
    /// Sine of the axle's roll.
    pub sin_roll: f32,
    /// The larger of the absolute speed and the absolute reference, m/s.
    pub speed_m_s: f32,
}

/// Bounds the yaw rate by the grip that is left for a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurningGrip {
    /// Largest friction coefficient that a turn may use.
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
            mu: square_root::sqrtf(mu * mu - along * along).bounded(0.0, TURN_SHARE * mu),
            steep: STEEP_MIN,
        }
    }

    /// The yaw rate nearest to `wanted_rad_s` that grip allows, rad/s. To be called once per tick.
    #[inline]
    pub fn yaw_rate_rad_s(&mut self, wanted_rad_s: f32, ground: &TurningGround) -> f32 {
        // The square root, by one Newton step per tick.
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

    /// The bound of a vehicle with `grip_mu` and `acceleration_max_m_s2`, once the bound has settled on its ground.
    fn bounded(grip_mu: f32, acceleration_m_s2: f32, wanted_rad_s: f32, ground: &TurningGround) -> f32 {
        let mut parameters = *test_vehicle::reference().parameters();
        parameters.control.grip_mu = grip_mu;
        parameters.control.acceleration_max_m_s2 = acceleration_m_s2;
        let vehicle = Vehicle::new(parameters).expect("valid");
        let mut grip = TurningGrip::new(&vehicle);
        (0..50).fold(0.0, |_, _| grip.yaw_rate_rad_s(wanted_rad_s, ground))
    }

    proptest! {
        /// Wherever more than the least turn is allowed, turn, slope and the file's acceleration together need no more
        /// than the configured grip at any heading of the plane. The tolerance is 4 %, because the acceleration's share
        /// is computed for the level. The bound also uses the whole share of grip that it may use.
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
                // Along the heading: the file's acceleration, within the law's planned share.
                let along_g = (acceleration_m_s2 / G).min(ACCELERATION_SHARE * held_g);
                let asked_g = libm::hypotf(along_g, across_g.abs() + steep);
                prop_assert!(asked_g <= 1.04 * held_g, "{asked_g} of {held_g}");
                prop_assert!(across_g.abs() + steep <= held_g, "{across_g} and {steep} of {held_g}");
            }
            if yaw_rad_s != wanted_rad_s {
                let along_share = ((acceleration_m_s2 / G) / grip_mu).min(ACCELERATION_SHARE);
                let share = square_root::sqrtf(1.0 - along_share * along_share).min(TURN_SHARE);
                prop_assert!(across_g.abs() >= share * held_g - steep.max(STEEP_MIN) - 0.01 * grip_mu, "{across_g}");
                prop_assert!(across_g.abs() >= LATERAL_MIN_G - 1e-4);
            }
        }
    }

    /// The reference file's 2 rad/s at 2.5 m/s need 0.51 g of 0.54; on the spot a turn needs no grip, however steep the
    /// slope.
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
