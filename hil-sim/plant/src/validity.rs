//! The range in which the plant's equations are valid. The plant stops simulating a vehicle that leaves
//! this range.

use thiserror::Error;

use super::Plant;
use super::body::{BALLAST, FORWARD, LEFT, LIFT, PHI, RIGHT, SIDE, SPAR, YAW};

/// Largest magnitude of each of the axle's speeds, in m/s.
pub const SPEED_MAX_M_S: f64 = 100.0;
/// Largest magnitude of the rates of arm, spar and heading, in rad/s: 80 turns per second, with about
/// 12 substeps of 1 ms per turn.
pub const BODY_RATE_MAX_RAD_S: f64 = 500.0;
/// Largest magnitude of the rates of wheels and ballast, in rad/s: about two turns per substep of 1 ms.
pub const WHEEL_RATE_MAX_RAD_S: f64 = 12_500.0;
/// Largest magnitude of the arm's angle from the plane's normal, in rad: 100 turns.
pub const ARM_ANGLE_MAX_RAD: f64 = 628.0;
/// Largest magnitude of the battery's terminal voltage, in V.
pub const BATTERY_MAX_V: f64 = 1000.0;

/// A quantity that left the range in which the plant's equations are valid, or is NaN.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error(
    "the simulated vehicle left the plant's validity {time_s:.3} s after the start: \
     {quantity} = {value}, allowed is -{most} to {most}"
)]
pub struct Invalid {
    /// Time of the event, in s since the plant's start.
    pub time_s: f64,
    /// The quantity, with its unit.
    pub quantity: &'static str,
    /// Its value.
    pub value: f64,
    /// The largest allowed magnitude.
    pub most: f64,
}

impl Plant {
    /// Whether the plant still simulates. Once invalid, the plant no longer changes.
    ///
    /// # Errors
    /// [`Invalid`]: the first quantity that left its range.
    pub fn validity(&self) -> Result<(), Invalid> {
        match self.invalid {
            None => Ok(()),
            Some(invalid) => Err(invalid),
        }
    }

    /// Checks the last substep.
    #[inline]
    pub(super) fn watch_validity(&mut self) {
        let (q, u) = (self.body.position(), self.body.speed());
        // The usual case, far within the range: one comparison, which NaN fails.
        let speeds: f64 = u.iter().map(|u| u * u).sum();
        let far_within = speeds < SPEED_MAX_M_S * SPEED_MAX_M_S
            && q[PHI].abs() < ARM_ANGLE_MAX_RAD
            && self.battery_v.abs() < BATTERY_MAX_V;
        if !far_within {
            self.look_closely();
        }
    }

    /// Stores the first quantity that is out of its range.
    #[cold]
    fn look_closely(&mut self) {
        let (q, u) = (self.body.position(), self.body.speed());
        let watched = [
            ("speed_m_s", u[FORWARD], SPEED_MAX_M_S),
            ("side speed_m_s", u[SIDE], SPEED_MAX_M_S),
            ("vertical speed_m_s", u[LIFT], SPEED_MAX_M_S),
            ("yaw_rate_rad_s", u[YAW], BODY_RATE_MAX_RAD_S),
            ("phi_rate_rad_s", u[PHI], BODY_RATE_MAX_RAD_S),
            ("phi_rad", q[PHI], ARM_ANGLE_MAX_RAD),
            ("spar_rate_rad_s", u[SPAR], BODY_RATE_MAX_RAD_S),
            ("ballast_rate_rad_s", u[BALLAST], WHEEL_RATE_MAX_RAD_S),
            ("left wheel_rate_rad_s", u[LEFT], WHEEL_RATE_MAX_RAD_S),
            ("right wheel_rate_rad_s", u[RIGHT], WHEEL_RATE_MAX_RAD_S),
            ("battery_v", self.battery_v, BATTERY_MAX_V),
        ];
        let left = watched
            .iter()
            .find(|(_, value, most)| value.is_nan() || value.abs() > *most);
        self.invalid = left.map(|&(quantity, value, most)| Invalid {
            time_s: self.time_s,
            quantity,
            value,
            most,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motor::BridgeState;
    use crate::terrain::Terrain;
    use crate::tests::{SCALES, reference_vehicle};

    #[test]
    fn a_plant_beyond_its_range_stops_and_says_why() {
        let new = || Plant::new(&reference_vehicle(), &SCALES, Terrain::default(), 1).expect("a plant");
        for (index, value, quantity) in [
            (FORWARD, 101.0, "speed_m_s"),
            (SPAR, 700.0, "spar_rate_rad_s"),
            (PHI, f64::NAN, "speed_m_s"),
        ] {
            let mut plant = new();
            plant.advance(1e-3, &[BridgeState::Open; 3]);
            assert_eq!(plant.validity(), Ok(()));
            plant.body_mut().state_mut().1[index] = value;
            plant.advance(1e-3, &[BridgeState::Open; 3]);
            let invalid = plant.validity().expect_err(quantity);
            assert_eq!(invalid.quantity, quantity);
            let message = invalid.to_string();
            assert!(
                message.contains("0.002 s") && message.contains("allowed is -"),
                "{message}"
            );
            let stands = plant.time_s();
            plant.advance(1e-3, &[BridgeState::Open; 3]);
            assert_eq!(plant.time_s(), stands, "it is simulated no further");
        }
    }
}
