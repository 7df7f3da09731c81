//! The driver of the ICM-42688-P, an inertial measurement unit.
//!
//! The driver is hand-written because the vehicle needs the newest sample in one burst. The maintained driver crates
//! read through the FIFO, which costs two more transactions per tick and delays a sample by up to one tick. Register
//! names and values are those of the data sheet (DS-000347), except for the adaptive full scale, which the data sheet
//! lists among the reserved bits (`RegisterSetting`s below).

use embassy_time::{Duration, Timer};
use embedded_hal_async::spi::{Operation, SpiDevice};
use model::board::ImuScales;
use model::sample::ImuRaw;

/// Registers of bank 0; `REG_BANK_SEL` is in every bank.
mod register {
    pub const DEVICE_CONFIG: u8 = 0x11;
    pub const TEMP_DATA1: u8 = 0x1D;
    pub const INTF_CONFIG0: u8 = 0x4C;
    pub const INTF_CONFIG1: u8 = 0x4D;
    pub const PWR_MGMT0: u8 = 0x4E;
    pub const GYRO_CONFIG0: u8 = 0x4F;
    pub const ACCEL_CONFIG0: u8 = 0x50;
    pub const GYRO_ACCEL_CONFIG0: u8 = 0x52;
    pub const WHO_AM_I: u8 = 0x75;
    pub const REG_BANK_SEL: u8 = 0x76;
}

/// Set in the address of a read.
const READ: u8 = 0x80;
/// Words of one burst: the temperature, then three axes each of the accelerometer and of the gyro.
const DATA_WORDS: usize = 7;

/// Value of [`register::WHO_AM_I`].
pub(super) const WHO_AM_I_VALUE: u8 = 0x47;
const SOFT_RESET: u8 = 0x01;
/// Wait after a soft reset. The data sheet requires at least 1 ms.
const RESET_TIME: Duration = Duration::from_millis(2);
/// Wait after a sensor has been configured. No register may be written for 200 us after the sensors are switched on.
const SETTING_TIME: Duration = Duration::from_micros(300);
/// The gyro's start-up time.
const GYRO_START_TIME: Duration = Duration::from_millis(45);

/// Bits of a register that the driver sets. The register's other bits are reserved or stay as the reset left
/// them.
#[derive(Debug, Clone, Copy)]
struct RegisterSetting {
    register: u8,
    /// The bits to set.
    mask: u8,
    /// Their value; no bit outside the mask.
    value: u8,
}

/// Selects bank 0. A reset of the firmware alone does not change the bank that an earlier run selected.
const BANK_0: RegisterSetting = RegisterSetting {
    register: register::REG_BANK_SEL,
    mask: 0x07,
    value: 0x00,
};
/// What the part needs before anything is measured.
const BEFORE: [RegisterSetting; 3] = [
    // SPI only (UI_SIFS_CFG 3: noise on the wires cannot switch the part to I2C), data high byte first
    // (SENSOR_DATA_ENDIAN).
    RegisterSetting {
        register: register::INTF_CONFIG0,
        mask: 0x13,
        value: 0x13,
    },
    // Adaptive full scale off (AFSR, bits 7:6, value 1). The data sheet calls the bits reserved; the drivers of
    // flight controllers (ArduPilot, Betaflight) clear the adaptive scale with them. With the adaptive full scale, which
    // is on after a reset, the gyro's data freeze for 1 to 2 ms whenever a rate crosses about 100 deg/s.
    RegisterSetting {
        register: register::INTF_CONFIG1,
        mask: 0xC0,
        value: 0x40,
    },
    // The filters of both sensors at an eighth of their data rate, 250 Hz (codes 3): as reset, a quarter.
    RegisterSetting {
        register: register::GYRO_ACCEL_CONFIG0,
        mask: 0xFF,
        value: 0x33,
    },
];
/// Settings of the sensors.
const SENSORS: [RegisterSetting; 3] = [
    // Full scale 1 (+-1000 deg/s), data rate 2 kHz; bit 4 is reserved.
    RegisterSetting {
        register: register::GYRO_CONFIG0,
        mask: 0xEF,
        value: 0x25,
    },
    // Full scale 1 (+-8 g), data rate 2 kHz; bit 4 is reserved.
    RegisterSetting {
        register: register::ACCEL_CONFIG0,
        mask: 0xEF,
        value: 0x25,
    },
    // Gyro and accelerometer in low-noise mode, the thermometer on; bits 7:6 are reserved.
    RegisterSetting {
        register: register::PWR_MGMT0,
        mask: 0x3F,
        value: 0x0F,
    },
];
/// Scales of the words at these ranges: 16 bits over +-1000 deg/s and over +-8 g.
pub const IMU_SCALES: ImuScales = ImuScales {
    // 32768 counts over 1000 deg/s. The data sheet's table rounds this to 32.8, which would turn a heading by 1 in 1000.
    gyro_lsb_per_deg_s: 32.768,
    accel_lsb_per_g: 4096.0,
};
/// Contents of a data register before there is data.
const NO_DATA: i16 = i16::MIN;

