//! The physical vehicle and its ground, around which a board closes its control loops.
//!
//! [`Plant`] joins the bodies ([`body`]), the ground ([`terrain`]), motors and battery ([`motor`]),
//! encoders ([`encoder`]) and two IMUs ([`imu`], [`icm42688p`]). A board, virtual or emulated, sets the
//! bridges, advances the plant, and reads the sensors; everything is deterministic from one seed.
//!
//! A disarmed vehicle gets no help: with its bridges open nothing but gearbox friction and damping acts
//! on the wheels, and on a slope it rolls away. Chocks hold the vehicle in a scenario that needs it to stand.

#![forbid(unsafe_code)]

use model::board::BoardScales;
use model::sample::{MOTORS, Motor as MotorIndex};
use model::vehicle::Vehicle;

pub mod body;
pub mod encoder;
pub mod fault;
pub mod icm42688p;
pub mod imu;
pub mod motor;
pub mod noise;
pub mod terrain;
#[cfg(test)]
mod tests;
mod truth;

use body::{BALLAST, Body, FORWARD, JointTorque, LEFT, LIFT, PHI, RIGHT, SIDE, SPAR, YAW};
use encoder::Encoder;
use icm42688p::Icm42688p;
use imu::{ImuErrors, motion_at};
pub use motor::BridgeState;
use motor::{Battery, Motor};
use noise::Noise;
use terrain::{Ground, Terrain, TerrainError};
pub use truth::Truth;

/// Longest substep, in s. Against substeps ten times shorter the reference vehicle differs by less than
/// the tests state.
pub const SUBSTEP_S: f64 = 0.0005;

/// A bridge's own hardware chops at this multiple of the current at which the vehicle calls a fault...
const CHOP_FACTOR: f64 = 1.5;
/// ... as far as the current sensor reaches.
const CHOP_MAX_A: f64 = 60.0;
/// Current that the board and its sensors draw, in A.
const IDLE_A: f64 = 0.2;
/// Noise of an analogue reading, in counts.
const ANALOG_NOISE_COUNTS: f64 = 2.0;

/// Streams of the scenario's seed.
mod stream {
    pub const ARM_IMU: u64 = 0;
    pub const SPAR_IMU: u64 = 1;
    pub const ANALOG: u64 = 2;
    /// Three, one a motor.
    pub const ENCODERS: u64 = 3;
}

/// The simulated vehicle in its world.
#[derive(Debug, Clone)]
pub struct Plant {
    body: Body,
    ground: Ground,
    motors: [Motor; MOTORS],
    battery: Battery,
    encoders: [Encoder; MOTORS],
    arm_imu: Icm42688p,
    spar_imu: Icm42688p,
    arm_radius_m: f64,
    spar_radius_m: f64,
    has_spar: bool,
    scales: BoardScales,
    analog_noise: Noise,
    time_s: f64,
    battery_v: f64,
    battery_a: f64,
    substep_s: f64,
}

impl Plant {
    /// The vehicle at rest at the terrain's origin, heading along x, everything hanging from the
    /// vertical, bridges open, battery full; sensor errors as on the data sheets. `scales` are those of the
    /// board that reads the analogue signals.
    ///
    /// # Errors
    /// A terrain that this vehicle's wheels cannot follow.
    pub fn new(
        vehicle: &Vehicle<f64>,
        scales: &BoardScales,
        terrain: Terrain,
        seed: u64,
    ) -> Result<Self, TerrainError> {
        Self::with_imu_errors(vehicle, scales, terrain, seed, ImuErrors::default())
    }

