//! The ICM-42688-P driver and its task.
//!
//! A small driver of our own: the kept driver crates read through the FIFO, which costs two more
//! transactions and up to a sample of delay a tick; the vehicle needs the newest sample in one burst.
//! Register names and values are the data sheet's (DS-000347), bank 0.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, Timer};
use embedded_hal_async::spi::{Operation, SpiDevice};
use model::board::ImuScales;
use model::sample::{ImuRaw, TICK_US};

use crate::ticks::aligned;
use crate::topics::{Topic, Topics};
use crate::watchdog::Critical;

/// Registers of bank 0.
mod register {
    pub const DEVICE_CONFIG: u8 = 0x11;
    pub const TEMP_DATA1: u8 = 0x1D;
    pub const PWR_MGMT0: u8 = 0x4E;
    pub const GYRO_CONFIG0: u8 = 0x4F;
    pub const ACCEL_CONFIG0: u8 = 0x50;
    pub const WHO_AM_I: u8 = 0x75;
    /// First bit of a read.
    pub const READ: u8 = 0x80;
    /// Words of three axes each of the accelerometer and the gyro, after that of the temperature.
    pub const DATA_WORDS: usize = 7;
}

const WHO_AM_I: u8 = 0x47;
const SOFT_RESET: u8 = 0x01;
/// Gyro and accelerometer in low-noise mode.
const LOW_NOISE: u8 = 0x0F;
/// Full scale 1 (+-1000 deg/s), data rate 1 kHz.
const GYRO_1000_DPS_1_KHZ: u8 = 0x26;
/// Full scale 1 (+-8 g), data rate 1 kHz.
const ACCEL_8_G_1_KHZ: u8 = 0x26;
/// What the words stand for at these ranges: 16 bits over +-1000 deg/s and over +-8 g.
pub const SCALES: ImuScales = ImuScales {
    gyro_lsb_per_deg_s: 32.8,
    accel_lsb_per_g: 4096.0,
};
/// What a data register holds before there is data.
const NO_DATA: i16 = i16::MIN;

/// Why an IMU gives no data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImuError<E> {
    /// The bus failed.
    Bus(E),
    /// Another part answers, or none.
    WrongPart(u8),
    /// A configuration register does not hold what was written.
    NotConfigured {
        /// The register.
        register: u8,
        /// What it holds.
        value: u8,
    },
    /// The data registers hold no data.
    NoData,
}

impl<E> From<E> for ImuError<E> {
    fn from(error: E) -> Self {
        Self::Bus(error)
    }
}

/// An ICM-42688-P on its SPI device, in frames of 16 bits: a register's address and its value are one,
/// and a burst asks for half the DMA transfers of bytes.
#[derive(Debug)]
pub struct Icm42688p<S> {
    spi: S,
}

impl<S: SpiDevice<u16>> Icm42688p<S> {
    /// The part behind `spi`; not touched yet.
    pub fn new(spi: S) -> Self {
        Self { spi }
    }

    /// Resets and configures the part, and reads the configuration back.
    ///
    /// # Errors
    /// [`ImuError`]; the part may be tried again.
    pub async fn start(&mut self) -> Result<(), ImuError<S::Error>> {
        self.write(register::DEVICE_CONFIG, SOFT_RESET).await?;
        Timer::after(Duration::from_millis(2)).await;
        let who = self.read(register::WHO_AM_I).await?;
        if who != WHO_AM_I {
            return Err(ImuError::WrongPart(who));
        }
        let settings = [
            (register::GYRO_CONFIG0, GYRO_1000_DPS_1_KHZ),
            (register::ACCEL_CONFIG0, ACCEL_8_G_1_KHZ),
            (register::PWR_MGMT0, LOW_NOISE),
        ];
        for (register, value) in settings {
            self.write(register, value).await?;
            // No register may be written for 200 us after the sensors are switched on.
            Timer::after(Duration::from_micros(300)).await;
        }
        for (register, wanted) in settings {
            let value = self.read(register).await?;
            if value != wanted {
                return Err(ImuError::NotConfigured { register, value });
            }
        }
        // The gyro's start-up time.
        Timer::after(Duration::from_millis(45)).await;
        Ok(())
    }

