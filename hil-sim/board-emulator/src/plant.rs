//! The seam to the vehicle around the board.

/// Motors, in the order of the firmware's arrays: left, right, camera.
pub const MOTORS: usize = 3;

/// What a bridge does to its motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BridgeState {
    /// No transistor conducts.
    Open,
    /// Both diagonals switch in turn, with dead time between them.
    Switching {
        /// Forward diagonal on, in ns of each period.
        forward_ns: u64,
        /// Reverse diagonal on, in ns of each period.
        reverse_ns: u64,
        /// The period in ns.
        period_ns: u64,
    },
    /// A diagonal conducts without switching: nothing the firmware ever asks for.
    Held,
}

impl BridgeState {
    /// Mean voltage as a fraction of the supply, -1 to 1, or `None` while the motor is disconnected.
    pub fn duty(self) -> Option<f64> {
        match self {
            Self::Switching {
                forward_ns,
                reverse_ns,
                period_ns,
            } if period_ns > 0 => Some((forward_ns as f64 - reverse_ns as f64) / period_ns as f64),
            _ => None,
        }
    }
}

/// What an IMU measures, on its own axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ImuSensed {
    /// The part does not answer: its bus floats.
    pub silent: bool,
    /// Angular rate in thousandths of a degree a second.
    pub rate_mdeg_s: [i32; 3],
    /// Specific force in millionths of a gravity.
    pub specific_force_ug: [i32; 3],
}

/// What the vehicle puts on the board's sensor pins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sensed {
    /// Encoder positions in counts.
    pub encoder_counts: [i64; MOTORS],
    /// IMUs: arm, spar.
    pub imus: [ImuSensed; 2],
    /// Battery divider's output in mV.
    pub battery_mv: u32,
    /// Current amplifiers' outputs in mV.
    pub current_mv: [u32; MOTORS],
}

/// A vehicle around the board.
pub trait ClosedPlant: Send + Sync {
    /// Moves on by `seconds` with the bridges as they stand, and senses.
    fn step(&mut self, seconds: f64, bridges: &[BridgeState; MOTORS]) -> Sensed;

    /// A copy, for a run that goes on from here another way.
    fn fork(&self) -> Box<dyn ClosedPlant>;
}

/// A motor with nothing but its own and its wheel's inertia to move, all at the motor's shaft.
#[derive(Debug, Clone, Copy)]
struct FreeMotor {
    constant_v_s: f64,
    resistance_ohm: f64,
    /// Of speed under voltage: inertia times resistance over the constant squared.
    lag_s: f64,
    rate_rad_s: f64,
    angle_rad: f64,
}

impl FreeMotor {
    /// Of speed with the bridge open: friction.
    const COASTING_LAG_S: f64 = 0.5;
    const COUNTS_PER_RAD: f64 = 1024.0 / std::f64::consts::TAU;

    /// Moves on; returns the current in A.
    fn step(&mut self, seconds: f64, voltage_v: Option<f64>) -> f64 {
        let (final_rate, lag) = match voltage_v {
            Some(voltage) => (voltage / self.constant_v_s, self.lag_s),
            None => (0.0, Self::COASTING_LAG_S),
        };
        let left = (-seconds / lag).exp();
        let lost = self.rate_rad_s - final_rate;
        self.angle_rad += final_rate * seconds + lost * lag * (1.0 - left);
        self.rate_rad_s = final_rate + lost * left;
        voltage_v.map_or(0.0, |voltage| {
            (voltage - self.constant_v_s * self.rate_rad_s) / self.resistance_ohm
        })
    }
}

/// The reference vehicle on a bench with its wheels off the ground: upright, still but for its sensors'
/// noise. For tests of the board that need no dynamics.
#[derive(Debug, Clone)]
pub struct Bench {
    motors: [FreeMotor; MOTORS],
    battery_v: f64,
    noise: u64,
}

impl Bench {
    /// At rest, with a battery that never sags.
    pub fn new(battery_v: f64) -> Self {
        let motor = |constant_v_s, resistance_ohm, lag_s| FreeMotor {
            constant_v_s,
            resistance_ohm,
            lag_s,
            rate_rad_s: 0.0,
            angle_rad: 0.0,
        };
        let wheel = motor(0.0302, 0.316, 0.01);
        Self {
            motors: [wheel, wheel, motor(0.0546, 5.853, 0.01)],
            battery_v,
            noise: 1,
        }
    }

    /// A number in -`span` to `span`, evenly spread (a linear congruence, Knuth's MMIX).
    fn noise(&mut self, span: i32) -> i32 {
        self.noise = self
            .noise
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.noise >> 33) as i32 % (2 * span + 1) - span
    }
}

impl ClosedPlant for Bench {
    fn step(&mut self, seconds: f64, bridges: &[BridgeState; MOTORS]) -> Sensed {
        let mut sensed = Sensed {
            battery_mv: battery_mv(self.battery_v),
            ..Sensed::default()
        };
        for imu in &mut sensed.imus {
            imu.specific_force_ug = [self.noise(3_000), self.noise(3_000), 1_000_000 + self.noise(3_000)];
            imu.rate_mdeg_s = std::array::from_fn(|_| self.noise(150));
        }
        for (n, (motor, bridge)) in self.motors.iter_mut().zip(bridges).enumerate() {
            let current = motor.step(seconds, bridge.duty().map(|duty| duty * self.battery_v));
            sensed.encoder_counts[n] = (motor.angle_rad * FreeMotor::COUNTS_PER_RAD).floor() as i64;
            sensed.current_mv[n] = current_mv(current);
        }
        sensed
    }

    fn fork(&self) -> Box<dyn ClosedPlant> {
        Box::new(self.clone())
    }
}

/// Current amplifiers: 60 A either side of mid-scale.
pub fn current_mv(amperes: f64) -> u32 {
    (1650.0 + amperes * 1650.0 / 60.0).round().clamp(0.0, 3300.0) as u32
}

/// Divider of 1:20 into the converter.
pub fn battery_mv(volts: f64) -> u32 {
    (volts * 1000.0 / 20.0).round().clamp(0.0, 3300.0) as u32
}
