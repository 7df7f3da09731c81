//! Obstacles: whether the vehicle pushes against something immovable, and how hard the vehicle may push.

use super::attempts::Attempts;
use crate::bounded::Bounded;

/// Advance, m, that counts as progress. A way back of this length is more than a rebound.
const PROGRESS_M: f32 = 0.01;
const RETREAT_M: f32 = 0.03;
/// Rate, in wheel radii per time unit, at which a vehicle seems to move while it stands: that of a gyro's bias of 0.7 deg/s
/// on the reference vehicle. A vehicle that pushes for half a minute would otherwise seem to retreat.
const SEEMING: f32 = 0.002;
/// Share of the commanded speed above which the vehicle counts as moving.
const CLIMBS_SHARE: f32 = 0.5;
/// Nondimensional speed above which a command counts as a command to move.
const TOLD: f32 = 0.03;
/// Commanded nondimensional speed below which a vehicle creeps up an obstacle; a faster vehicle hits the obstacle.
const CREEPING: f32 = 0.5;
/// Unforeseen loss of nondimensional speed when the wheels hit something: the observer's jolt. A hill's foot causes a
/// smaller loss, because the observer learns the slope meanwhile.
const BLOW: f32 = 0.1;
/// Distance, in wheel radii, over which the wheels climb what they have hit: sqrt(2 h) for an edge h radii high, here
/// 0.18.
const CLIMB: f32 = 0.6;
/// Time, in time units, after which the observer mistakes the obstruction for a slope: three time constants of its pole.
const HELD_TIME: f32 = 1.0;
/// Shortfall of nondimensional speed from which the vehicle counts as pushing.
const MISSING: f32 = 0.02;
/// Time without progress, in time units, after which a vehicle counts as stuck; the time of a start is added.
const STUCK_TIME: f32 = 2.0;
/// Share of the time until a vehicle counts as stuck. A vehicle that is commanded to turn back after this share was
/// stuck too: by then the observer has mistaken the push of the arm for a hill.
const TURNED_BACK_SHARE: f32 = 0.5;
/// Nondimensional speed by which a vehicle that pushed hard may leave its obstacle faster than commanded.
const PUSH_EXCESS: f32 = 0.25;

/// Whether the vehicle pushes against something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum PushState {
    /// The vehicle moves, or does not push.
    #[default]
    None,
    /// The vehicle is commanded to drive and moves at less than half of that speed. Perhaps the vehicle is starting,
    /// perhaps something stops it.
    Perhaps,
    /// The same for a vehicle that is commanded to move slowly. Perhaps the vehicle creeps up a kerb.
    Creeps,
    /// The vehicle pushes and does not move.
    Stuck,
    /// The vehicle moves as commanded again after an obstacle had held up its wheels.
    Freed,
}

/// The command and the motion of one tick, nondimensional except for the distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Told {
    /// The speed that the operator wants, the reference on its way to that speed, the wheels' present speed, and the
    /// part of the wheels' speed that the model did not foresee.
    pub(super) speed: f32,
    pub(super) reference: f32,
    pub(super) wheels: f32,
    pub(super) unforeseen: f32,
    /// The largest acceleration of a start, g, and the smoothing time of the command, in time units.
    pub(super) acceleration: f32,
    pub(super) lag: f32,
    /// Distance driven, m.
    pub(super) distance_m: f32,
}

/// The obstacle that the wheels have hit in one direction of driving.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Blow {
    /// Place, m, of the obstacle that the wheels have not yet passed, and the time for which it has held up the vehicle.
    struck_m: Option<f32>,
    held: f32,
    /// The vehicle came free in this tick.
    freed: bool,
    /// Place where the vehicle last came free, m. There the forgotten slope would look like another blow.
    freed_m: Option<f32>,
}

/// Whether wheels of the radius `length_m` that roll in this direction still climb what they met at `place_m`.
#[inline]
fn is_on_it(direction: f32, place_m: f32, told: &Told, length_m: f32) -> bool {
    direction * (told.distance_m - place_m) < CLIMB * length_m
}

