//! A vehicle on a test bench, for tests without the simulator.

use firmware::drive_board::SCALES;
use model::analog::Analog;

use super::closed_plant::{ClosedPlant, millivolts, slopes_uv_per_us};
use crate::board::{BridgeOutput, MOTORS, SensedAtPins};

/// A motor whose only load is its own inertia and its wheel's inertia, referred to the motor's shaft.
#[derive(Debug, Clone, Copy)]
struct FreeMotor {
    constant_v_s: f64,
    resistance_ohm: f64,
    /// Time constant of the speed under voltage: inertia times resistance divided by the square of the motor
    /// constant.
    lag_s: f64,
    rate_rad_s: f64,
    angle_rad: f64,
}

impl FreeMotor {
    /// Time constant of the speed with the bridge open, from friction.
    const COASTING_LAG_S: f64 = 0.5;
    const COUNTS_PER_RAD: f64 = 1024.0 / std::f64::consts::TAU;

    /// Advances by `seconds`; returns the current in A.
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

/// The reference vehicle on a bench with its wheels off the ground: upright and at rest, with noise on its
/// sensors. For tests of the board without dynamics.
#[derive(Debug, Clone)]
pub struct BenchVehicle {
    motors: [FreeMotor; MOTORS],
    battery_v: f64,
    noise: u64,
}

impl BenchVehicle {
    /// Inductances of the armatures, in H.
    pub const INDUCTANCES_H: [f64; MOTORS] = [80e-6, 80e-6, 600e-6];

    /// The vehicle at rest, with a battery that never sags; `battery_v` is its voltage in V.
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

    /// A number from -`span` to `span`, uniformly distributed (linear congruential generator, Knuth's MMIX).
    fn noise(&mut self, span: i32) -> i32 {
        self.noise = self
            .noise
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.noise >> 33) as i32 % (2 * span + 1) - span
    }
}

impl ClosedPlant for BenchVehicle {
    fn step(&mut self, seconds: f64, bridges: &[BridgeOutput; MOTORS]) -> SensedAtPins {
        let mut sensed = SensedAtPins::default();
        for imu in &mut sensed.imus {
            imu.specific_force_ug = [self.noise(3_000), self.noise(3_000), 1_000_000 + self.noise(3_000)];
            imu.rate_mdeg_s = std::array::from_fn(|_| self.noise(150));
        }
        let mut current_a = [0.0; MOTORS];
        for (n, (motor, bridge)) in self.motors.iter_mut().zip(bridges).enumerate() {
            current_a[n] = motor.step(seconds, bridge.duty().map(|duty| duty * self.battery_v));
            sensed.encoder_counts[n] = (motor.angle_rad * FreeMotor::COUNTS_PER_RAD).floor() as i64;
        }
        let [left, right, ballast] = current_a;
        let mut values = Analog::all(0.0);
        values.battery_voltage = self.battery_v;
        values.left_current = left;
        values.right_current = right;
        values.ballast_current = ballast;
        sensed.current_slope_uv_per_us = slopes_uv_per_us(self.battery_v, Self::INDUCTANCES_H);
        sensed.analog_mv = values.with(&SCALES.analog, |value, scale| millivolts(scale.counts(value)));
        sensed
    }

    fn fork(&self) -> Box<dyn ClosedPlant> {
        Box::new(self.clone())
    }
}
