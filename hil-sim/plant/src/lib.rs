//! Simulation of the physical vehicle and its ground. A board closes its control loops around this plant.
//!
//! [`Plant`] joins the bodies ([`body`]), the ground ([`terrain`]), motors and battery ([`motor`]),
//! encoders ([`encoder`]) and two IMUs ([`imu`], [`icm42688p`]). [`settings`] and the methods for a scenario's steps make
//! the plant differ from its vehicle file. A board, virtual or emulated, sets the bridges, advances the plant, and reads
//! the sensors; one seed makes the whole plant deterministic.
//!
//! The plant does not hold a disarmed vehicle: with open bridges only gearbox friction and damping act on the wheels, and
//! on a slope the vehicle rolls away. Chocks hold the vehicle in a scenario that needs it to stand.

#![forbid(unsafe_code)]

use model::analog::Analog;
use model::sample::{MOTORS, Motor};

pub mod analog;
mod assembly;
pub mod battery;
pub mod body;
mod bridge_heat;
mod disturb;
pub mod encoder;
pub mod fault;
mod gear;
pub mod icm42688p;
pub mod imu;
pub mod motor;
pub mod noise;
mod ranges;
pub mod settings;
mod supply;
pub mod terrain;
#[cfg(test)]
mod tests;
mod truth;
mod validity;
pub mod wiring;

use analog::AnalogConverter;
use battery::Battery;
use body::{Body, JointTorque, LEFT, PHI, RIGHT};
use bridge_heat::BridgeHeat;
use encoder::Encoder;
use gear::{GEARS, Gear};
use icm42688p::Icm42688pModel;
use imu::motion_at;
pub use motor::BridgeState;
use motor::{DcMotor, MotorSpan};
use supply::Supply;
use terrain::Ground;
pub use truth::{Glance, Truth};
pub use validity::Invalid;
use wiring::Wiring;

/// Longest substep of a vehicle that rolls on a plane, in s; half of this value where the wheels slip or lift, the ground
/// rises, an external force acts, or a gearbox has play. The tests state bounds for the difference from substeps ten
/// times shorter.
pub const SUBSTEP_S: f64 = 0.001;

/// Current that the board and its sensors draw, in A.
const IDLE_A: f64 = 0.2;

/// Angle of a motor's shaft at its gearbox's output.
fn shaft_angle(body: &Body, gears: Option<&[Option<Gear>; GEARS]>, motor: usize) -> f64 {
    let gear = gears.and_then(|gears| gears.get(motor)).and_then(Option::as_ref);
    gear.map_or_else(|| body.joint_angle(motor), Gear::angle)
}

/// The simulated vehicle and its ground.
#[derive(Debug, Clone)]
pub struct Plant {
    body: Body,
    ground: Ground,
    motors: [DcMotor; MOTORS],
    battery: Battery,
    encoders: [Encoder; MOTORS],
    arm_imu: Icm42688pModel,
    spar_imu: Icm42688pModel,
    arm_radius_m: f64,
    spar_radius_m: f64,
    has_spar: bool,
    analog: AnalogConverter,
    /// The gearboxes with play, left and right; `None` if no gearbox has play.
    gears: Option<Box<[Option<Gear>; GEARS]>>,
    wiring: Wiring,
    /// Whether the wiring has any fault, kept because it is asked twice a millisecond.
    wiring_is_faulty: bool,
    bridge_heat: BridgeHeat,
    supply: Supply,
    /// Time at which the present push ends.
    push_until_s: f64,
    time_s: f64,
    battery_v: f64,
    battery_a: f64,
    substep_s: f64,
    invalid: Option<Invalid>,
}

impl Plant {
    /// The counters start at zero, whatever the joints' angles.
    fn rest_encoders(&mut self) {
        for index in [LEFT, RIGHT] {
            self.body.state_mut().0[index] = -self.body.position()[PHI];
        }
    }

    /// Puts the vehicle at rest at (x, y) with a heading. Arm, spar and ballast hang vertically, and the encoder counters
    /// keep their counts.
    pub fn place(&mut self, x_m: f64, y_m: f64, heading_rad: f64) {
        let joints: [f64; 2] = core::array::from_fn(|i| self.body.joint_angle(i));
        self.body.place(&self.ground, x_m, y_m, heading_rad);
        let phi = self.body.position()[PHI];
        let position = self.body.state_mut().0;
        position[LEFT] = joints[0] - phi;
        position[RIGHT] = joints[1] - phi;
    }

