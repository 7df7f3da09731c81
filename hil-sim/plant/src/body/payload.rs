//! A load on the arm.

use super::{Body, PHI};

/// A point mass fixed to the arm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Payload {
    /// Mass, in kg.
    pub mass_kg: f64,
    /// How far ahead of the arm's axis it sits, in m.
    pub ahead_m: f64,
    /// How far below the axle it sits, in m.
    pub below_m: f64,
}

impl Body {
    /// Puts a payload onto the arm, moving with it, in place of the one there; mass 0 takes it off.
    ///
    /// The arm with its load swings exactly as the two masses do. In yaw both count as one second moment
    /// about the axle at the angle of their common centre of mass, which differs by the square of how far
    /// the load sits beside the arm's axis.
    pub fn set_payload(&mut self, payload: Payload) {
        let (old, new) = (self.payload, payload);
        self.payload = payload;
        let i = &mut self.inertia;
        let second = |p: Payload| p.mass_kg * (p.ahead_m * p.ahead_m + p.below_m * p.below_m);
        let (sin, cos) = (libm::sin(i.arm_offset), libm::cos(i.arm_offset));
        let below = i.arm_first * cos - old.mass_kg * old.below_m + new.mass_kg * new.below_m;
        let ahead = i.arm_first * sin - old.mass_kg * old.ahead_m + new.mass_kg * new.ahead_m;
        i.total_mass += new.mass_kg - old.mass_kg;
        i.arm_mass += new.mass_kg - old.mass_kg;
        i.arm_second += second(new) - second(old);
        i.arm_first = (below * below + ahead * ahead).sqrt();
        i.arm_offset = libm::atan2(ahead, below);
    }

    /// The payload on the arm.
    pub fn payload(&self) -> Payload {
        self.payload
    }

    /// Angle of the arm's centre of mass from the plane's normal.
    pub fn arm_mass_angle(&self) -> f64 {
        self.position[PHI] + self.inertia.arm_offset
    }
}
