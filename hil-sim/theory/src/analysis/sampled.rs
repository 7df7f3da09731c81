//! The planar vehicle under the vehicle's own speed loop: sampled, filtered and delayed as on the board, nondimensional.
//!
//! A tick takes some microseconds, so a search can make a hundred thousand drives. The full plant (tyres, kerbs,
//! sensors, the spar's own swing) is the virtual board's.

use model::control::landing::{Balance, MotionByTorque};
use model::control::speed::SpeedInput;
use model::control::speed_controller::SpeedController;
use model::sample::TICK_S;
use model::vehicle::{BRIDGE_SHARE, Scales, Vehicle};

/// Arm angle, rad, beyond which the arm has turned over.
pub const WHIRL_RAD: f64 = core::f64::consts::PI;

/// The true vehicle; its law knows only the vehicle file. Nondimensional, in the units of ch. 3; angles in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledPlant {
    /// Inertias.
    pub balance: Balance<f64>,
    /// Total damping, back-EMF included.
    pub zeta: f64,
    /// Torque per unit of voltage; 1 if the file is right.
    pub torque_per_voltage: f64,
    /// Slope, rad.
    pub beta: f64,
    /// Largest torque of the motors in either direction.
    pub torque_max: f64,
    /// Largest voltage of the supply in either direction.
    pub voltage_max: f64,
}

/// Factors of the nine parameters that may be wrong in a vehicle file. Each is a ratio to the vehicle file's value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors {
    /// Arm's mass.
    pub arm_mass: f64,
    /// Arm's length.
    pub arm_length: f64,
    /// Wheels' mass.
    pub wheel_mass: f64,
    /// Wheels' inertia.
    pub wheel_inertia: f64,
    /// Rotors' inertia.
    pub rotor_inertia: f64,
    /// Spar's mass.
    pub spar_mass: f64,
    /// Bearing damping.
    pub bearing_damping: f64,
    /// Torque and back-EMF constant.
    pub motor_constant: f64,
    /// Armature resistance.
    pub resistance: f64,
}

impl Factors {
    /// The vehicle of the file.
    pub const NONE: Self = Self::from_array([1.0; 9]);

    /// Builds the factors from an array in the order of the fields.
    pub const fn from_array(f: [f64; 9]) -> Self {
        Self {
            arm_mass: f[0],
            arm_length: f[1],
            wheel_mass: f[2],
            wheel_inertia: f[3],
            rotor_inertia: f[4],
            spar_mass: f[5],
            bearing_damping: f[6],
            motor_constant: f[7],
            resistance: f[8],
        }
    }
}

impl SampledPlant {
    /// The plant of a vehicle whose parameters differ from its file by `factors`, on the slope `beta`.
    pub fn new(vehicle: &Vehicle<f64>, factors: &Factors, beta: f64) -> Self {
        let (planar, p) = (vehicle.planar(beta), vehicle.parameters());
        let scales = vehicle.scales();
        let f = factors;
        let moment = planar.alpha * planar.l * f.arm_mass * f.arm_length;
        let bearing = p.body.bearing_damping_n_m_s / (scales.torque_n_m * scales.time_s);
        let back_emf = planar.zeta - bearing;
        let motor = &p.drive_motor;
        let torque_limit = 2.0 * motor.current_limit_a * motor.torque_constant_n_m_per_a * motor.gear_ratio;
        Self {
            balance: Balance {
                mass: planar.alpha * f.arm_mass
                    + (1.0 - planar.alpha) * f.wheel_mass
                    + vehicle.spar_mass_ratio() * f.spar_mass,
                alpha_l: moment,
                alpha_l2: moment * planar.l * f.arm_length,
                mu: planar.mu * f.wheel_inertia,
                nu: planar.nu * f.rotor_inertia,
            },
            zeta: bearing * f.bearing_damping + back_emf * f.motor_constant * f.motor_constant / f.resistance,
            torque_per_voltage: f.motor_constant / f.resistance,
            beta,
            torque_max: torque_limit * f.motor_constant / scales.torque_n_m,
            voltage_max: scales.voltage_from_si(BRIDGE_SHARE * p.battery.nominal_v),
        }
    }