    /// Advances by `dt_s` seconds with the bridges held, in the order of [`model::sample::Motor`].
    #[inline]
    pub fn advance(&mut self, dt_s: f64, bridges: &[BridgeState; MOTORS]) {
        if dt_s <= 0.0 || self.invalid.is_some() {
            return;
        }
        let longest_s = if self.body.rolled() && self.gears.is_none() {
            self.substep_s
        } else {
            0.5 * self.substep_s
        };
        // Rounding must not add a substep.
        let substeps = dt_s / longest_s - 1e-6;
        let (count, h) = if substeps <= 1.0 {
            (1, dt_s)
        } else {
            let count = libm::ceil(substeps);
            (count as u64, dt_s / count)
        };
        let mut changed = [BridgeState::Open; MOTORS];
        let bridges = self.connected(bridges, &mut changed);
        if count == 1 {
            self.substep(h, bridges);
        } else {
            self.substeps(count, h, bridges);
        }
        self.supply.follow(dt_s, self.battery_a, &mut self.battery);
        if self.bridge_heat.follow(dt_s, self.bridge_current_a()) {
            let shut_down = self.bridge_heat.shut_down();
            self.rewire(|wiring| wiring.shut_down = shut_down);
        }
        self.watch_validity();
        for (i, encoder) in self.encoders.iter_mut().enumerate() {
            encoder.advance(shaft_angle(&self.body, self.gears.as_deref(), i), self.time_s);
        }
    }