    /// Reads temperature, accelerometer and gyro in one burst.
    ///
    /// # Errors
    /// [`ImuError::Bus`], or [`ImuError::NoData`] while the part has none.
    pub async fn sample(&mut self) -> Result<ImuRaw, ImuError<S::Error>> {
        // The address takes the first byte, so each word straddles two frames; the last byte is the next
        // register's.
        let mut frames = [0; 1 + register::DATA_WORDS];
        frames[0] = address_frame(register::TEMP_DATA1 | register::READ);
        self.spi
            .transaction(&mut [Operation::TransferInPlace(&mut frames)])
            .await?;
        let mut words = [0_i16; register::DATA_WORDS];
        for (word, frames) in words.iter_mut().zip(frames.windows(2)) {
            if let [before, after] = *frames {
                *word = ((before << 8) | (after >> 8)).cast_signed();
            }
        }
        let [temperature, data @ ..] = words;
        // A part that does not answer leaves the line high or low.
        if data.iter().all(|word| *word == -1) || data.iter().all(|word| *word == 0) || data.contains(&NO_DATA) {
            return Err(ImuError::NoData);
        }
        let [ax, ay, az, gx, gy, gz] = data;
        Ok(ImuRaw {
            accel: [ax, ay, az],
            gyro: [gx, gy, gz],
            temperature,
        })
    }

    async fn read(&mut self, register: u8) -> Result<u8, ImuError<S::Error>> {
        let mut frame = [address_frame(register | register::READ)];
        self.spi
            .transaction(&mut [Operation::TransferInPlace(&mut frame)])
            .await?;
        let [answer] = frame;
        Ok(answer.to_be_bytes()[1])
    }

    async fn write(&mut self, register: u8, value: u8) -> Result<(), ImuError<S::Error>> {
        self.spi.write(&[address_frame(register) | u16::from(value)]).await?;
        Ok(())
    }
}

/// A frame that starts with an address.
fn address_frame(address: u8) -> u16 {
    u16::from(address) << 8
}

/// Which IMU a task serves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// On the arm.
    Arm,
    /// On the camera spar.
    Spar,
}

/// Failed samples in a row after which the part is started anew.
const RESTART_AFTER: u32 = 20;
/// Pause before a part that would not start is tried again.
const RETRY: Duration = Duration::from_millis(50);

/// Starts the IMU, reads it every tick and publishes the readings; starts it again when it fails.
pub async fn run<M: RawMutex>(topics: &Topics<M>, place: Place, spi: impl SpiDevice<u16>) -> ! {
    let mut imu = Icm42688p::new(spi);
    let name = match place {
        Place::Arm => "arm",
        Place::Spar => "spar",
    };
    let mut complained = false;
    loop {
        let started = imu.start().await;
        check_in(topics, place);
        match started {
            Ok(()) => {
                info!("imu {}: started", name);
                complained = false;
                serve(topics, place, &mut imu).await;
                warning!("imu {}: no samples, restarting it", name);
            }
            Err(error) => {
                // Once for each outage: a missing IMU must not fill the log.
                if !complained {
                    complain(name, &error);
                    complained = true;
                }
                Timer::after(RETRY).await;
            }
        }
    }
}

/// Reads and publishes until the part stops answering.
async fn serve<M: RawMutex, S: SpiDevice<u16>>(topics: &Topics<M>, place: Place, imu: &mut Icm42688p<S>) {
    let topic: &Topic<M, ImuRaw> = match place {
        Place::Arm => &topics.arm_imu,
        Place::Spar => &topics.spar_imu,
    };
    let mut ticker = aligned(Duration::from_micros(u64::from(TICK_US)));
    let mut failures = 0;
    while failures < RESTART_AFTER {
        ticker.next().await;
        let at = Instant::now();
        match imu.sample().await {
            Ok(raw) => {
                failures = 0;
                topic.publish(at, raw);
                if place == Place::Arm {
                    topics.arm_imu_ready.signal(());
                }
            }
            Err(_) => failures += 1,
        }
        check_in(topics, place);
    }
}

fn check_in<M: RawMutex>(topics: &Topics<M>, place: Place) {
    if place == Place::Arm {
        topics.checkins.check_in(Critical::ArmImu);
    }
}

// In a build for the target the texts are in the log's table, and arms look alike without them.
#[allow(clippy::match_same_arms)]
fn complain<E>(name: &str, error: &ImuError<E>) {
    match error {
        ImuError::Bus(_) => warning!("imu {}: the bus failed", name),
        ImuError::WrongPart(who) => warning!("imu {}: WHO_AM_I is {}, expected {}", name, *who, WHO_AM_I),
        ImuError::NotConfigured { register, value } => {
            warning!(
                "imu {}: register {} holds {} after configuration",
                name,
                *register,
                *value
            );
        }
        ImuError::NoData => warning!("imu {}: no data", name),
    }
}