    /// Sine of the arm's standing angle on the slope; above 1 the vehicle cannot stand.
    pub fn standing_sin_phi(&self) -> f64 {
        self.balance.mass * libm::sin(self.beta) / self.balance.alpha_l
    }
}

/// One tick of a drive, nondimensional; angles in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledRow {
    /// Time, in time units.
    pub time: f64,
    /// Arm angle, rad.
    pub phi: f64,
    /// theta'.
    pub theta_rate: f64,
    /// phi'.
    pub phi_rate: f64,
    /// Friction on the wheels, up the slope positive.
    pub friction: f64,
    /// Normal force on the wheels.
    pub normal: f64,
}

/// Errors of the vehicle's sensing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledSensing {
    /// Ticks until a command acts: 0 or more.
    pub delay: usize,
    /// Standard deviations of the noise on phi (rad), phi' and the joint rate (per time unit).
    pub noise: [f64; 3],
}

/// A drive of a sampled plant.
#[derive(Debug, Clone)]
pub struct SampledDrive<'a> {
    /// The vehicle of the file, which the law knows.
    pub vehicle: &'a Vehicle<f64>,
    /// The true vehicle.
    pub plant: SampledPlant,
    /// The errors of its sensing.
    pub sensing: SampledSensing,
    /// Commanded speeds (in speed units), each with its start time (in time units).
    pub targets: &'a [(f64, f64)],
    /// Duration, in time units.
    pub duration: f64,
}

impl SampledDrive<'_> {
    /// Simulates a drive under the law of the vehicle's file, starting from standing on the slope, and passes each tick
    /// to `see`. The drive ends when `see` returns false or the time is up. `noise` returns numbers with mean 0 and
    /// deviation 1.
    pub fn run(&self, noise: impl FnMut() -> f64, see: impl FnMut(&SampledRow) -> bool) {
        let mut law = SpeedController::new(&cast(self.vehicle), TICK_S);
        law.reset(0.0);
        let step = |input: &SpeedInput| {
            let voltage_v = law.step(input).voltage_v;
            (voltage_v, law.slope_lesson().unwrap_or_default())
        };
        self.run_under(step, noise, see);
    }

    /// The same under any `law`, which returns the voltage of each motor in V and the change of the estimator's sine of
    /// the slope.
    pub fn run_under(
        &self,
        mut law: impl FnMut(&SpeedInput) -> (f32, f32),
        mut noise: impl FnMut() -> f64,
        mut see: impl FnMut(&SampledRow) -> bool,
    ) {
        let scales = self.vehicle.scales();
        let parameters = self.vehicle.parameters();
        let tick = f64::from(TICK_S) / scales.time_s;
        let lag = parameters.estimator.wheel_rate_time_constant_s / scales.time_s;
        let gain = 1.0 - libm::exp(-tick / lag);
        let plant = &self.plant;
        let slope = (libm::sin(plant.beta), libm::cos(plant.beta));
        let phi = libm::asin(plant.standing_sin_phi().clamp(-1.0, 1.0));
        let mut motion = SampledMotion {
            phi,
            ..SampledMotion::default()
        };
        // The delay line is filled with the hold voltage, which acts first.
        let hold = plant.balance.mass * slope.0 / plant.torque_per_voltage;
        let mut line = vec![hold; self.sensing.delay];
        let mut next = 0;
        // The slope that an estimator at rest computes from the file's weights.
        let file = self.vehicle.planar(0.0);
        let mut sin_slope = (file.alpha * file.l * libm::sin(phi) / (1.0 + self.vehicle.spar_mass_ratio())) as f32;
        let ticks = (self.duration / tick) as u32;
        for k in 0..ticks {
            let time = f64::from(k) * tick;
            while next + 1 < self.targets.len() && time >= self.targets[next + 1].0 {
                next += 1;
            }
            let target = match self.targets.get(next) {
                Some(&(from, target)) if time >= from => target,
                _ => 0.0,
            };
            motion.filter(gain);
            let [n0, n1, n2] = self.sensing.noise;
            let [of_rate, of_angle] = [n1 * noise(), n0 * noise()];
            let noises = [of_angle, of_rate, n2 * noise()];
            let (voltage_v, lesson) = law(&SpeedInput {
                target_m_s: (target * scales.speed_m_s) as f32,
                voltage_max_v: scales.voltage_to_si(plant.voltage_max) as f32,
                ..motion.sensed(&scales, sin_slope, noises)
            });
            sin_slope += lesson;
            let commanded = scales.voltage_from_si(f64::from(voltage_v));
            line.push(commanded);
            let voltage = line.remove(0);
            let forces = motion.by_torque(plant, slope);
            let now = motion.torque(plant, voltage);
            let row = SampledRow {
                time,
                phi: motion.phi,
                theta_rate: motion.theta_rate,
                phi_rate: motion.phi_rate,
                friction: forces.friction.at(now),
                normal: forces.normal.at(now),
            };
            if !see(&row) {
                return;
            }
            motion.advance(plant, slope, voltage, tick);
        }
    }
}

