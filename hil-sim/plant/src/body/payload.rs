//! A load on the arm.

use super::{Body, PHI};

/// A point mass fixed to the arm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Payload {
    /// Mass, in kg.
    pub mass_kg: f64,
    /// Distance ahead of the arm's axis, in m.
    pub ahead_m: f64,
    /// Distance below the axle, in m.
    pub below_m: f64,
}

impl Body {
    /// Fixes a payload to the moving arm in place of the present payload; mass 0 removes the payload.
    ///
    /// The swing of the arm with its load is exact for the two masses. For the yaw inertia both count as
    /// one second moment about the axle, at the angle of their common centre of mass. The error is of the
    /// order of the square of the load's distance from the arm's axis.
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