    /// As [`Plant::new`], with IMUs of the given errors.
    ///
    /// # Errors
    /// A terrain that this vehicle's wheels cannot follow.
    pub fn with_imu_errors(
        vehicle: &Vehicle<f64>,
        scales: &BoardScales,
        terrain: Terrain,
        seed: u64,
        errors: ImuErrors,
    ) -> Result<Self, TerrainError> {
        let p = vehicle.parameters();
        let ground = Ground::new(terrain, p.body.wheel_radius_m)?;
        let chop = (CHOP_FACTOR * p.safety.overcurrent_a).min(CHOP_MAX_A);
        let drive = Motor::new(&p.drive_motor, chop);
        // Without a spar the third bridge has no motor: one that never draws a current.
        let ballast = p
            .spar
            .as_ref()
            .map_or_else(|| drive.clone(), |(_, m)| Motor::new(m, chop));
        let (ballast_counts, ballast_ratio) = p
            .spar
            .as_ref()
            .map_or((4.0, 1.0), |(_, m)| (m.encoder_counts_per_rev, m.gear_ratio));
        let drive_encoder = |motor: MotorIndex| {
            let noise = Noise::new(seed, stream::ENCODERS + motor as u64);
            Encoder::new(p.drive_motor.encoder_counts_per_rev, p.drive_motor.gear_ratio, noise)
        };
        let ballast_noise = Noise::new(seed, stream::ENCODERS + MotorIndex::Ballast as u64);
        let battery = Battery {
            open_circuit_v: p.battery.nominal_v,
            resistance_ohm: p.battery.resistance_ohm,
            idle_a: IDLE_A,
        };
        let mut plant = Self {
            body: Body::new(vehicle, &ground),
            ground,
            motors: [drive.clone(), drive, ballast],
            battery,
            encoders: [
                drive_encoder(MotorIndex::Left),
                drive_encoder(MotorIndex::Right),
                Encoder::new(ballast_counts, ballast_ratio, ballast_noise),
            ],
            arm_imu: Icm42688p::new(errors, Noise::new(seed, stream::ARM_IMU)),
            spar_imu: Icm42688p::new(errors, Noise::new(seed, stream::SPAR_IMU)),
            arm_radius_m: p.imu.arm_radius_m,
            spar_radius_m: p.imu.spar_radius_m,
            has_spar: p.spar.is_some(),
            scales: *scales,
            analog_noise: Noise::new(seed, stream::ANALOG),
            time_s: 0.0,
            battery_v: battery.open_circuit_v - battery.resistance_ohm * IDLE_A,
            battery_a: IDLE_A,
            substep_s: SUBSTEP_S,
        };
        plant.rest_encoders();
        Ok(plant)
    }

    /// Counters start at zero wherever the joints stand.
    fn rest_encoders(&mut self) {
        for index in [RIGHT, LEFT] {
            self.body.state_mut().0[index] = -self.body.position()[PHI];
        }
    }

    /// Puts the vehicle at rest at (x, y) with a heading, everything hanging from the vertical. Encoder
    /// counters keep their counts.
    pub fn place(&mut self, x_m: f64, y_m: f64, heading_rad: f64) {
        let joints: [f64; 2] = core::array::from_fn(|i| self.body.joint_angle(i));
        self.body.place(&self.ground, x_m, y_m, heading_rad);
        let phi = self.body.position()[PHI];
        let position = self.body.state_mut().0;
        position[LEFT] = joints[0] - phi;
        position[RIGHT] = joints[1] - phi;
    }

    /// Longest substep from now on, in s: a shorter one for reference runs.
    pub fn set_substep_s(&mut self, substep_s: f64) {
        self.substep_s = substep_s;
    }

    /// Advances by `dt_s` seconds with the bridges held, in the order of [`model::sample::Motor`].
    pub fn advance(&mut self, dt_s: f64, bridges: &[BridgeState; MOTORS]) {
        if dt_s <= 0.0 {
            return;
        }
        // Rounding must not add a substep.
        let count = (dt_s / self.substep_s - 1e-6).ceil().max(1.0);
        let h = dt_s / count;
        for _ in 0..count as u64 {
            self.substep(h, bridges);
        }
        let time_ms = (self.time_s * 1e3 + 1e-6) as u64;
        for (i, encoder) in self.encoders.iter_mut().enumerate() {
            encoder.advance(self.body.joint_angle(i), time_ms);
        }
    }

    fn substep(&mut self, h: f64, bridges: &[BridgeState; MOTORS]) {
        let mut bridges = *bridges;
        if !self.has_spar {
            bridges[MotorIndex::Ballast as usize] = BridgeState::Open;
        }
        let before: [f64; MOTORS] = core::array::from_fn(|i| self.body.joint_rate(i));
        self.battery_v = self
            .battery
            .terminal_v(h, self.battery_v, &mut self.motors, &bridges, &before);
        let mut joints = [JointTorque::NONE; MOTORS];
        for (i, (joint, motor)) in joints.iter_mut().zip(&mut self.motors).enumerate() {
            *joint = motor.begin(h, bridges[i], self.battery_v, before[i]);
        }
        self.body.step(h, &self.ground, &joints);
        self.battery_a = self.battery.idle_a;
        for (motor, &rate) in self.motors.iter_mut().zip(self.body.mean_joint_rates()) {
            motor.end(rate);
            self.battery_a += motor.battery_current_a();
        }
        self.time_s += h;
        self.feel(h);
    }

