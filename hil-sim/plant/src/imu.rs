//! The motion that an IMU feels at its position, and the analogue part of the sensor: low-pass, bias and noise.
//!
//! Axes: x forward, y left, z up while the body that carries the IMU hangs (or stands) vertically. The arm and the spar
//! swing forward with a positive angle, which is a rotation about -y: gyro y reads minus the angle's rate, and yaw
//! about the plane's normal appears in x and z according to the body's angle from the normal.

mod fault;
pub mod imperfection;
#[cfg(test)]
mod tests;

use core::f64::consts::{PI, SQRT_2};

use super::body::{AxleRoll, FORWARD, Gravity, LIFT, SIDE, Swing, YAW};
use super::fault::SensorFault;
use super::noise::Noise;
use fault::Faults;
pub use fault::ImuChannels;
use imperfection::{Imperfection, ImuSettings, Temperature, Vibration};

/// Specific force in m/s^2 and angular rate in rad/s in the sensor's axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion {
    /// Acceleration less gravity, in m/s^2.
    pub specific_force: [f64; 3],
    /// Angular rate, in rad/s.
    pub rate: [f64; 3],
}

/// The motion at `radius_m` from the axle towards the hanging end of a swinging body (negative above the axle), for an
/// axle with these `speeds` and `accelerations` ([`super::body`]).
///
/// The velocity of that place is `(u + a') e1 + (w + yaw a) e2 + (v_z + b') e3` with a = radius sin,
/// b = -radius cos in axes that turn with the yaw rate; the result is the derivative of this velocity less gravity, in
/// the body's axes.
#[inline]
pub fn motion_at(
    radius_m: f64,
    swing: &Swing,
    speeds: &[f64; 9],
    accelerations: &[f64; 9],
    gravity: &Gravity,
    roll: AxleRoll,
) -> Motion {
    let (sin, cos) = swing.sin_cos;
    let yaw = speeds[YAW];
    let ahead = radius_m * sin;
    let ahead_rate = radius_m * cos * swing.rate;
    let rate2 = swing.rate * swing.rate;
    let ahead_acceleration = radius_m * (cos * swing.acceleration - sin * rate2);
    let above_acceleration = radius_m * (sin * swing.acceleration + cos * rate2);
    let forward = accelerations[FORWARD] + ahead_acceleration - yaw * (speeds[SIDE] + yaw * ahead) + gravity.along;
    let left =
        accelerations[SIDE] + accelerations[YAW] * ahead + yaw * (speeds[FORWARD] + 2.0 * ahead_rate) + gravity.across;
    let up = accelerations[LIFT] + above_acceleration + gravity.normal;
    Motion {
        specific_force: [cos * forward + sin * up, left, cos * up - sin * forward],
        // The axle turns with its heading, and about it as the roll changes; rolled, it points a part of the turn along itself.
        rate: [
            sin * yaw + cos * roll.rate,
            roll.sin * yaw - swing.rate,
            cos * yaw - sin * roll.rate,
        ],
    }
}

/// Errors of an IMU's six channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuErrors {
    /// Gyro noise density in rad/s/sqrt(Hz). Data sheet: 2.8 mdps/sqrt(Hz).
    pub gyro_noise: f64,
    /// Accelerometer noise density in m/s^2/sqrt(Hz). Data sheet: 70 ug/sqrt(Hz).
    pub accel_noise: f64,
    /// Standard deviation of each gyro axis's bias in rad/s, drawn once. Data sheet: +-0.5 deg/s initial,
    /// interpreted as three standard deviations.
    pub gyro_bias: f64,
    /// Standard deviation of each accelerometer axis's bias in m/s^2. The data sheet's +-20 mg applies before the
    /// zero-g calibration that any vehicle with a tilt estimate needs; such a calibration leaves 2 mg over temperature.
    pub accel_bias: f64,
}

impl ImuErrors {
    /// A perfect sensor, for tests and for separating errors.
    pub const NONE: Self = Self {
        gyro_noise: 0.0,
        accel_noise: 0.0,
        gyro_bias: 0.0,
        accel_bias: 0.0,
    };
}

