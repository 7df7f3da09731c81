//! The landing law: observers, landing speed, governor, arm servo.

mod findings;
mod states;

pub use states::MOTION_STATES;

use super::balance::{Balance, MotionByTorque};
use super::chatter::Chatter;
use super::command::{CommandRamp, Room, gentle};
use super::design::Design;
use super::governor::{Barrier, Interval, grip};
use super::limits::Limits;
use super::observer::{RateObserver, TorqueObserver};
use super::obstacle::{Obstacle, PushState, Told};
use super::refusal::SlopeRefusal;
use super::standing::{STANDING_PACE, Unrest};
use crate::bounded::Bounded;
use crate::control::LawOutput;
use crate::control::equilibrium::{ArmAngle, Equilibrium};
use crate::control::speed::{SpeedAim, SpeedInput, SpeedTerms};
use crate::vehicle::{G, Scales, Vehicle};

/// Share of the supply voltage that the speed limit is computed from.
pub const SUPPLY_SHARE: f32 = 0.97;
/// Nondimensional voltage that the speed limit reserves for the arm.
pub const SUPPLY_RESERVE: f32 = 0.45;
/// Least cosine of the arm's angle at rest that the law computes the rate of home with. At a smaller cosine the arm is
/// at its limits.
const HOME_COS_MIN: f32 = 0.3;
/// Speed below which the law captures and holds the place once no motion is commanded, m/s.
const HOLD_BELOW_M_S: f32 = 0.05;
/// Time after the start, in time units, within which a vehicle released on a slope begins to roll.
const LET_GO_TIME: f32 = 3.0;
/// Time after the start, in time units, during which stopping has priority over the grip margin.
const START_TIME: f32 = 12.0;
/// Time after the start, in time units, during which the observer learns the slope with a pole that is faster by the
/// factor HASTE. A vehicle released with its arm hanging does not know its slope.
const ACQUISITION_TIME: f32 = 6.0;
const HASTE: f32 = 2.0;

/// Acceleration of the reference below which the vehicle counts as driving at the commanded speed, g.
const CRUISE_ACCELERATION: f32 = 0.02;

/// The landing law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandingLaw {
    scales: Scales<f32>,
    balance: Balance<f32>,
    equilibrium: Equilibrium<f32>,
    zeta: f32,
    tick: f32,
    design: Design,
    limits: Limits,
    torque_observer: TorqueObserver,
    rate_observer: RateObserver,
    command: CommandRamp,
    obstacle: Obstacle,
    chatter: Chatter,
    /// Share of the design's poles that the law uses in this tick.
    pace: f32,
    /// Torque at the joint in the last tick according to the model.
    torque: f32,
    /// Acceleration of the axle in the last tick, g.
    acceleration: f32,
    started: bool,
    /// Time since the law started, in time units.
    age: f32,
    slope_limited: bool,
    refusal: SlopeRefusal,
}

impl LandingLaw {
    /// The law for `vehicle`, called every `dt_s` seconds.
    pub fn new(vehicle: &Vehicle<f32>, dt_s: f32) -> Self {
        let (p, planar, scales) = (vehicle.parameters(), vehicle.planar(0.0), vehicle.scales());
        let tick = dt_s / scales.time_s;
        let lag = p.estimator.wheel_rate_time_constant_s / scales.time_s;
        let design = Design::of(vehicle, dt_s);
        let alpha_l = planar.alpha * planar.l;
        let mass = 1.0 + vehicle.spar_mass_ratio();
        let balance = Balance {
            mass,
            alpha_l,
            alpha_l2: alpha_l * planar.l,
            mu: planar.mu,
            nu: planar.nu,
        };
        let (acceleration, comfort_s) = gentle(vehicle);
        Self {
            scales,
            balance,
            equilibrium: Equilibrium {
                alpha_l,
                mass,
                mu: planar.mu,
            },
            zeta: planar.zeta,
            tick,
            design,
            limits: Limits::new(vehicle, &balance, acceleration),
            torque_observer: TorqueObserver::new(&design, tick),
            rate_observer: RateObserver::new(&design, tick, 1.0 - libm::expf(-tick / lag)),
            command: CommandRamp::new(&p.control, comfort_s, dt_s, &scales),
            obstacle: Obstacle::default(),
            chatter: Chatter::default(),
            pace: 1.0,
            torque: 0.0,
            acceleration: 0.0,
            started: false,
            age: 0.0,
            slope_limited: false,
            refusal: SlopeRefusal::default(),
        }
    }