impl Blow {
    /// Whether an update is necessary, which is seldom the case.
    #[inline]
    fn concerns(&self, direction: f32, told: &Told) -> bool {
        direction * told.unforeseen < -BLOW || self.struck_m.is_some() || self.freed
    }

    /// One tick on the way in this direction, for wheels of the radius `length_m`.
    #[inline(never)]
    fn update(&mut self, direction: f32, moves: bool, told: &Told, tick: f32, length_m: f32) {
        let struck = direction * told.unforeseen < -BLOW;
        self.freed = false;
        let on_it = |place_m: &f32| is_on_it(direction, *place_m, told, length_m);
        self.struck_m = if self.freed_m.is_some_and(|place_m| on_it(&place_m)) {
            None
        } else if struck {
            Some(told.distance_m)
        } else {
            self.struck_m.filter(on_it)
        };
        if self.struck_m.is_some() && moves && self.held > HELD_TIME {
            self.freed = true;
            self.freed_m = Some(told.distance_m);
        }
        self.held = if self.struck_m.is_some() && !moves {
            self.held + tick
        } else {
            0.0
        };
    }
}

/// Whether the vehicle pushes against something immovable, and for how long, in time units. A vehicle that bounces off
/// an obstacle again and again is stuck as well, because it makes no progress.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Obstacle {
    direction: f32,
    /// The vehicle moves at no less than a share of the commanded speed.
    moves: bool,
    /// The vehicle is commanded to move slowly.
    creeps: bool,
    blow: Blow,
    /// The result of the last tick.
    push: PushState,
    /// The wheels move, and are still at the place where they last came free.
    just_free: bool,
    time: f32,
    /// Time that a start may take.
    start: f32,
    /// The furthest place that the vehicle has reached, m.
    furthest_m: f32,
    attempts: Attempts,
}

