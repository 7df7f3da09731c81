//! The wheels' paths over the ground: positions and directions of the contacts.

use super::ldl::Speeds;
use super::{AxleRoll, Body, FORWARD, LEFT, LIFT, RIGHT, SIDE, YAW};
use crate::terrain::Ground;

/// Left and right: index of the wheel, and which way the yaw rate moves it.
const SIDES: [(usize, f64); 2] = [(LEFT, -1.0), (RIGHT, 1.0)];

/// Geometry of the left and the right contact in one substep.
pub(super) struct Contacts {
    /// Rise of each path along the heading, the cosine of the path's angle, and the cosine's
    /// reciprocal.
    tangent: [f64; 2],
    cosine: [f64; 2],
    pub(super) secant: [f64; 2],
    /// Mean rise of the paths to the left.
    side: f64,
    half_track: f64,
    pub(super) radii: [f64; 2],
    /// Friction coefficients.
    pub(super) friction: [f64; 2],
    /// Mean height of the paths.
    pub(super) height: f64,
    /// Whether neither path rises.
    pub(super) level: bool,
}

impl Contacts {
    /// Row of a wheel's longitudinal slip over the speeds.
    pub(super) fn roll(&self, i: usize) -> [(usize, f64); 4] {
        let (wheel, sign) = SIDES[i];
        let cosine = self.cosine[i];
        [
            (FORWARD, cosine),
            (LIFT, self.tangent[i] * cosine),
            (YAW, sign * self.half_track * cosine),
            (wheel, -self.radii[i]),
        ]
    }

    /// Longitudinal slips at the speeds `u`.
    #[inline]
    pub(super) fn slips(&self, u: &Speeds) -> [f64; 2] {
        core::array::from_fn(|i| {
            let (wheel, sign) = SIDES[i];
            let along = u[FORWARD] + self.tangent[i] * u[LIFT] + sign * self.half_track * u[YAW];
            self.cosine[i] * along - self.radii[i] * u[wheel]
        })
    }

    /// Row of the axle's speed off its path over the speeds.
    pub(super) fn normal(&self) -> [(usize, f64); 4] {
        let [left, right] = self.tangent;
        [
            (FORWARD, -0.5 * (right + left)),
            (SIDE, self.side),
            (LIFT, 1.0),
            (YAW, -0.5 * self.half_track * (right - left)),
        ]
    }
}

impl Body {
    /// Geometry of the contacts at the end of the step, as predicted from the old speeds.
    #[inline]
    pub(super) fn contacts(&mut self, h: f64, ground: &Ground, (sin, cos): (f64, f64)) -> Contacts {
        let (u, d) = (&self.speed, self.inertia.half_track);
        let half_difference = 0.5 * self.inertia.radius_difference;
        let x = self.position[FORWARD] + h * (u[FORWARD] * cos - u[SIDE] * sin);
        // Heading at the end, to first order in the turn.
        let reach = d * (sin + 0.5 * h * u[YAW] * cos);
        let wheel_x = [x - reach, x + reach];
        let paths = wheel_x.map(|x| ground.wheel(x));
        let tangent = paths.map(|path| path.slope * cos);
        let level = paths.iter().all(|path| path.slope == 0.0);
        let secant = if level {
            [1.0; 2]
        } else {
            tangent.map(|tangent| (1.0 + tangent * tangent).sqrt())
        };
        self.slope = tangent;
        let (gravity, sin_roll) = self.gravity_at(ground, (sin, cos), paths.map(|path| path.height_m));
        self.gravity = gravity;
        self.axle_roll = AxleRoll {
            sin: sin_roll,
            rate: (sin_roll - self.axle_roll.sin) / h,
        };
        Contacts {
            tangent,
            cosine: secant.map(|secant| 1.0 / secant),
            secant,
            side: 0.5 * (paths[0].slope + paths[1].slope) * sin,
            half_track: d,
            radii: [
                self.inertia.radius + half_difference,
                self.inertia.radius - half_difference,
            ],
            friction: [ground.friction_left(wheel_x[0]), ground.friction_right(wheel_x[1])],
            height: 0.5 * (paths[0].height_m + paths[1].height_m),
            level,
        }
    }
}