    /// Restarts at the present speed: the reference does not jump, and the observers start empty.
    pub fn reset(&mut self, speed_m_s: f32) {
        self.command.reset(speed_m_s / self.scales.speed_m_s);
        self.obstacle = Obstacle::default();
        self.chatter = Chatter::default();
        self.refusal = SlopeRefusal::default();
        self.pace = 1.0;
        self.acceleration = 0.0;
        self.started = false;
    }

    /// The governed reference, m/s.
    pub fn reference_m_s(&self) -> f32 {
        self.command.reference() * self.scales.speed_m_s
    }

    /// The vehicle's inertias as the law models them.
    pub fn balance(&self) -> &Balance<f32> {
        &self.balance
    }

    /// The arm's barrier.
    pub fn barrier(&self) -> &Barrier {
        &self.limits.barrier
    }

    /// Friction coefficient that the law plans with.
    pub fn planned_mu(&self) -> f32 {
        self.limits.planned_mu()
    }

    /// Change of the slope's sine that the last tick showed; `None` before the first tick.
    pub fn slope_lesson(&self) -> Option<f32> {
        self.started.then(|| self.rate_observer.slope_lesson())
    }

    /// Acceleration of the axle in the tick decided last, g.
    pub fn acceleration_g(&self) -> f32 {
        self.acceleration
    }

