//! The ICM-42688-P as its SPI bus sees it: banks, registers, data.
//!
//! Addresses, reset values, codes and times are those of the part's data sheet (DS-000347). Honoured:
//! reset, power modes with their start-up times, full scales, data rates, the user filter's bandwidth,
//! data-ready status, invalid data (-32768) until a sensor has run up, burst reads with rising
//! addresses, banks, the adaptive full scale's stalls (`adaptive`). Kept but without effect: every other
//! register of bank 0 and the other banks. Faults are the sensor's ([`super::imu`]), not the registers'.
//! Absent: FIFO, APEX functions, I3C, external clock.

use model::vehicle::GRAVITY_M_S2;

use super::fault::SensorFault;
use super::imu::{ImuErrors, ImuSensor, Motion};
use super::noise::Noise;

mod adaptive;
pub mod registers;
#[cfg(test)]
mod tests;

use adaptive::AdaptiveRange;
use registers as reg;

/// Answer of a bus without a driver.
const FLOATING: u8 = 0xff;
/// A sample: temperature, accelerometer x, y, z, gyro x, y, z, as in the registers from TEMP_DATA1.
type Words = [i16; 7];
/// What the data registers hold while a sensor is off or running up.
const INVALID: i16 = i16::MIN;
/// Registers of one bank.
const BANK_SIZE: usize = 128;
const BANKS: usize = 5;

/// State of the serial transfer while the chip is selected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Transfer {
    Deselected,
    Address,
    Read(u8),
    Write(u8),
}

/// One of the two sensors: its power-up and its clock, in s of the plant.
#[derive(Debug, Clone, Copy, Default)]
struct Channel {
    on: bool,
    valid_from_s: f64,
    next_s: f64,
}

/// An ICM-42688-P.
#[derive(Debug, Clone)]
pub struct Icm42688p {
    banks: Box<[[u8; BANK_SIZE]; BANKS]>,
    sensor: ImuSensor,
    accel: Channel,
    gyro: Channel,
    time_s: f64,
    /// Time from which on the part answers again after a reset, in s.
    ready_from_s: f64,
    adaptive: AdaptiveRange,
    transfer: Transfer,
    /// A sample that came while a burst was being read.
    pending: Option<Words>,
}

impl Icm42688p {
    /// A part that has just been powered: its sensors are off.
    pub fn new(errors: ImuErrors, noise: Noise) -> Self {
        let mut chip = Self {
            banks: Box::new([[0; BANK_SIZE]; BANKS]),
            sensor: ImuSensor::new(errors, 250.0, noise),
            accel: Channel::default(),
            gyro: Channel::default(),
            time_s: 0.0,
            ready_from_s: 0.0,
            adaptive: AdaptiveRange::default(),
            transfer: Transfer::Deselected,
            pending: None,
        };
        chip.reset();
        chip
    }

    /// Fails the part or repairs it.
    pub fn set_fault(&mut self, fault: SensorFault) {
        self.sensor.set_fault(fault);
    }

    /// The fault in force.
    pub fn fault(&self) -> SensorFault {
        self.sensor.fault()
    }

    /// The sensor behind the registers.
    pub fn sensor(&self) -> &ImuSensor {
        &self.sensor
    }

    /// The sensor behind the registers, to mount, shake or heat it.
    pub fn sensor_mut(&mut self) -> &mut ImuSensor {
        &mut self.sensor
    }

    /// Warms or cools the part from now on.
    pub fn heat(&mut self, to_c: f64, over_s: f64) {
        self.sensor.heat(self.time_s, to_c, over_s);
    }

    /// Temperature, accelerometer and gyro as the data registers hold them; `None` while the part does not
    /// answer.
    pub fn data(&self) -> Option<[i16; 7]> {
        (!self.dead()).then(|| self.words())
    }

    /// Level of INT1 as the drive board uses it (data ready, cleared by reading INT_STATUS).
    pub fn data_ready(&self) -> bool {
        self.get(0, reg::INT_STATUS) & reg::INT_STATUS_DATA_READY != 0 && !self.dead()
    }

    /// Follows the motion for `h` seconds, measuring whenever a data rate's time has come.
    #[inline]
    pub fn advance(&mut self, h: f64, motion: &Motion) {
        self.time_s += h;
        self.sensor.advance(h, motion);
        // A nanosecond of slack: the steps' lengths are rounded.
        let due = self.time_s + 1e-9;
        let accel_due = self.accel.on && due >= self.accel.next_s;
        let gyro_due = self.gyro.on && due >= self.gyro.next_s;
        if accel_due || gyro_due {
            self.sample(accel_due, gyro_due);
        }
    }