/// The motion of the planar vehicle and the states of its wheel-rate filter, nondimensional.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct SampledMotion {
    pub(super) theta: f64,
    pub(super) phi: f64,
    pub(super) theta_rate: f64,
    pub(super) phi_rate: f64,
    /// The joint rate behind the filter's first and second stage.
    pub(super) stages: [f64; 2],
}

impl SampledMotion {
    /// One tick of the wheel-rate filter, each of whose stages has this gain.
    pub(super) fn filter(&mut self, gain: f64) {
        self.stages[0] += gain * (self.theta_rate + self.phi_rate - self.stages[0]);
        self.stages[1] += gain * (self.stages[0] - self.stages[1]);
    }

    /// The law's input with these `noises` on phi, phi' and the joint rate; target and supply are 0.
    pub(super) fn sensed(&self, scales: &Scales<f64>, sin_slope: f32, noises: [f64; 3]) -> SpeedInput {
        let sensed_rate = self.phi_rate + noises[1];
        let sensed_phi = (self.phi + noises[0]) as f32;
        SpeedInput {
            target_m_s: 0.0,
            phi_rad: sensed_phi,
            phi_sin_cos: libm::sincosf(sensed_phi),
            theta_rate_rad_s: ((self.stages[1] + noises[2] - sensed_rate) / scales.time_s) as f32,
            phi_rate_rad_s: (sensed_rate / scales.time_s) as f32,
            slope_sin_cos: (sin_slope, libm::sqrtf(1.0 - sin_slope * sin_slope)),
            slope_turn_per_s: 0.0,
            turns: false,
            distance_m: (self.theta * scales.length_m) as f32,
            sliding_over_m_s: None,
            voltage_max_v: 0.0,
        }
    }

    /// The torque of the motors at this voltage.
    fn torque(&self, plant: &SampledPlant, voltage: f64) -> f64 {
        let damping = plant.zeta * (self.theta_rate + self.phi_rate);
        (plant.torque_per_voltage * voltage - damping).clamp(-plant.torque_max, plant.torque_max)
    }

    /// Accelerations and contact forces as functions of the torque, on a slope of this sine and cosine.
    fn by_torque(&self, plant: &SampledPlant, slope: (f64, f64)) -> MotionByTorque<f64> {
        let arm = (libm::sin(self.phi), libm::cos(self.phi));
        plant.balance.motion(arm, self.phi_rate, slope)
    }

    /// One tick at a voltage.
    pub(super) fn advance(&mut self, plant: &SampledPlant, slope: (f64, f64), voltage: f64, tick: f64) {
        let h = tick / f64::from(SUBSTEPS);
        for _ in 0..SUBSTEPS {
            let motion = self.by_torque(plant, slope);
            let torque = self.torque(plant, voltage);
            self.theta_rate += h * motion.wheel.at(torque);
            self.phi_rate += h * motion.arm.at(torque);
            self.theta += h * self.theta_rate;
            self.phi += h * self.phi_rate;
        }
    }
}

/// Semi-implicit Euler steps per tick: the fastest pole, 42 per time unit, is 15 steps away.
const SUBSTEPS: u32 = 4;

/// The vehicle in the law's single precision.
pub(super) fn cast(vehicle: &Vehicle<f64>) -> Vehicle<f32> {
    // A checked vehicle is also valid in single precision, because vehicle files are checked in both precisions.
    Vehicle::new(vehicle.parameters().cast()).expect("a checked vehicle")
}