/// Why an IMU gives no data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImuError<E> {
    /// The bus failed.
    Bus(E),
    /// Another part or no part answers; the value of `WHO_AM_I`.
    WrongPart(u8),
    /// A configuration register does not contain the written value.
    NotConfigured {
        /// The register.
        register: u8,
        /// The register's value.
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

/// An ICM-42688-P on its SPI device, in frames of 16 bits: a register's address and its value make one
/// frame, and a burst takes half as many DMA transfers as it would in bytes.
#[derive(Debug)]
pub struct Icm42688p<S> {
    spi: S,
}

impl<S: SpiDevice<u16>> Icm42688p<S> {
    /// The part behind `spi`; nothing is sent to it yet.
    pub fn new(spi: S) -> Self {
        Self { spi }
    }

    /// Resets and configures the part, and reads every setting back.
    ///
    /// # Errors
    /// [`ImuError`]; the caller may try again.
    pub async fn start(&mut self) -> Result<(), ImuError<S::Error>> {
        // An earlier run may have selected another bank, in which the reset register's address has another meaning.
        self.write(BANK_0.register, BANK_0.value).await?;
        self.write(register::DEVICE_CONFIG, SOFT_RESET).await?;
        Timer::after(RESET_TIME).await;
        self.write(BANK_0.register, BANK_0.value).await?;
        let who = self.read(register::WHO_AM_I).await?;
        if who != WHO_AM_I_VALUE {
            return Err(ImuError::WrongPart(who));
        }
        for setting in BEFORE {
            self.set(setting).await?;
        }
        for setting in SENSORS {
            self.set(setting).await?;
            Timer::after(SETTING_TIME).await;
        }
        self.check(BANK_0).await?;
        for setting in BEFORE.into_iter().chain(SENSORS) {
            self.check(setting).await?;
        }
        Timer::after(GYRO_START_TIME).await;
        Ok(())
    }

    /// Reads temperature, accelerometer and gyro in one burst.
    ///
    /// # Errors
    /// [`ImuError::Bus`], or [`ImuError::NoData`] while the part has no data.
    pub async fn sample(&mut self) -> Result<ImuRaw, ImuError<S::Error>> {
        // The address takes the first byte, so each word straddles two frames; the last byte belongs to the
        // next register.
        let mut frames = [0; 1 + DATA_WORDS];
        frames[0] = address_frame(register::TEMP_DATA1 | READ);
        self.spi
            .transaction(&mut [Operation::TransferInPlace(&mut frames)])
            .await?;
        let word = |before: u16, after: u16| ((before << 8) | (after >> 8)).cast_signed();
        let [a, b, c, d, e, f, g, h] = frames;
        let temperature = word(a, b);
        let data = [word(b, c), word(c, d), word(d, e), word(e, f), word(f, g), word(g, h)];
        // A part that does not answer leaves the line high or low.
        let holds = |level: i16| data.iter().all(|word| *word == level);
        if holds(-1) || holds(0) || data.contains(&NO_DATA) {
            return Err(ImuError::NoData);
        }
        let [ax, ay, az, gx, gy, gz] = data;
        Ok(ImuRaw {
            accel: [ax, ay, az],
            gyro: [gx, gy, gz],
            temperature,
        })
    }

    /// Writes a setting and keeps the register's other bits.
    async fn set(&mut self, setting: RegisterSetting) -> Result<(), ImuError<S::Error>> {
        let before = self.read(setting.register).await?;
        self.write(setting.register, (before & !setting.mask) | setting.value)
            .await
    }

    /// Reads a setting back.
    async fn check(&mut self, setting: RegisterSetting) -> Result<(), ImuError<S::Error>> {
        let value = self.read(setting.register).await?;
        if value & setting.mask == setting.value {
            Ok(())
        } else {
            Err(ImuError::NotConfigured {
                register: setting.register,
                value,
            })
        }
    }

    async fn read(&mut self, register: u8) -> Result<u8, ImuError<S::Error>> {
        let mut frame = [address_frame(register | READ)];
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