    /// One chip-selected transfer: the first byte is the address (with the read bit), every further one
    /// is written, or replaced by what is read.
    pub fn transfer(&mut self, bytes: &mut [u8]) {
        self.select();
        for byte in bytes {
            *byte = self.exchange(*byte);
        }
        self.deselect();
    }

    /// Chip select goes low.
    pub fn select(&mut self) {
        self.transfer = Transfer::Address;
    }

    /// Chip select goes high.
    pub fn deselect(&mut self) {
        self.transfer = Transfer::Deselected;
        if let Some(words) = self.pending.take() {
            self.publish(&words);
        }
    }

    /// One byte each way while the chip is selected.
    pub fn exchange(&mut self, byte: u8) -> u8 {
        if self.dead() {
            return FLOATING;
        }
        match self.transfer {
            Transfer::Deselected => FLOATING,
            Transfer::Address => {
                let address = byte & !reg::READ;
                self.transfer = if byte & reg::READ != 0 {
                    Transfer::Read(address)
                } else {
                    Transfer::Write(address)
                };
                0
            }
            Transfer::Read(address) => {
                self.transfer = Transfer::Read(next_address(address));
                self.read(address)
            }
            Transfer::Write(address) => {
                self.transfer = Transfer::Write(next_address(address));
                self.write(address, byte);
                0
            }
        }
    }

    fn dead(&self) -> bool {
        self.sensor.fault().is_dead_at((self.time_s * 1e3) as u64)
    }

    fn get(&self, bank: usize, address: u8) -> u8 {
        self.banks
            .get(bank)
            .and_then(|registers| registers.get(usize::from(address)))
            .copied()
            .unwrap_or(0)
    }

    fn set(&mut self, bank: usize, address: u8, value: u8) {
        if let Some(register) = self
            .banks
            .get_mut(bank)
            .and_then(|registers| registers.get_mut(usize::from(address)))
        {
            *register = value;
        }
    }

    fn bank(&self) -> usize {
        usize::from(self.get(0, reg::REG_BANK_SEL) & 7)
    }

    fn read(&mut self, address: u8) -> u8 {
        if self.time_s < self.ready_from_s {
            return 0;
        }
        if address == reg::REG_BANK_SEL {
            return self.get(0, address);
        }
        let bank = self.bank();
        let value = self.get(bank, address);
        if bank == 0 && address == reg::INT_STATUS {
            // Reading clears.
            self.set(0, address, 0);
        }
        value
    }

    fn write(&mut self, address: u8, value: u8) {
        if self.time_s < self.ready_from_s {
            return;
        }
        let bank = self.bank();
        match (bank, address) {
            (_, reg::REG_BANK_SEL) => self.set(0, address, value & 7),
            (0, reg::DEVICE_CONFIG) if value & reg::DEVICE_CONFIG_RESET != 0 => {
                self.reset();
                self.ready_from_s = self.time_s + reg::RESET_S;
            }
            // Read only.
            (0, reg::WHO_AM_I | reg::INT_STATUS | reg::TEMP_DATA1..=reg::GYRO_DATA_Z0) => {}
            (0, _) => {
                self.set(0, address, value);
                match address {
                    reg::PWR_MGMT0 => self.power(value),
                    reg::GYRO_CONFIG0 | reg::ACCEL_CONFIG0 | reg::GYRO_ACCEL_CONFIG0 => self.configure(),
                    _ => {}
                }
            }
            (bank, _) => self.set(bank, address, value),
        }
    }

    /// Every register to its reset value, both sensors off.
    fn reset(&mut self) {
        *self.banks = [[0; BANK_SIZE]; BANKS];
        for &(address, value) in reg::RESET_VALUES {
            self.set(0, address, value);
        }
        self.accel = Channel::default();
        self.gyro = Channel::default();
        self.pending = None;
        self.publish_data(&[INVALID; 7]);
        self.configure();
    }

    /// PWR_MGMT0: switches the sensors.
    fn power(&mut self, value: u8) {
        let (now, rates) = (self.time_s, self.rates());
        let switch = |channel: &mut Channel, on: bool, start_up_s: f64, rate_hz: Option<f64>| {
            let on = on && rate_hz.is_some();
            if on && !channel.on {
                channel.valid_from_s = now + start_up_s;
                channel.next_s = now + 1.0 / rate_hz.unwrap_or(1.0);
            }
            channel.on = on;
        };
        // Only low-noise mode measures at the rates used here; the gyro's stand-by does not measure.
        let gyro_on = value >> 2 & 3 == reg::MODE_LOW_NOISE;
        let accel_on = value & 3 == reg::MODE_LOW_NOISE;
        switch(&mut self.gyro, gyro_on, reg::GYRO_START_S, rates.1);
        switch(&mut self.accel, accel_on, reg::ACCEL_START_S, rates.0);
        let mut words = self.words();
        if !self.accel.on {
            words[1..4].fill(INVALID);
        }
        if !self.gyro.on {
            words[4..].fill(INVALID);
        }
        self.publish_data(&words);
    }