    /// One tick: returns the voltage of each drive motor, within `voltage_max_v`, and its terms.
    #[inline]
    pub fn step(&mut self, input: &SpeedInput) -> LawOutput<SpeedTerms> {
        let phi = input.phi_rad;
        let phi_rate = self.scales.rate_from_si(input.phi_rate_rad_s);
        let sensed_wheel_rate = self.scales.rate_from_si(input.theta_rate_rad_s);
        let (arm, slope) = (input.phi_sin_cos, input.slope_sin_cos);
        if !self.started {
            self.started = true;
            self.torque = 0.0;
            self.age = 0.0;
            self.torque_observer.reset(phi_rate);
            self.rate_observer.reset(sensed_wheel_rate, phi_rate, slope.0);
        }
        self.age += self.tick;
        let push = self.obstacle.push();
        let stuck = push == PushState::Stuck;
        let motion = self.observe(arm, slope, phi_rate, sensed_wheel_rate + phi_rate, push);
        self.chatter.update(self.rate_observer.unforeseen(), self.tick);
        let wheel_rate = self.rate_observer.wheel_rate();

        let home = self.equilibrium.arm(0.0, slope.0, slope.1);
        // During a turn on a slope, home moves: the plane carries the arm along with the turn, and the gyro does not
        // show this motion.
        let turn = self.scales.rate_from_si(input.slope_turn_per_s);
        let home_rate = turn * (self.balance.mass / (self.balance.alpha_l * home.cos.bounded(HOME_COS_MIN, 1.0)) - 1.0);
        let landing = self.landing_speed(wheel_rate, arm.0, (phi_rate, home_rate), &home, slope);

        // The wanted acceleration, within grip.
        let (room, excess) = self.room(input, slope, landing, stuck);
        self.slope_limited = self.limits.too_steep(slope.0);
        if !self.refusal.is_settled() {
            self.refusal.update(
                self.limits.excess(slope.0),
                if slope.0 < 0.0 { -landing } else { landing },
                input.target_m_s != 0.0 || input.turns,
                self.tick,
            );
        }
        let voltage_max = self.scales.voltage_from_si(input.voltage_max_v);
        let target = self.target(input, slope.0, voltage_max, wheel_rate);
        let speed_pole = self.pace * self.design.speed;
        let ground = input
            .sliding_over_m_s
            .map(|speed_m_s| speed_m_s / self.scales.speed_m_s);
        self.command
            .advance(target, landing, ground, self.tick, &room, speed_pole);
        let wanted = self.command.acceleration() + speed_pole * (self.command.reference() + excess - landing);
        let acceleration = wanted.bounded(-room.backward, room.forward);
        let told = Told {
            speed: if input.target_m_s == 0.0 { 0.0 } else { target },
            reference: self.command.reference(),
            wheels: wheel_rate,
            unforeseen: self.rate_observer.unforeseen(),
            acceleration: if target < 0.0 { room.backward } else { room.forward },
            lag: self.command.lag(),
            distance_m: input.distance_m,
        };
        self.obstacle.update(&told, self.tick, self.scales.length_m);

        // The arm's angle for this acceleration, and the servo's torque.
        let commanded_phi = self.arm_command(acceleration, &home, slope);
        let servo = self.pace * self.design.servo;
        let per_torque = 1.0 / motion.arm.per_torque;
        let weight = -motion.arm.at_zero * per_torque;
        let swing_damping = -servo * servo * (phi - commanded_phi) * per_torque;
        let swing_rate = -2.0 * servo * (phi_rate - home_rate) * per_torque;
        let servo_torque = weight + swing_damping + swing_rate;

        // The torque stays within grip unless the arm must be stopped, and within the current limit.
        let gripping = if stuck { Interval::ALL } else { grip(&motion, room.mu) };
        let torque = self
            .limits
            .barrier
            .guard(&motion, (phi, phi_rate), slope, servo_torque, gripping);
        let disturbance = self.torque_observer.torque();
        let damping = self.zeta * (wheel_rate + phi_rate);
        let voltage = (torque - disturbance + damping).bounded(-voltage_max, voltage_max);
        self.pace = self
            .unrest(input, stuck, (landing, phi_rate, arm.0 - home.sin), slope.0)
            .pace();
        self.torque = voltage - damping;
        // The acceleration of the model, without the encoders' correction: that would feed the ballast's push on the
        // axle back to the ballast. While the vehicle stands, the acceleration is 0.
        self.acceleration = if self.pace <= STANDING_PACE {
            0.0
        } else {
            motion.wheel.at(self.torque + disturbance)
        };
        let volts = |u: f32| self.scales.voltage_to_si(u);
        LawOutput {
            voltage_v: volts(voltage),
            terms: SpeedTerms {
                feed_forward_v: volts(damping),
                weight_v: volts(weight),
                swing_rate_v: volts(swing_rate),
                swing_damping_v: volts(swing_damping),
                friction_v: volts(-disturbance),
                governed_v: volts(torque - servo_torque),
                aim: SpeedAim {
                    landing_speed_m_s: landing * self.scales.speed_m_s,
                    acceleration_m_s2: acceleration * G,
                    phi_rad: commanded_phi,
                },
                ..SpeedTerms::default()
            },
        }
    }

    /// How far the vehicle is from standing and from driving at the commanded speed on a slope of the sine
    /// `sin_slope`: its landing speed, phi', and the difference between the sines of the arm's angle and of its
    /// equilibrium.
    fn unrest(
        &self,
        input: &SpeedInput,
        stuck: bool,
        (landing, phi_rate, sin_phi_off): (f32, f32, f32),
        sin_slope: f32,
    ) -> Unrest {
        Unrest {
            told: input.target_m_s == 0.0 && !input.turns && !stuck,
            cruises: self.chatter.worn()
                && !stuck
                && input.sliding_over_m_s.is_none()
                && self.command.acceleration().abs() < CRUISE_ACCELERATION,
            starting: self.age < LET_GO_TIME,
            reference: self.command.reference(),
            landing,
            phi_rate,
            sin_phi_off,
            torque: self.balance.mass * sin_slope,
        }
    }

