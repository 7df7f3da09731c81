//! Rules that derive the landing law's gains from the vehicle's parameters.

use crate::bounded::Bounded;
use crate::real::Real;
use crate::vehicle::Vehicle;

/// Gains in 1/(time unit).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Design {
    /// Both poles of the arm servo.
    pub servo: f32,
    /// Pole of the landing speed.
    pub speed: f32,
    /// Both poles of the torque observer.
    pub torque_observer: f32,
    /// Both poles of the joint-rate observer.
    pub rate_observer: f32,
}

/// Pole of the arm servo where nothing else bounds it. A faster pole gains little, because grip bounds every step,
/// and costs robustness: with 4, some vehicles with parameters of +-20 % limit-cycle.
const SERVO: f32 = 3.0;
/// Ratio of the torque observer's pole to the arm servo's pole.
const TORQUE_OBSERVER: f32 = 5.0;
/// Ratio of the landing speed's pole to the arm servo's pole.
const SPEED: f32 = 0.5;
/// Largest product of the torque observer's pole and the tick: up to this value a discrete observer with both poles
/// at `1 - product` is well damped.
const TICK_SHARE: f32 = 0.35;
/// Largest product of the arm servo's pole and the lag of the wheel-rate filter.
const LAG_SHARE: f32 = 0.2;
/// Largest product of the cube of the arm servo's pole and the rotors' time constant. Within the play of the gears a
/// rotor is free: its rate follows the voltage with that time constant, and the law's response to the rate grows with
/// the cube of the pole. In simulations with 1 and 2 deg of play and nine combinations of rotor inertia and
/// resistance, vehicles chatter from a product of 2.9.
const PLAY_SHARE: f32 = 1.1;

impl Design {
    /// The gains for `vehicle`, whose law is called every `dt_s` seconds.
    pub fn of<T: Real>(vehicle: &Vehicle<T>, dt_s: T) -> Self {
        let (p, time_s) = (vehicle.parameters(), vehicle.scales().time_s);
        let [tick, lag, rotors] = [
            dt_s,
            p.estimator.wheel_rate_time_constant_s,
            p.drive_motor.free_rotor_s(),
        ]
        .map(|seconds| (seconds / time_s).to_f64() as f32);
        Self::by_rule(tick, lag, rotors)
    }

    /// The gains for a tick, the time constant of the wheel-rate filter and the time constant of the free rotors, all
    /// in time units.
    ///
    /// ```
    /// use model::control::landing::Design;
    /// // The reference vehicle: 1 ms, 4 ms and 4.6 ms of 159.6 ms.
    /// let design = Design::by_rule(0.00626, 0.0251, 0.029);
    /// assert_eq!((design.servo, design.speed), (3.0, 1.5));
    /// assert_eq!((design.torque_observer, design.rate_observer), (15.0, 3.0));
    /// // With wheels of 20 mm radius a tick is long in time units, so the law becomes slower.
    /// let small = Design::by_rule(0.0222, 0.0886, 0.029);
    /// assert!(small.servo < 2.3 && small.torque_observer * 0.0222 < 0.36);
    /// // Heavy rotors, as in small gearmotors, follow the voltage slowly within the play of the gears.
    /// let heavy = Design::by_rule(0.01, 0.04, 0.14);
    /// assert!(heavy.servo < 2.0);
    /// ```
    pub fn by_rule(tick: f32, lag: f32, rotors: f32) -> Self {
        let servo = SERVO
            .bounded(0.0, TICK_SHARE / (TORQUE_OBSERVER * tick))
            .bounded(0.0, LAG_SHARE / lag)
            .bounded(0.0, libm::cbrtf(PLAY_SHARE / rotors));
        Self {
            servo,
            speed: SPEED * servo,
            torque_observer: TORQUE_OBSERVER * servo,
            rate_observer: servo,
        }
    }
}
