//! Bounds of the torque: the ground's grip, and the arm's barrier, which has priority over grip.

use super::balance::{Balance, MotionByTorque};
use crate::bounded::Bounded;

/// An interval of torques. Torques are in the torque unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Least torque.
    pub least: f32,
    /// Greatest torque.
    pub most: f32,
}

impl Interval {
    /// No bound.
    pub const ALL: Self = Self {
        least: f32::NEG_INFINITY,
        most: f32::INFINITY,
    };

    /// Whether the interval contains no torque.
    pub fn is_empty(&self) -> bool {
        self.least > self.most
    }

    /// The torque in the interval that is nearest to `torque`.
    pub fn nearest(&self, torque: f32) -> f32 {
        torque.bounded(self.least, self.most)
    }
}

/// Change of a constraint per unit of torque below which the constraint does not depend on the torque.
const INDIFFERENT: f32 = 1e-6;

/// The torques for which the wheels grip: `|F| <= mu N`. Both forces are linear in the torque, so this is an interval;
/// where no torque grips it is empty.
///
/// ```
/// use model::control::landing::{Balance, grip};
/// let vehicle = Balance { mass: 1.0_f32, alpha_l: 0.72, alpha_l2: 0.576, mu: 0.066, nu: 0.0 };
/// // With the arm hanging on the level the interval is symmetric, and at its bound the friction is mu N.
/// let motion = vehicle.motion((0.0, 1.0), 0.0, (0.0, 1.0));
/// let torques = grip(&motion, 0.6);
/// assert!((torques.least + torques.most).abs() < 1e-6);
/// assert!((motion.friction.at(torques.most) - 0.6 * motion.normal.at(torques.most)).abs() < 1e-6);
/// ```
pub fn grip(motion: &MotionByTorque<f32>, mu: f32) -> Interval {
    let mut torques = Interval::ALL;
    for side in [-1.0, 1.0] {
        // side F <= mu N, or: slope * torque <= room.
        let slope = side * motion.friction.per_torque - mu * motion.normal.per_torque;
        let room = mu * motion.normal.at_zero - side * motion.friction.at_zero;
        if slope > INDIFFERENT {
            torques.most = torques.most.bounded(f32::NEG_INFINITY, room / slope);
        } else if slope < -INDIFFERENT {
            torques.least = torques.least.bounded(room / slope, f32::INFINITY);
        }
    }
    torques
}

/// Share of the deceleration at the barrier that braking plans with. The remainder allows for the tick and for the
/// coupling on the way to the barrier.
const BRAKING_SHARE: f32 = 0.85;

/// The arm's barrier: the arm is always able to stop before `phi_max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Barrier {
    balance: Balance<f32>,
    phi_max: f32,
    arm: (f32, f32),
    torque: f32,
}

impl Barrier {
    /// A barrier at the angle `phi_max`, rad, > 0, for a vehicle whose motors give at most `torque`.
    pub fn new(balance: &Balance<f32>, phi_max: f32, torque: f32) -> Self {
        Self {
            balance: *balance,
            phi_max,
            arm: libm::sincosf(phi_max),
            torque,
        }
    }

    /// The motors' largest torque.
    pub fn torque(&self) -> f32 {
        self.torque
    }