    /// The room to accelerate, and the allowed landing speed beyond the reference, which lets a stuck vehicle push.
    fn room(&self, input: &SpeedInput, slope: (f32, f32), landing: f32, stuck: bool) -> (Room, f32) {
        let starts = input.target_m_s == 0.0 && self.age < START_TIME;
        let room = self.limits.room(slope, landing, starts);
        if !stuck {
            return (room, 0.0);
        }
        let effort = self.obstacle.effort();
        let pushing = Room {
            forward: effort,
            backward: effort,
            ..room
        };
        (pushing, self.obstacle.excess())
    }

    /// Updates the observers with the sensed rates and returns the motion as a function of the torque.
    // Inlined on the host, like the law's other parts.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn observe(
        &mut self,
        arm: (f32, f32),
        slope: (f32, f32),
        phi_rate: f32,
        joint_rate: f32,
        push: PushState,
    ) -> MotionByTorque<f32> {
        let motion = if push == PushState::Stuck {
            self.balance.blocked_motion(arm.0)
        } else {
            self.balance.motion(arm, phi_rate, slope)
        };
        self.torque_observer.update(&motion, self.torque, phi_rate, self.pace);
        let torque = self.torque + self.torque_observer.torque();
        let haste = self.pace * if self.age < ACQUISITION_TIME { HASTE } else { 1.0 };
        self.rate_observer
            .update(&motion, torque, phi_rate, joint_rate, slope.0, push, haste);
        motion
    }

    /// The landing speed: what theta' becomes once the servo has brought the arm home and stopped it there.
    fn landing_speed(
        &self,
        wheel_rate: f32,
        sin_phi: f32,
        (phi_rate, home_rate): (f32, f32),
        home: &ArmAngle<f32>,
        slope: (f32, f32),
    ) -> f32 {
        let (balance, servo) = (&self.balance, self.pace * self.design.servo);
        let along = balance.alpha_l * (slope.1 * home.cos + slope.0 * home.sin);
        let inverse = 1.0 / (balance.mass + balance.mu - along);
        let swing = 2.0 * (sin_phi - home.sin) / servo + home.cos * (phi_rate - home_rate) / (servo * servo);
        wheel_rate + inverse * (balance.alpha_l * swing + (along - balance.alpha_l2) * phi_rate)
    }

    /// The arm's angle that gives an acceleration, within the arm's limits.
    fn arm_command(&self, acceleration: f32, home: &ArmAngle<f32>, slope: (f32, f32)) -> f32 {
        let most = self.limits.most_sin_phi(home);
        let wanted = self.equilibrium.arm(acceleration, slope.0, slope.1);
        let sin = if wanted.cos > 0.0 {
            wanted.sin
        } else if wanted.sin < 0.0 {
            -1.0
        } else {
            1.0
        };
        libm::asinf(sin.bounded(-most, most))
    }

    /// The commanded speed within the supply's limit: the operator's, or the speed of the position hold. Beyond the
    /// slope limit the law commands no speed further uphill.
    fn target(&mut self, input: &SpeedInput, sin_slope: f32, voltage_max: f32, wheel_rate: f32) -> f32 {
        let slow = (wheel_rate * self.scales.speed_m_s).abs() < HOLD_BELOW_M_S;
        let target = self.command.target_m_s(input, slow) / self.scales.speed_m_s;
        let weight = (self.balance.mass * sin_slope).abs();
        let most = ((SUPPLY_SHARE * voltage_max - weight - SUPPLY_RESERVE) / self.zeta).bounded(0.0, f32::MAX);
        let within = target.bounded(-most, most);
        if self.slope_limited && within * sin_slope > 0.0 {
            0.0
        } else {
            within
        }
    }
}

#[cfg(test)]
mod tests;