    /// Rates of accelerometer and gyro in Hz, `None` for a reserved code.
    fn rates(&self) -> (Option<f64>, Option<f64>) {
        (
            reg::data_rate_hz(self.get(0, reg::ACCEL_CONFIG0)),
            reg::data_rate_hz(self.get(0, reg::GYRO_CONFIG0)),
        )
    }

    /// A new rate or bandwidth.
    fn configure(&mut self) {
        // One corner serves both sensors here: the gyro's, whose delay the control loop feels.
        if let (_, Some(rate)) = self.rates() {
            let corner = reg::bandwidth_hz(self.get(0, reg::GYRO_ACCEL_CONFIG0), rate);
            self.sensor.set_corner_hz(corner);
        }
        let power = self.get(0, reg::PWR_MGMT0);
        self.power(power);
    }

    /// One tick of a data rate.
    fn sample(&mut self, accel_due: bool, gyro_due: bool) {
        let (accel_rate, gyro_rate) = self.rates();
        let advance = |channel: &mut Channel, rate: Option<f64>, now: f64| {
            let period = 1.0 / rate.unwrap_or(1.0);
            channel.next_s += period;
            if channel.next_s < now {
                // A step may span several ticks; the part measures once.
                channel.next_s = now + period;
            }
        };
        if accel_due {
            advance(&mut self.accel, accel_rate, self.time_s);
        }
        if gyro_due {
            advance(&mut self.gyro, gyro_rate, self.time_s);
        }
        let Some(measured) = self.sensor.sample(self.time_s) else {
            return;
        };
        let mut words = self.pending.unwrap_or_else(|| self.words());
        words[0] = quantise((self.sensor.temperature_c(self.time_s) - 25.0) * reg::TEMPERATURE_LSB_PER_K);
        let now = self.time_s + 1e-9;
        if accel_due && now >= self.accel.valid_from_s {
            let scale = reg::accel_lsb_per_g(self.get(0, reg::ACCEL_CONFIG0)) / GRAVITY_M_S2;
            for (word, value) in words[1..4].iter_mut().zip(&measured[..3]) {
                *word = quantise(value * scale);
            }
        }
        if gyro_due && now >= self.gyro.valid_from_s && !self.gyro_stalls(&measured) {
            let scale = reg::gyro_lsb_per_deg_s(self.get(0, reg::GYRO_CONFIG0)).to_degrees();
            for (word, value) in words[4..].iter_mut().zip(&measured[3..]) {
                *word = quantise(value * scale);
            }
        }
        if self.transfer == Transfer::Deselected {
            self.publish(&words);
        } else {
            // A burst reads one sample, not parts of two.
            self.pending = Some(words);
        }
    }

    /// Whether the gyro's data registers keep what they hold because the part changes its range.
    fn gyro_stalls(&mut self, measured: &[f64; 6]) -> bool {
        let on = self.get(0, reg::INTF_CONFIG1) & reg::ADAPTIVE_FULL_SCALE != reg::ADAPTIVE_FULL_SCALE_OFF;
        let [.., x, y, z] = measured;
        on && self.adaptive.stalls(self.time_s, &[*x, *y, *z], || self.sensor.bits())
    }

    /// The data registers as they stand.
    fn words(&self) -> Words {
        let mut address = reg::TEMP_DATA1;
        core::array::from_fn(|_| {
            let word = i16::from_be_bytes([self.get(0, address), self.get(0, address + 1)]);
            address += 2;
            word
        })
    }

    fn publish_data(&mut self, words: &Words) {
        let bytes = words.iter().flat_map(|word| word.to_be_bytes());
        for (address, byte) in (reg::TEMP_DATA1..).zip(bytes) {
            self.set(0, address, byte);
        }
    }

    fn publish(&mut self, words: &Words) {
        self.publish_data(words);
        let status = self.get(0, reg::INT_STATUS);
        self.set(0, reg::INT_STATUS, status | reg::INT_STATUS_DATA_READY);
    }
}

/// Address after `address` in a burst; it stays within the bank.
fn next_address(address: u8) -> u8 {
    (address + 1) & !reg::READ
}

/// The nearest count, saturated; -32768 is kept for "no data".
fn quantise(value: f64) -> i16 {
    // Half a count away from zero, then cut: a call of the rounding function costs more than all else.
    (value + 0.5_f64.copysign(value)).clamp(-32767.0, 32767.0) as i16
}