    /// The bridge states that act on the motors: the given states, or a changed copy in `changed`.
    #[inline]
    fn connected<'a>(
        &self,
        bridges: &'a [BridgeState; MOTORS],
        changed: &'a mut [BridgeState; MOTORS],
    ) -> &'a [BridgeState; MOTORS] {
        if self.has_spar && !self.wiring_is_faulty {
            return bridges;
        }
        *changed = *bridges;
        if !self.has_spar {
            changed[Motor::Ballast as usize] = BridgeState::Open;
        }
        *changed = self.wiring.through(changed);
        changed
    }

    /// Several substeps of `h` seconds. Not inlined: a vehicle on a plane takes only one substep.
    #[inline(never)]
    fn substeps(&mut self, count: u64, h: f64, bridges: &[BridgeState; MOTORS]) {
        for _ in 0..count {
            self.substep(h, bridges);
        }
    }

    #[inline]
    fn substep(&mut self, h: f64, bridges: &[BridgeState; MOTORS]) {
        if self.time_s >= self.push_until_s {
            self.end_push();
        }
        let mut before: [f64; MOTORS] = core::array::from_fn(|i| self.body.joint_rate(i));
        if let Some(gears) = self.gears.as_deref() {
            gear::overwrite(&mut before, gears, Gear::rate);
        }
        DcMotor::prepare(&mut self.motors, h);
        self.battery_v = self
            .battery
            .terminal_v(MotorSpan::Substep, self.battery_v, &self.motors, bridges, &before);
        let joints: [JointTorque; MOTORS] =
            core::array::from_fn(|i| self.motors[i].begin(h, bridges[i], self.battery_v, before[i]));
        let mean_rates = match self.gears.as_deref_mut() {
            None => {
                self.body.step(h, &self.ground, &joints);
                *self.body.mean_joint_rates()
            }
            Some(gears) => {
                gear::step(h, &mut self.body, &self.ground, gears, &joints);
                let mut rates = *self.body.mean_joint_rates();
                gear::overwrite(&mut rates, gears, Gear::mean_rate);
                rates
            }
        };
        self.battery_a = self.battery.idle_a;
        for (motor, rate) in self.motors.iter_mut().zip(mean_rates) {
            motor.end(rate);
            self.battery_a += motor.battery_current_a();
        }
        self.time_s += h;
        self.feel(h);
    }

    /// Passes the motion of the last substep to the IMUs.
    #[inline]
    fn feel(&mut self, h: f64) {
        let (u, a, gravity) = (self.body.mean_speed(), self.body.acceleration(), self.body.gravity());
        let roll = self.body.axle_roll();
        let arm = motion_at(self.arm_radius_m, &self.body.arm_swing(), u, a, &gravity, roll);
        self.arm_imu.advance(h, &arm);
        if self.has_spar {
            // The spar's angle is that of its lower end, and the spar IMU is above the axle.
            let spar = motion_at(-self.spar_radius_m, &self.body.spar_swing(), u, a, &gravity, roll);
            self.spar_imu.advance(h, &spar);
        }
    }

    /// Time since the start.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// The encoders' counters: 16 bits, wrapping, in the order of [`model::sample::Motor`].
    pub fn counters(&self) -> [u16; MOTORS] {
        core::array::from_fn(|i| self.encoders.get(i).map_or(0, Encoder::counter))
    }

    /// The encoder of a motor.
    pub fn encoder(&self, motor: Motor) -> &Encoder {
        &self.encoders[motor as usize]
    }

    /// The encoder of a motor, mutable.
    pub fn encoder_mut(&mut self, motor: Motor) -> &mut Encoder {
        &mut self.encoders[motor as usize]
    }

    /// One conversion of the analogue inputs to raw counts ([`model::board::BoardScales`]), with the converter's noise,
    /// saturated at its range. The converter samples the means over the last substep.
    pub fn analog(&mut self) -> Analog<u16> {
        self.convert(self.battery_v, self.bridge_current_a())
    }

    /// Like [`Plant::analog`] after [`Plant::advance`] by `dt_s` seconds, a part of a substep, but without advancing the
    /// plant. The joints are assumed to keep their rates, which over so short a time changes a current by less than the
    /// converter's noise. `None` if this assumption fails and the plant has to advance.
    #[inline]
    pub fn analog_after(&mut self, dt_s: f64, bridges: &[BridgeState; MOTORS]) -> Option<Analog<u16>> {
        let smooth = self.body.rolled() && self.gears.is_none() && self.invalid.is_none();
        if !smooth || dt_s <= 0.0 || dt_s > self.substep_s {
            return None;
        }
        let mut changed = [BridgeState::Open; MOTORS];
        let bridges = self.connected(bridges, &mut changed);
        let rates = self.body.joint_rates_after(0.5 * dt_s);
        DcMotor::prepare_ahead(&mut self.motors, dt_s);
        let volts = self
            .battery
            .terminal_v(MotorSpan::Ahead, self.battery_v, &self.motors, bridges, &rates);
        let currents = core::array::from_fn(|i| self.motors[i].mean_current_after(dt_s, bridges[i], volts, rates[i]));
        Some(self.convert(volts, self.wiring.seen_by_bridges(currents)))
    }

    #[inline]
    fn convert(&mut self, battery_voltage: f64, currents: [f64; MOTORS]) -> Analog<u16> {
        let [left_current, right_current, ballast_current] = currents;
        self.analog.convert(Analog {
            battery_voltage,
            left_current,
            right_current,
            ballast_current,
        })
    }

    /// The IMU on the arm.
    pub fn arm_imu(&mut self) -> &mut Icm42688pModel {
        &mut self.arm_imu
    }

    /// The IMU on the spar. Without a spar there is no IMU, and its bus floats.
    pub fn spar_imu(&mut self) -> Option<&mut Icm42688pModel> {
        self.has_spar.then_some(&mut self.spar_imu)
    }

    /// The battery, mutable. For tests.
    pub fn battery_mut(&mut self) -> &mut Battery {
        &mut self.battery
    }

    /// The bodies, for tests and for states that no sensor shows.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// The bodies, mutable, to set a state. For tests.
    pub fn body_mut(&mut self) -> &mut Body {
        &mut self.body
    }

    /// The ground.
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// The true state of vehicle and ground.
    pub fn truth(&self) -> Truth {
        self.glance().truth()
    }

    /// The part of the true state that needs no angle of the vertical, for an observer who looks often and needs the
    /// whole truth seldom.
    #[inline]
    pub fn glance(&self) -> Glance {
        Glance {
            time_s: self.time_s,
            position: *self.body.position(),
            speed: *self.body.speed(),
            wheels: *self.body.wheels(),
            path_slopes: self.body.path_slopes(),
            gravity: self.body.gravity(),
            current_a: self.motors.each_ref().map(DcMotor::mean_current_a),
            torque_n_m: self.motors.each_ref().map(DcMotor::torque_n_m),
            battery_v: self.battery_v,
            battery_a: self.battery_a,
            has_spar: self.has_spar,
            chocked: self.body.chocked(),
        }
    }
}