    /// Lets the IMUs feel the last substep.
    fn feel(&mut self, h: f64) {
        let (u, a, gravity) = (self.body.speed(), self.body.acceleration(), self.body.gravity());
        let arm = motion_at(self.arm_radius_m, &self.body.arm_swing(), u, a, &gravity);
        self.arm_imu.advance(h, &arm);
        if self.has_spar {
            // The spar's angle is that of its lower end; the IMU sits above the axle.
            let spar = motion_at(-self.spar_radius_m, &self.body.spar_swing(), u, a, &gravity);
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

    /// An encoder, for its true count.
    pub fn encoder(&self, motor: MotorIndex) -> &Encoder {
        &self.encoders[motor as usize]
    }

    /// An encoder, to fail it.
    pub fn encoder_mut(&mut self, motor: MotorIndex) -> &mut Encoder {
        &mut self.encoders[motor as usize]
    }

    /// One conversion of the analogue inputs ([`BoardScales`]): battery voltage and the
    /// motor currents, with the converter's noise, saturated at its range.
    pub fn analog(&mut self) -> (u16, [u16; MOTORS]) {
        let mut count = |value: f64| (value + ANALOG_NOISE_COUNTS * self.analog_noise.normal()).round() as u16;
        let battery = count(self.battery_v / f64::from(self.scales.battery_v_per_count));
        let current = core::array::from_fn(|i| {
            let current = self.motors.get(i).map_or(0.0, Motor::mean_current_a);
            count(f64::from(self.scales.current_zero_count) + current / f64::from(self.scales.current_a_per_count))
        });
        (battery, current)
    }

    /// The IMU on the arm.
    pub fn arm_imu(&mut self) -> &mut Icm42688p {
        &mut self.arm_imu
    }

    /// The IMU on the camera spar. Without a spar there is none: its bus floats.
    pub fn spar_imu(&mut self) -> Option<&mut Icm42688p> {
        self.has_spar.then_some(&mut self.spar_imu)
    }

    /// The battery, to drain or weaken it.
    pub fn battery_mut(&mut self) -> &mut Battery {
        &mut self.battery
    }

    /// Puts chocks to the wheels (a hand on the rims) or takes them away.
    pub fn set_chocked(&mut self, chocked: bool) {
        self.body.set_chocked(chocked);
    }

    /// The bodies, for tests and for states that no sensor sees.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// The bodies, to set a state.
    pub fn body_mut(&mut self) -> &mut Body {
        &mut self.body
    }

    /// The ground.
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// The true state of the world.
    pub fn truth(&self) -> Truth {
        let (q, u) = (self.body.position(), self.body.speed());
        let [right, left] = *self.body.wheels();
        let vertical = self.body.vertical_rad();
        let [slope_right, slope_left] = self.body.path_slopes();
        let (spar, spar_rate) = if self.has_spar {
            (q[SPAR] + vertical, u[SPAR])
        } else {
            (0.0, 0.0)
        };
        Truth {
            time_s: self.time_s,
            x_m: q[FORWARD],
            y_m: q[SIDE],
            height_m: q[LIFT],
            heading_rad: q[YAW],
            yaw_rate_rad_s: u[YAW],
            speed_m_s: u[FORWARD],
            side_speed_m_s: u[SIDE],
            wheel_rate_rad_s: [u[LEFT], u[RIGHT]],
            phi_rad: q[PHI] + vertical,
            phi_rate_rad_s: u[PHI],
            spar_rad: spar,
            spar_rate_rad_s: spar_rate,
            ballast_rad: q[BALLAST] - q[SPAR],
            ballast_rate_rad_s: u[BALLAST] - u[SPAR],
            slope_rad: vertical + libm::atan(0.5 * (slope_right + slope_left)),
            normal_n: [left.normal_n, right.normal_n],
            longitudinal_n: [left.longitudinal_n, right.longitudinal_n],
            slip_m_s: [left.slip_m_s, right.slip_m_s],
            sliding: [left.sliding, right.sliding],
            lifted: [left.lifted, right.lifted],
            current_a: core::array::from_fn(|i| self.motors.get(i).map_or(0.0, Motor::mean_current_a)),
            torque_n_m: core::array::from_fn(|i| self.motors.get(i).map_or(0.0, Motor::torque_n_m)),
            battery_v: self.battery_v,
            battery_a: self.battery_a,
            chocked: self.body.chocked(),
        }
    }
}