impl Default for ImuErrors {
    fn default() -> Self {
        const DEGREE: f64 = PI / 180.0;
        const G: f64 = model::vehicle::GRAVITY_M_S2;
        Self {
            gyro_noise: 2.8e-3 * DEGREE,
            accel_noise: 70e-6 * G,
            gyro_bias: 0.5 * DEGREE / 3.0,
            accel_bias: 2e-3 * G,
        }
    }
}

/// Second-order Butterworth low-pass (the part's filter), exact for an input that is constant within each step, and
/// therefore driven by the mean of the input. With the input `u`, the output `y` and `w` the corner's angular
/// frequency, `y'' + sqrt(2) w y' + w^2 (y - u) = 0`.
#[derive(Debug, Clone, Copy)]
pub struct Butterworth {
    corner_hz: f64,
    step_s: f64,
    /// Over a step, with `e = y - u` and `v = y' / w`: e becomes `keep e + swap v`, v becomes `turn v - swap e`.
    keep: f64,
    swap: f64,
    turn: f64,
    /// The states y and v of each channel.
    output: [f64; 6],
    rate: [f64; 6],
}

impl Butterworth {
    /// A filter with its -3 dB point at `corner_hz`.
    pub fn new(corner_hz: f64) -> Self {
        Self {
            corner_hz,
            step_s: 0.0,
            keep: 0.0,
            swap: 0.0,
            turn: 0.0,
            output: [0.0; 6],
            rate: [0.0; 6],
        }
    }

    /// The -3 dB point in Hz.
    pub fn corner_hz(&self) -> f64 {
        self.corner_hz
    }

    /// Moves the corner, keeping the states.
    pub fn set_corner_hz(&mut self, corner_hz: f64) {
        self.corner_hz = corner_hz;
        self.step_s = 0.0;
    }

    /// One step of `h` seconds with the mean `input` over it: the filtered channels at its end.
    #[inline]
    pub fn advance(&mut self, h: f64, input: &[f64; 6]) -> [f64; 6] {
        if self.step_s != h {
            self.step_s = h;
            // The roots are w (-1 +- i) / sqrt(2).
            let angle = 2.0 * PI * self.corner_hz * h / SQRT_2;
            let decay = libm::exp(-angle);
            let (sin, cos) = libm::sincos(angle);
            self.keep = decay * (cos + sin);
            self.swap = decay * SQRT_2 * sin;
            self.turn = decay * (cos - sin);
        }
        // Separate arrays of each quantity let one instruction process two channels.
        let (output, rate) = (self.output, self.rate);
        for i in 0..6 {
            let error = output[i] - input[i];
            self.output[i] = input[i] + self.keep * error + self.swap * rate[i];
            self.rate[i] = self.turn * rate[i] - self.swap * error;
        }
        self.output
    }

    /// Sets the filter to the steady state of `input`.
    pub fn settle(&mut self, input: &[f64; 6]) {
        self.output = *input;
        self.rate = [0.0; 6];
    }
}

/// The analogue side of an IMU: filtered motion with bias and noise, channels accelerometer x, y, z (m/s^2)
/// then gyro x, y, z (rad/s).
#[derive(Debug, Clone)]
pub struct ImuSensor {
    errors: ImuErrors,
    bias: [f64; 6],
    filter: Butterworth,
    /// Standard deviations of the noise of accelerometer and gyro behind the filter.
    noise_deviations: [f64; 2],
    settled: bool,
    noise: Noise,
    faults: Faults,
    temperature: Temperature,
    imperfection: Option<Box<Imperfection>>,
}

/// Standard deviations of the noise of accelerometer and gyro behind a filter of this corner.
fn noise_deviations(errors: &ImuErrors, corner_hz: f64) -> [f64; 2] {
    // Equivalent noise bandwidth of a second-order Butterworth: 1.11 of its corner.
    let root_bandwidth = (1.11 * corner_hz).sqrt();
    [errors.accel_noise * root_bandwidth, errors.gyro_noise * root_bandwidth]
}

/// Default temperature of a part, in C.
const TEMPERATURE_C: f64 = 30.0;

