//! The ICM-42688-P as seen from its SPI bus: banks, registers, data.
//!
//! Addresses, reset values, codes and times are those of the part's data sheet (DS-000347). Simulated: reset, power
//! modes with their start-up times, full scales, data rates, the user filter's bandwidth, data-ready status, invalid
//! data (-32768) until a sensor has started up, burst reads with ascending addresses, banks, the adaptive full scale's
//! stalls (`adaptive`). Stored without effect: every other register of bank 0 and the other banks. Faults belong to
//! the sensor ([`super::imu`]), not to the registers. Absent: FIFO, APEX functions, I3C, external clock.

use model::vehicle::GRAVITY_M_S2;

use super::fault::SensorFault;
use super::imu::imperfection::ImuSettings;
use super::imu::{ImuErrors, ImuSensor, Motion};
use super::noise::Noise;

mod adaptive;
mod banks;
mod bus;
pub mod registers;
#[cfg(test)]
mod tests;

use adaptive::AdaptiveRange;
use banks::{Banks, Words};
use bus::Transfer;
use registers as reg;

/// Contents of the data registers while a sensor is off or starting up.
const INVALID: i16 = i16::MIN;
/// One of the two sensors: its power-up and its clock, in s of the plant.
#[derive(Debug, Clone, Copy, Default)]
struct Channel {
    on: bool,
    valid_from_s: f64,
    next_s: f64,
    /// Time between two samples, s.
    period_s: f64,
    /// Counts per unit of the measured quantity, m/s^2 or rad/s.
    counts_per_unit: f64,
}

impl Channel {
    /// The clock's last tick until `end_s` that has not been served, if there is one; the clock stands there then.
    fn last_until(&mut self, end_s: f64) -> Option<f64> {
        // A nanosecond of slack: the steps' lengths are rounded.
        let passed_s = end_s + 1e-9 - self.next_s;
        if !self.on || passed_s < 0.0 {
            return None;
        }
        self.next_s += self.period_s * libm::floor(passed_s / self.period_s);
        Some(self.next_s.min(end_s))
    }

    /// The clock has ticked at `now_s`.
    fn tick(&mut self, now_s: f64) {
        self.next_s += self.period_s;
        if self.next_s < now_s {
            // A step may span several ticks; the part then measures once.
            self.next_s = now_s + self.period_s;
        }
    }
}

/// An ICM-42688-P.
#[derive(Debug, Clone)]
pub struct Icm42688pModel {
    banks: Banks,
    sensor: ImuSensor,
    accel: Channel,
    gyro: Channel,
    time_s: f64,
    /// Time at which the part answers again after a reset, in s.
    ready_from_s: f64,
    adaptive: AdaptiveRange,
    /// The temperature last measured, C, and its register word, kept because the temperature seldom changes.
    temperature: (f64, i16),
    transfer: Transfer,
    /// A sample that arrived during a burst read.
    pending: Option<Words>,
    /// Error of the part's clock, share; `None` where it measures in step with whoever reads it.
    clock_error: Option<f64>,
    /// When the part last measured.
    measured_s: f64,
}

/// Least time between two samples that the model computes for a part in step with the ticks, s: no tick reads the samples between
/// them.
const UNSEEN_S: f64 = 1e-3;

impl Icm42688pModel {
    /// A part that has just been powered: its sensors are off.
    pub fn new(errors: ImuErrors, noise: Noise) -> Self {
        let mut chip = Self {
            banks: Banks::reset(),
            sensor: ImuSensor::new(errors, 250.0, noise),
            accel: Channel::default(),
            gyro: Channel::default(),
            time_s: 0.0,
            ready_from_s: 0.0,
            adaptive: AdaptiveRange::default(),
            // 25 C corresponds to 0.
            temperature: (25.0, 0),
            transfer: Transfer::Deselected,
            pending: None,
            clock_error: Some(0.0),
            measured_s: 0.0,
        };
        chip.reset();
        chip
    }

    /// Makes the part fail, or repairs it.
    pub fn set_fault(&mut self, fault: SensorFault) {
        self.sensor.set_fault(fault);
    }

    /// The present fault.
    pub fn fault(&self) -> SensorFault {
        self.sensor.fault()
    }

    /// The sensor behind the registers.
    pub fn sensor(&self) -> &ImuSensor {
        &self.sensor
    }

