//! Obstacles: whether the vehicle pushes against something that does not move, and how hard it may.

/// A vehicle that pushes and moves by less than this distance, m, in the time STUCK_TIME (in time units) is stuck.
const STUCK_M: f32 = 0.01;
/// Speed, nondimensional, that a vehicle lacks when it pushes.
const MISSING: f32 = 0.02;
const STUCK_TIME: f32 = 2.0;
/// Time after which a stuck vehicle gives up to push hard, in time units.
const PUSH_TIME: f32 = 14.0;
/// Acceleration, g, whose arm angle a stuck vehicle takes: pushing hard, and after it has given up. The latter keeps the
/// motors cool.
const PUSH_HARD_G: f32 = 0.9;
const PUSH_ON_G: f32 = 0.3;

/// Speed by which a vehicle that pushes hard may come off its obstacle faster than commanded, nondimensional.
const PUSH_EXCESS: f32 = 0.25;

/// Whether the vehicle pushes against something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Push {
    /// It moves, or it does not push.
    None,
    /// It pushes and has not moved yet: perhaps it is about to.
    Perhaps,
    /// It pushes and does not move.
    Stuck,
}

/// Whether the vehicle pushes against something that does not move, and for how long, in time units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Obstacle {
    direction: f32,
    time: f32,
    place_m: f32,
}

impl Obstacle {
    /// `missing` is the speed that the vehicle lacks.
    pub(super) fn update(&mut self, missing: f32, distance_m: f32, tick: f32) {
        let direction = if missing > MISSING {
            1.0
        } else if missing < -MISSING {
            -1.0
        } else {
            0.0
        };
        if direction == 0.0 || direction != self.direction || (distance_m - self.place_m).abs() > STUCK_M {
            *self = Self {
                direction,
                time: 0.0,
                place_m: distance_m,
            };
        } else {
            self.time += tick;
        }
    }

    pub(super) fn push(&self) -> Push {
        if self.time > STUCK_TIME {
            Push::Stuck
        } else if self.direction != 0.0 {
            Push::Perhaps
        } else {
            Push::None
        }
    }

    /// The landing speed beyond the reference that a stuck vehicle may reach, nondimensional.
    pub(super) fn excess(&self) -> f32 {
        self.direction * PUSH_EXCESS
    }

    /// The acceleration whose arm angle a stuck vehicle takes at most, g.
    pub(super) fn effort(&self) -> f32 {
        if self.time < PUSH_TIME { PUSH_HARD_G } else { PUSH_ON_G }
    }
}