impl Obstacle {
    /// One tick, for wheels of the radius `length_m`.
    // Inlined on the host, like the law's other parts.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub(super) fn update(&mut self, told: &Told, tick: f32, length_m: f32) {
        self.follow(told, tick, length_m);
        self.push = self.found();
        self.just_free = self.moves
            && self
                .blow
                .freed_m
                .is_some_and(|place_m| is_on_it(self.direction, place_m, told, length_m));
    }

    #[inline]
    fn follow(&mut self, told: &Told, tick: f32, length_m: f32) {
        let mut stuck = self.push == PushState::Stuck;
        if self.direction * told.speed < -TOLD && self.time > TURNED_BACK_SHARE * self.stuck_time() {
            self.time = self.time.bounded(self.stuck_time() + tick, f32::MAX);
            stuck = true;
        }
        // A stuck vehicle that is commanded to back off first lowers its arm and keeps pushing meanwhile.
        let direction = if stuck && self.direction * (told.reference - told.wheels) > MISSING {
            self.direction
        } else if told.speed > TOLD {
            1.0
        } else if told.speed < -TOLD {
            -1.0
        } else {
            0.0
        };
        let turned = direction != self.direction;
        if !turned && direction == 0.0 {
            // Nothing pushes, so the next push starts anew.
            return;
        }
        let creeps = told.speed.abs() < CREEPING;
        let moves = direction * told.wheels >= CLIMBS_SHARE * direction * told.speed;
        self.moves = moves;
        self.creeps = creeps;
        if turned {
            self.blow = Blow::default();
        } else if self.blow.concerns(direction, told) {
            self.blow.update(direction, moves, told, tick, length_m);
        }
        let advance_m = direction * (told.distance_m - self.furthest_m);
        if turned || !(-RETREAT_M..PROGRESS_M).contains(&advance_m) {
            if turned {
                self.attempts.end();
            } else {
                self.attempts.come_to(direction, told.distance_m, PROGRESS_M);
            }
            self.direction = direction;
            self.time = 0.0;
            self.start = told.lag + square_root::sqrtf(4.0 * PROGRESS_M / (length_m * told.acceleration));
            self.furthest_m = told.distance_m;
            return;
        }
        if moves {
            return;
        }
        self.attempts.hold(self.furthest_m, tick);
        let seeming_m = SEEMING * length_m * tick;
        self.furthest_m += (told.distance_m - self.furthest_m).bounded(-seeming_m, seeming_m);
        // While the reference still comes from the other direction, nothing pushes in this direction.
        if direction * told.reference > 0.0 {
            self.time += tick;
        }
    }

    /// Time without progress after which the vehicle is stuck.
    fn stuck_time(&self) -> f32 {
        STUCK_TIME + self.start
    }

    pub(super) fn push(&self) -> PushState {
        self.push
    }

    /// Whether the wheels have just come past what had held them up: from the tick in which they came free on, as long as they
    /// move, over the way on which they climb.
    pub(super) fn is_just_free(&self) -> bool {
        self.just_free
    }

    #[inline]
    fn found(&self) -> PushState {
        if self.time > self.stuck_time() {
            PushState::Stuck
        } else if self.blow.freed {
            PushState::Freed
        } else if self.direction == 0.0 || self.moves {
            PushState::None
        } else if self.creeps {
            PushState::Creeps
        } else {
            PushState::Perhaps
        }
    }

    /// The nondimensional landing speed beyond the reference that a stuck vehicle may reach.
    pub(super) fn excess(&self) -> f32 {
        self.direction * PUSH_EXCESS
    }

    /// The acceleration whose arm angle a stuck vehicle takes at most, g.
    pub(super) fn effort(&self) -> f32 {
        self.attempts.effort_g()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A time unit of 0.16 s in ticks of 1 ms, and the wheels of the reference vehicle.
    const TICKS_PER_TIME: usize = 160;
    const TICK: f32 = 1.0 / TICKS_PER_TIME as f32;
    const WHEEL_M: f32 = 0.25;
    const PUSHES: Told = Told {
        speed: 0.8,
        reference: 0.8,
        wheels: 0.0,
        unforeseen: 0.0,
        acceleration: 0.2,
        lag: 0.5,
        distance_m: 1.0,
    };

    /// The push state once the vehicle moves again in `direction`, after `held` time units against an obstacle that gave
    /// its wheels a blow of `unforeseen`, and `further_m` beyond the place of the blow.
    fn freed(direction: f32, unforeseen: f32, held: f32, further_m: f32) -> PushState {
        let mut obstacle = Obstacle::default();
        let holds = Told {
            speed: direction * PUSHES.speed,
            reference: direction * PUSHES.reference,
            ..PUSHES
        };
        obstacle.update(&holds, TICK, WHEEL_M);
        obstacle.update(&Told { unforeseen, ..holds }, TICK, WHEEL_M);
        for _ in 0..(held * TICKS_PER_TIME as f32) as usize {
            obstacle.update(&holds, TICK, WHEEL_M);
        }
        let moves = Told {
            wheels: 0.6 * holds.speed,
            distance_m: holds.distance_m + direction * further_m,
            ..holds
        };
        obstacle.update(&moves, TICK, WHEEL_M);
        obstacle.push()
    }

    /// A blow distinguishes an obstacle from a hill. Neither the speed lost at a hill's foot nor a push from behind is a
    /// blow. An obstacle that holds the vehicle up only for a moment, or that lies behind the vehicle, has not changed
    /// the learnt slope.
    #[test]
    fn a_blow_tells_an_obstacle_from_a_hill() {
        for way in [1.0, -1.0] {
            assert_eq!(freed(way, -0.15 * way, 1.5, 0.005), PushState::Freed);
            assert_eq!(freed(way, -0.15 * way, 1.5, 0.14), PushState::Freed);
            assert_eq!(freed(way, -0.15 * way, 1.5, 0.16), PushState::None);
            assert_eq!(freed(way, -0.15 * way, 0.5, 0.005), PushState::None);
            assert_eq!(freed(way, -0.08 * way, 1.5, 0.005), PushState::None);
            assert_eq!(freed(way, 0.15 * way, 1.5, 0.005), PushState::None);
        }
    }

    /// A loss of speed at the place where the vehicle has just forgotten a slope is that slope and no second blow.
    /// Further on, a loss of speed is a blow.
    #[test]
    fn a_slope_is_forgotten_once_in_a_place() {
        let mut obstacle = Obstacle::default();
        let mut meets = |distance_m: f32| {
            let holds = Told { distance_m, ..PUSHES };
            obstacle.update(&holds, TICK, WHEEL_M);
            let unforeseen = -0.15;
            obstacle.update(&Told { unforeseen, ..holds }, TICK, WHEEL_M);
            for _ in 0..(1.5 * TICKS_PER_TIME as f32) as usize {
                obstacle.update(&holds, TICK, WHEEL_M);
            }
            let wheels = 0.6 * holds.speed;
            obstacle.update(&Told { wheels, ..holds }, TICK, WHEEL_M);
            obstacle.push()
        };
        assert_eq!(meets(1.0), PushState::Freed);
        assert_eq!(meets(1.1), PushState::None);
        assert_eq!(meets(1.2), PushState::Freed);
    }

    /// The law reports *Freed* from the tick in which the vehicle comes free until the wheels have climbed 0.15 m, or until the
    /// obstacle holds them up again.
    #[test]
    fn that_the_vehicle_is_free_is_told_over_the_way_of_a_climb() {
        for way in [1.0_f32, -1.0] {
            let mut obstacle = Obstacle::default();
            let holds = Told {
                speed: way * PUSHES.speed,
                reference: way * PUSHES.reference,
                ..PUSHES
            };
            obstacle.update(&holds, TICK, WHEEL_M);
            let unforeseen = -0.15 * way;
            obstacle.update(&Told { unforeseen, ..holds }, TICK, WHEEL_M);
            for _ in 0..(1.5 * TICKS_PER_TIME as f32) as usize {
                obstacle.update(&holds, TICK, WHEEL_M);
                assert!(!obstacle.is_just_free());
            }
            for further_m in [0.0_f32, 0.05, 0.14, 0.16] {
                let moves = Told {
                    wheels: holds.speed,
                    distance_m: holds.distance_m + way * further_m,
                    ..holds
                };
                obstacle.update(&moves, TICK, WHEEL_M);
                assert_eq!(obstacle.is_just_free(), further_m < 0.15, "{way} {further_m}");
            }
            let moves = Told {
                wheels: holds.speed,
                ..holds
            };
            obstacle.update(&moves, TICK, WHEEL_M);
            assert!(obstacle.is_just_free());
            obstacle.update(&holds, TICK, WHEEL_M);
            assert!(!obstacle.is_just_free());
            let stops = Told {
                speed: 0.0,
                reference: 0.0,
                ..holds
            };
            obstacle.update(&stops, TICK, WHEEL_M);
            assert!(!obstacle.is_just_free());
        }
    }

    /// The gyro's bias lets a vehicle that stands before an obstacle seem to creep, either way.
    #[test]
    fn a_vehicle_that_only_seems_to_move_stays_stuck() {
        for creeps_m in [0.0003_f32, -0.0003] {
            let mut obstacle = Obstacle::default();
            // In half a minute, 188 time units.
            for k in 0..188 * TICKS_PER_TIME {
                let distance_m = 1.0 + creeps_m * k as f32 * TICK;
                obstacle.update(&Told { distance_m, ..PUSHES }, TICK, WHEEL_M);
                assert!(k < 700 || obstacle.push() == PushState::Stuck, "{creeps_m} {k}");
            }
        }
    }
}