    /// The sensor behind the registers, mutable, to mount, shake or heat it.
    pub fn sensor_mut(&mut self) -> &mut ImuSensor {
        &mut self.sensor
    }

    /// Mounts the part as `settings` say. Without an error of its clock it then measures in step with the ticks of who reads it.
    pub fn mount(&mut self, settings: &ImuSettings) {
        self.sensor.mount(settings);
        self.clock_error = (settings.clock_error != 0.0).then_some(settings.clock_error);
        self.configure();
    }

    /// How long ago the part measured what it last measured, in s. For tests.
    pub fn sample_age_s(&self) -> f64 {
        self.time_s - self.measured_s
    }

    /// Warms or cools the part from now on.
    pub fn heat(&mut self, to_c: f64, over_s: f64) {
        self.sensor.heat(self.time_s, to_c, over_s);
    }

    /// Temperature, accelerometer and gyro words of the data registers; `None` while the part does not answer.
    pub fn data(&self) -> Option<[i16; 7]> {
        (!self.dead()).then(|| self.banks.words())
    }

    /// Follows the motion for `h` seconds, measuring whenever a data rate's time has come.
    #[inline]
    pub fn advance(&mut self, h: f64, motion: &Motion) {
        if self.clock_error.is_some() {
            self.advance_by_its_clock(h, motion);
            return;
        }
        self.time_s += h;
        self.sensor.advance(h, motion);
        // A nanosecond of slack, because the steps' lengths are rounded.
        let due = self.time_s + 1e-9;
        let accel_due = self.accel.on && due >= self.accel.next_s;
        let gyro_due = self.gyro.on && due >= self.gyro.next_s;
        if accel_due || gyro_due {
            self.sample(accel_due, gyro_due);
        }
    }

    /// As [`Self::advance`], but stops where a sensor measures for the last time within the step by the part's clock: no tick reads
    /// the samples before that one. A function of its own, because few vehicles have a part with its own clock.
    #[inline(never)]
    fn advance_by_its_clock(&mut self, h: f64, motion: &Motion) {
        let end_s = self.time_s + h;
        let mut due = [&mut self.accel, &mut self.gyro].map(|channel| channel.last_until(end_s));
        loop {
            let next_s = due.iter().flatten().copied().reduce(f64::min);
            let to_s = next_s.unwrap_or(end_s);
            if to_s > self.time_s {
                self.sensor.advance(to_s - self.time_s, motion);
                self.time_s = to_s;
            }
            if next_s.is_none() {
                return;
            }
            let [accel_due, gyro_due] = due.map(|at_s| at_s == next_s);
            self.sample(accel_due, gyro_due);
            due = due.map(|at_s| at_s.filter(|_| at_s != next_s));
        }
    }

    fn dead(&self) -> bool {
        let fault = self.sensor.fault();
        fault != SensorFault::None && fault.is_dead_at((self.time_s * 1e3) as u64)
    }

    /// Sets every register to its reset value and switches both sensors off.
    fn reset(&mut self) {
        self.banks = Banks::reset();
        self.accel = Channel::default();
        self.gyro = Channel::default();
        self.pending = None;
        self.banks.set_words(&[INVALID; 7]);
        self.configure();
    }

    /// PWR_MGMT0: switches the sensors.
    fn power(&mut self, value: u8) {
        let (now, rates) = (self.time_s, self.rates());
        let switch = |channel: &mut Channel, on: bool, start_up_s: f64, rate_hz: Option<f64>| {
            let on = on && rate_hz.is_some();
            if on && !channel.on {
                channel.valid_from_s = now + start_up_s;
                channel.next_s = now + channel.period_s;
            }
            channel.on = on;
        };
        // Only the low-noise mode measures at the rates used here; the gyro's stand-by mode does not measure.
        let gyro_on = value >> 2 & 3 == reg::MODE_LOW_NOISE;
        let accel_on = value & 3 == reg::MODE_LOW_NOISE;
        switch(&mut self.gyro, gyro_on, reg::GYRO_START_S, rates.1);
        switch(&mut self.accel, accel_on, reg::ACCEL_START_S, rates.0);
        let mut words = self.banks.words();
        if !self.accel.on {
            words[1..4].fill(INVALID);
        }
        if !self.gyro.on {
            words[4..].fill(INVALID);
        }
        self.banks.set_words(&words);
    }