    /// Returns `torque` within `torques`, or, if an arm that swings outwards must be stopped now, the torque that stops
    /// it.
    ///
    /// An arm at the rate phi' that decelerates with D stops after phi'^2 / (2 D). The torque is left unchanged while
    /// the arm can be stopped before `phi_max` both by the motors' torque at the barrier and by the `torques` allowed
    /// now. Otherwise the result is the torque with just sufficient deceleration, `D = phi'^2 / (2 (phi_max - |phi|))`.
    /// Beyond the barrier the result is the motors' whole torque.
    #[inline]
    pub fn guard(
        &self,
        motion: &MotionByTorque<f32>,
        (phi, phi_rate): (f32, f32),
        slope: (f32, f32),
        torque: f32,
        torques: Interval,
    ) -> f32 {
        let inside = if torques.is_empty() {
            torque
        } else {
            torques.nearest(torque)
        };
        let outwards = if phi_rate < 0.0 { -1.0 } else { 1.0 };
        if outwards * phi < 0.0 || phi_rate == 0.0 {
            return inside.bounded(-self.torque, self.torque);
        }
        let left = self.phi_max - outwards * phi;
        if left <= 0.0 {
            return -outwards * self.torque;
        }
        let needed = 0.5 * phi_rate * phi_rate / left;
        let there = self.balance.motion((outwards * self.arm.0, self.arm.1), 0.0, slope);
        let possible_there = -BRAKING_SHARE * outwards * there.arm.at(-outwards * self.torque);
        // The deceleration is greatest at the end of the interval that pulls against the swing.
        let pulling = if outwards > 0.0 { torques.least } else { torques.most };
        let possible = -outwards * motion.arm.at(pulling);
        if !torques.is_empty() && possible >= needed && possible_there >= needed {
            return inside.bounded(-self.torque, self.torque);
        }
        let stopping = motion.arm.solve(-outwards * needed);
        let within = if outwards > 0.0 {
            inside.bounded(f32::MIN, stopping)
        } else {
            inside.bounded(stopping, f32::MAX)
        };
        within.bounded(-self.torque, self.torque)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    const VEHICLE: Balance<f32> = Balance {
        mass: 1.3,
        alpha_l: 0.72,
        alpha_l2: 0.576,
        mu: 0.066,
        nu: 0.0583,
    };

    proptest! {
        /// Inside the interval the wheels grip and stay on the ground; outside the interval they do not grip.
        #[test]
        fn the_wheels_grip_inside_the_interval_only(
            phi in -1.4_f32..1.4, phi_rate in -3.0_f32..3.0, beta in -0.5_f32..0.5, mu in 0.2_f32..1.0, at in 0.0_f32..1.0,
        ) {
            let motion = VEHICLE.motion(libm::sincosf(phi), phi_rate, libm::sincosf(beta));
            let torques = grip(&motion, mu);
            prop_assume!(!torques.is_empty() && torques.most - torques.least < 1e3);
            let room = |torque: f32| mu * motion.normal.at(torque) - motion.friction.at(torque).abs();
            let width = torques.most - torques.least;
            prop_assert!(room(torques.least + at * width) > -1e-3);
            // And the ground carries the vehicle.
            prop_assert!(motion.normal.at(torques.least + at * width) > -1e-3);
            prop_assert!(room(torques.least - 0.1) < 0.0 || room(torques.most + 0.1) < 0.0);
        }

        /// A torque that grips with the planned share of the friction also grips with the whole friction on a slope
        /// whose estimate is wrong by up to 5 deg.
        #[test]
        fn the_planned_share_of_grip_covers_a_wrong_slope(
            phi in -1.2_f32..1.2, phi_rate in -2.0_f32..2.0, beta in -0.35_f32..0.35, wrong in -0.087_f32..0.087,
            mu in 0.2_f32..1.0, at in 0.0_f32..1.0,
        ) {
            let estimated = VEHICLE.motion(libm::sincosf(phi), phi_rate, libm::sincosf(beta + wrong));
            let torques = grip(&estimated, 0.75 * mu);
            prop_assume!(!torques.is_empty() && torques.most - torques.least < 1e3);
            let torque = torques.least + at * (torques.most - torques.least);
            let motion = VEHICLE.motion(libm::sincosf(phi), phi_rate, libm::sincosf(beta));
            prop_assert!(motion.friction.at(torque).abs() <= mu * motion.normal.at(torque) + 1e-3);
        }

        /// With the barrier's torque an arm that can be stopped stops before the barrier. This also holds on a slope
        /// whose estimate is wrong by up to 17 deg, because every tick computes the required deceleration anew.
        #[test]
        fn an_arm_that_can_be_stopped_stops_before_the_barrier(
            phi in 0.0_f32..1.2, phi_rate in 0.0_f32..3.0, beta in -0.3_f32..0.3, wrong in -0.3_f32..0.3,
            wanted in -1.0_f32..1.0,
        ) {
            let limit = 2.5_f32;
            let barrier = Barrier::new(&VEHICLE, 1.35, limit);
            let (slope, estimated) = (libm::sincosf(beta), libm::sincosf(beta + wrong));
            let (mut phi, mut rate) = (phi, phi_rate);
            // Only starts from which the torque limit stops the arm with room to spare. The test uses the least
            // deceleration on the way, because the centripetal force and the coupling change the deceleration.
            let deceleration = (0..=20).fold(f32::INFINITY, |least, k| {
                let at = phi + 0.05 * k as f32 * (barrier.phi_max - phi);
                let fastest = -VEHICLE.motion(libm::sincosf(at), rate, slope).arm.at(-limit);
                let slowest = -VEHICLE.motion(libm::sincosf(at), 0.0, slope).arm.at(-limit);
                least.min(fastest).min(slowest)
            });
            prop_assume!(deceleration > 0.0 && phi + 0.5 * rate * rate / (0.8 * deceleration) < barrier.phi_max);
            for _ in 0..20_000 {
                let motion = VEHICLE.motion(libm::sincosf(phi), rate, estimated);
                let torque = barrier.guard(&motion, (phi, rate), estimated, wanted, grip(&motion, 0.45));
                rate += 0.001 * VEHICLE.motion(libm::sincosf(phi), rate, slope).arm.at(torque);
                phi += 0.001 * rate;
                prop_assert!(phi < barrier.phi_max + 0.01, "{phi} {rate}");
                if rate <= 0.0 {
                    break;
                }
            }
        }
    }

    #[test]
    fn without_a_swing_the_barrier_changes_nothing() {
        let motion = VEHICLE.motion(libm::sincosf(0.5), 0.0, (0.0, 1.0));
        let barrier = Barrier::new(&VEHICLE, 1.3, 2.5);
        let level = (0.0, 1.0);
        assert_eq!(barrier.guard(&motion, (0.5, 0.0), level, 0.3, Interval::ALL), 0.3);
        // A fast arm beyond the barrier gets the motors' whole torque against its swing.
        assert_eq!(barrier.guard(&motion, (1.31, 1.0), level, 0.3, Interval::ALL), -2.5);
        assert_eq!(barrier.guard(&motion, (-1.31, -1.0), level, 0.3, Interval::ALL), 2.5);
    }
}