impl ImuSensor {
    /// A sensor that draws first its biases and then its noise from `noise`.
    pub fn new(errors: ImuErrors, corner_hz: f64, mut noise: Noise) -> Self {
        let bias = core::array::from_fn(|i| {
            let deviation = if i < 3 { errors.accel_bias } else { errors.gyro_bias };
            deviation * noise.normal()
        });
        Self {
            errors,
            bias,
            filter: Butterworth::new(corner_hz),
            noise_deviations: noise_deviations(&errors, corner_hz),
            settled: false,
            noise,
            faults: Faults::new(),
            temperature: Temperature::steady(TEMPERATURE_C),
            imperfection: None,
        }
    }

    /// Mounts the sensor according to `settings`.
    pub fn mount(&mut self, settings: &ImuSettings) {
        self.temperature = Temperature::steady(settings.temperature_c);
        if *settings != ImuSettings::default() {
            self.imperfection = Some(Box::new(Imperfection::new(settings)));
        }
    }

    /// Shakes the sensor from now on; an amplitude of 0 ends it.
    pub fn shake(&mut self, vibration: &Vibration) {
        let perfect = || Box::new(Imperfection::new(&ImuSettings::default()));
        self.imperfection.get_or_insert_with(perfect).vibration = *vibration;
    }

    /// Brings the sensor to the temperature `to_c` within `over_s` seconds from `now_s`.
    pub fn heat(&mut self, now_s: f64, to_c: f64, over_s: f64) {
        self.temperature.ramp(now_s, to_c, over_s);
    }

    /// The sensor's temperature at `now_s`, in C.
    pub fn temperature_c(&self, now_s: f64) -> f64 {
        self.temperature.at(now_s)
    }

    /// Makes the sensor fail, or repairs it.
    pub fn set_fault(&mut self, fault: SensorFault) {
        self.faults.set(fault);
    }

    /// The present fault.
    pub fn fault(&self) -> SensorFault {
        self.faults.fault()
    }

    /// One tick of the sensor's clock at `now_s`: returns the sample, faults included, or `None` if the sensor takes no
    /// sample.
    #[inline]
    pub fn sample(&mut self, now_s: f64) -> Option<ImuChannels> {
        if self.faults.skips(now_s) {
            return None;
        }
        let measured = self.measure(now_s);
        Some(self.faults.give(now_s, measured, &mut self.noise))
    }

    /// The drawn biases.
    pub fn bias(&self) -> &[f64; 6] {
        &self.bias
    }

    /// The filter.
    pub fn filter(&self) -> &Butterworth {
        &self.filter
    }

    /// Moves the filter's corner.
    pub fn set_corner_hz(&mut self, corner_hz: f64) {
        self.filter.set_corner_hz(corner_hz);
        self.noise_deviations = noise_deviations(&self.errors, corner_hz);
    }

    /// Follows the motion for `h` seconds.
    #[inline]
    pub fn advance(&mut self, h: f64, motion: &Motion) {
        let (f, w) = (&motion.specific_force, &motion.rate);
        let input = [f[0], f[1], f[2], w[0], w[1], w[2]];
        if !self.settled {
            // The filter is in its steady state when the simulation begins.
            self.settled = true;
            self.filter.settle(&input);
        }
        self.filter.advance(h, &input);
    }

    /// Measures the filtered motion with the sensor's imperfections, bias and new noise.
    #[inline]
    fn measure(&mut self, now_s: f64) -> ImuChannels {
        let seen = match &self.imperfection {
            None => self.filter.output,
            Some(imperfection) => imperfection.apply(
                &self.filter.output,
                now_s,
                self.temperature.at(now_s),
                self.filter.corner_hz(),
            ),
        };
        let [accel, gyro] = self.noise_deviations;
        let noise = &mut self.noise;
        let mut noises = [0.0; 6];
        if accel > 0.0 && gyro > 0.0 {
            noises = noise.normals();
        } else if accel > 0.0 {
            noises[..3].copy_from_slice(&noise.normals::<3>());
        } else if gyro > 0.0 {
            noises[3..].copy_from_slice(&noise.normals::<3>());
        }
        let deviations = [accel, accel, accel, gyro, gyro, gyro];
        core::array::from_fn(|i| seen[i] + deviations[i] * noises[i] + self.bias[i])
    }

    /// Random bits of this sensor's stream.
    pub fn bits(&mut self) -> u64 {
        self.noise.bits()
    }
}