    /// Rates of accelerometer and gyro in Hz, `None` for a reserved code.
    fn rates(&self) -> (Option<f64>, Option<f64>) {
        (
            reg::data_rate_hz(self.banks.get(0, reg::ACCEL_CONFIG0)),
            reg::data_rate_hz(self.banks.get(0, reg::GYRO_CONFIG0)),
        )
    }

    /// Applies a new rate, full scale or bandwidth.
    fn configure(&mut self) {
        let (accel_rate, gyro_rate) = self.rates();
        let (factor, least_s) = self
            .clock_error
            .map_or((1.0, UNSEEN_S), |error| (1.0 / (1.0 + error), 0.0));
        let period_s = |rate: Option<f64>| (factor / rate.unwrap_or(1.0)).max(least_s);
        self.accel.period_s = period_s(accel_rate);
        self.gyro.period_s = period_s(gyro_rate);
        self.accel.counts_per_unit = reg::accel_lsb_per_g(self.banks.get(0, reg::ACCEL_CONFIG0)) / GRAVITY_M_S2;
        self.gyro.counts_per_unit = reg::gyro_lsb_per_deg_s(self.banks.get(0, reg::GYRO_CONFIG0)).to_degrees();
        // The model uses the gyro's corner for both sensors, because the control loop feels the gyro's delay.
        if let Some(rate) = gyro_rate {
            let corner = reg::bandwidth_hz(self.banks.get(0, reg::GYRO_ACCEL_CONFIG0), rate);
            self.sensor.set_corner_hz(corner);
        }
        let power = self.banks.get(0, reg::PWR_MGMT0);
        self.power(power);
    }

    /// One tick of a data rate.
    // Both callers have it to themselves: shared, each simulated millisecond would pay for two calls.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    fn sample(&mut self, accel_due: bool, gyro_due: bool) {
        if accel_due {
            self.accel.tick(self.time_s);
        }
        if gyro_due {
            self.gyro.tick(self.time_s);
        }
        let Some(measured) = self.sensor.sample(self.time_s) else {
            return;
        };
        self.measured_s = self.time_s;
        let now = self.time_s + 1e-9;
        let new_accel = accel_due && now >= self.accel.valid_from_s;
        let new_gyro = gyro_due && now >= self.gyro.valid_from_s && !self.gyro_stalls(&measured);
        let mut words = if new_accel && new_gyro {
            Words::default()
        } else {
            self.pending.unwrap_or_else(|| self.banks.words())
        };
        let temperature_c = self.sensor.temperature_c(self.time_s);
        if temperature_c != self.temperature.0 {
            self.temperature = (
                temperature_c,
                quantise((temperature_c - 25.0) * reg::TEMPERATURE_LSB_PER_K),
            );
        }
        words[0] = self.temperature.1;
        if new_accel {
            for (word, value) in words[1..4].iter_mut().zip(&measured[..3]) {
                *word = quantise(value * self.accel.counts_per_unit);
            }
        }
        if new_gyro {
            for (word, value) in words[4..].iter_mut().zip(&measured[3..]) {
                *word = quantise(value * self.gyro.counts_per_unit);
            }
        }
        if self.transfer == Transfer::Deselected {
            self.publish(&words);
        } else {
            // A burst reads one sample and never parts of two samples.
            self.pending = Some(words);
        }
    }

    /// Whether the gyro's data registers keep their contents because the part is changing its range.
    fn gyro_stalls(&mut self, measured: &[f64; 6]) -> bool {
        let on = self.banks.get(0, reg::INTF_CONFIG1) & reg::ADAPTIVE_FULL_SCALE != reg::ADAPTIVE_FULL_SCALE_OFF;
        let [.., x, y, z] = measured;
        on && self.adaptive.stalls(self.time_s, &[*x, *y, *z], || self.sensor.bits())
    }

    fn publish(&mut self, words: &Words) {
        self.banks.set_words(words);
        let status = self.banks.get(0, reg::INT_STATUS);
        self.banks.set(0, reg::INT_STATUS, status | reg::INT_STATUS_DATA_READY);
    }
}

/// The nearest count, saturated; -32768 is reserved for "no data".
#[inline]
fn quantise(value: f64) -> i16 {
    // 1.5 * 2^52: adding this constant rounds a number to an integer in the lowest bits. A saturating conversion would
    // cost twice as much.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    const MOST: f64 = i16::MAX as f64;
    let above = if value > -MOST { value } else { -MOST };
    let within = if above < MOST { above } else { MOST };
    (within + WHOLE).to_bits() as i16
}
