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
    /// IMUs: chassis, spar.
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

/// A vehicle on a bench with its wheels off the ground: motors with a first-order lag, upright, still
/// but for its sensors' noise. For tests of the board that need no dynamics.
#[derive(Debug, Clone)]
pub struct Bench {
    speed_counts_s: [f64; MOTORS],
    position_counts: [f64; MOTORS],
    /// Battery in V.
    pub battery_v: f64,
    noise: u64,
}

impl Bench {
    /// Speed at full duty in counts per second.
    pub const FULL_SPEED_COUNTS_S: f64 = 24_000.0;
    const LAG_S: f64 = 0.05;

    /// At rest with a full battery.
    pub fn new(battery_v: f64) -> Self {
        Self {
            speed_counts_s: [0.0; MOTORS],
            position_counts: [0.0; MOTORS],
            battery_v,
            noise: 1,
        }
    }

    /// A number in -`span` to `span`, evenly spread (a linear congruence, Knuth's MMIX).
    fn noise(&mut self, span: i32) -> i32 {
        self.noise = self.noise.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.noise >> 33) as i32 % (2 * span + 1) - span
    }
}

impl ClosedPlant for Bench {
    fn step(&mut self, seconds: f64, bridges: &[BridgeState; MOTORS]) -> Sensed {
        let mut sensed = Sensed {
            battery_mv: battery_mv(self.battery_v),
            current_mv: [1650; MOTORS],
            ..Sensed::default()
        };
        for imu in &mut sensed.imus {
            imu.specific_force_ug = [self.noise(3_000), self.noise(3_000), 1_000_000 + self.noise(3_000)];
            imu.rate_mdeg_s = std::array::from_fn(|_| self.noise(150));
        }
        for (n, bridge) in bridges.iter().enumerate() {
            let target = Self::FULL_SPEED_COUNTS_S * bridge.duty().unwrap_or(0.0);
            self.speed_counts_s[n] += seconds / Self::LAG_S * (target - self.speed_counts_s[n]);
            self.position_counts[n] += self.speed_counts_s[n] * seconds;
            sensed.encoder_counts[n] = self.position_counts[n].floor() as i64;
        }
        sensed
    }

    fn fork(&self) -> Box<dyn ClosedPlant> {
        Box::new(self.clone())
    }
}

/// Divider of 1:20 into the converter.
pub fn battery_mv(volts: f64) -> u32 {
    (volts * 1000.0 / 20.0).round().clamp(0.0, 3300.0) as u32
}
