//! Tests the IMU driver against the part's register model, with a bus that loses or falsifies writes.

use std::cell::RefCell;
use std::convert::Infallible;
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use embassy_time::Instant;
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};
use firmware::imu::driver::{Icm42688p, ImuError};
use plant::icm42688p;
use plant::imu::{ImuErrors, Motion};
use plant::noise::Noise;
use virtual_board::board::time::VirtualTime;

const DEVICE_CONFIG: u8 = 0x11;
const INTF_CONFIG0: u8 = 0x4C;
const INTF_CONFIG1: u8 = 0x4D;
const PWR_MGMT0: u8 = 0x4E;
const GYRO_CONFIG0: u8 = 0x4F;
const ACCEL_CONFIG0: u8 = 0x50;
const GYRO_ACCEL_CONFIG0: u8 = 0x52;
const WHO_AM_I: u8 = 0x75;
const REG_BANK_SEL: u8 = 0x76;
const READ: u8 = 0x80;

/// Level and at rest.
const STILL: Motion = Motion {
    specific_force: [0.0, 0.0, 9.81],
    rate: [0.0; 3],
};

/// A part on its bus.
struct Bus {
    part: icm42688p::Icm42688pModel,
    /// Bits of a register that ignore writes.
    stuck: Option<(u8, u8)>,
    /// Every register written, in order, with its value.
    written: Vec<(u8, u8)>,
    now_us: u64,
}

impl Bus {
    /// Lets the part follow the clock.
    fn sync(&mut self) {
        let now_us = Instant::now().as_micros();
        let h = (now_us - self.now_us) as f64 * 1e-6;
        self.part.advance(h, &STILL);
        self.now_us = now_us;
    }

    fn read(&mut self, register: u8) -> u8 {
        let mut bytes = [register | READ, 0];
        self.part.transfer(&mut bytes);
        bytes[1]
    }

    fn write(&mut self, register: u8, value: u8) {
        self.part.transfer(&mut [register, value]);
    }

    /// One transfer of the driver's.
    fn transfer(&mut self, bytes: &mut [u8]) {
        self.sync();
        if let [register, value] = bytes
            && *register & READ == 0
        {
            self.written.push((*register, *value));
            if let Some((stuck, bits)) = self.stuck
                && stuck == *register
            {
                *value = (*value & !bits) | (self.read(stuck) & bits);
            }
        }
        self.part.transfer(bytes);
    }
}

/// The driver's end of the bus.
#[derive(Clone)]
struct Device(Rc<RefCell<Bus>>);

impl Device {
    fn new() -> Self {
        Self(Rc::new(RefCell::new(Bus {
            part: icm42688p::Icm42688pModel::new(ImuErrors::NONE, Noise::new(1, 0)),
            stuck: None,
            written: Vec::new(),
            now_us: 0,
        })))
    }
}

impl ErrorType for Device {
    type Error = Infallible;
}

impl SpiDevice<u16> for Device {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u16>]) -> Result<(), Infallible> {
        let mut bus = self.0.borrow_mut();
        for operation in operations {
            match operation {
                Operation::Write(frames) => {
                    let mut bytes: Vec<u8> = frames.iter().flat_map(|frame| frame.to_be_bytes()).collect();
                    bus.transfer(&mut bytes);
                }
                Operation::TransferInPlace(frames) => {
                    let mut bytes: Vec<u8> = frames.iter().flat_map(|frame| frame.to_be_bytes()).collect();
                    bus.transfer(&mut bytes);
                    for (frame, bytes) in frames.iter_mut().zip(bytes.chunks(2)) {
                        *frame = u16::from_be_bytes([bytes[0], bytes[1]]);
                    }
                }
                other => panic!("the driver does not use {other:?}"),
            }
        }
        Ok(())
    }
}

/// Runs a future in virtual time; returns its output and how long it took in us.
fn run<F: Future>(future: F) -> (F::Output, u64) {
    let time = VirtualTime::take().expect("one at a time");
    let mut future = pin!(future);
    loop {
        match future.as_mut().poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(output) => return (output, time.now_us()),
            Poll::Pending => {
                time.take_due();
                let next_us = time.next_us();
                assert_ne!(next_us, u64::MAX, "the driver waits for the clock only");
                time.advance_to(next_us);
                // Takes the alarm that is over out of the queue.
                time.take_due();
            }
        }
    }
}

fn start(device: &Device) -> Result<(), ImuError<Infallible>> {
    device.0.borrow_mut().now_us = 0;
    run(Icm42688p::new(device.clone()).start()).0
}

/// Every setting, with the bits that it sets and their value.
const SETTINGS: [(u8, u8, u8); 6] = [
    (INTF_CONFIG0, 0x13, 0x13),
    (INTF_CONFIG1, 0xC0, 0x40),
    (GYRO_ACCEL_CONFIG0, 0xFF, 0x33),
    (GYRO_CONFIG0, 0xEF, 0x25),
    (ACCEL_CONFIG0, 0xEF, 0x25),
    (PWR_MGMT0, 0x3F, 0x0F),
];

#[test]
fn bank_and_interface_come_first_and_other_bits_stay_as_reset() {
    let device = Device::new();
    assert_eq!(start(&device), Ok(()));
    let mut bus = device.0.borrow_mut();
    let registers: Vec<u8> = bus.written.iter().map(|(register, _)| *register).collect();
    assert_eq!(
        registers,
        [
            REG_BANK_SEL,
            DEVICE_CONFIG,
            REG_BANK_SEL,
            INTF_CONFIG0,
            INTF_CONFIG1,
            GYRO_ACCEL_CONFIG0,
            GYRO_CONFIG0,
            ACCEL_CONFIG0,
            PWR_MGMT0
        ]
    );
    // The reset values are 0x30 and 0x91; the clock selection (bit 0) must be kept.
    assert_eq!(bus.read(INTF_CONFIG0), 0x33);
    assert_eq!(bus.read(INTF_CONFIG1), 0x51, "the adaptive full scale is off");
    assert_eq!(bus.read(GYRO_CONFIG0), 0x25);
    assert_eq!(bus.read(ACCEL_CONFIG0), 0x25);
    let corner_hz = bus.part.sensor().filter().corner_hz();
    assert_eq!((corner_hz, bus.read(GYRO_ACCEL_CONFIG0)), (250.0, 0x33));
    assert_eq!(bus.read(PWR_MGMT0), 0x0F);
}

#[test]
fn a_part_left_in_any_bank_by_an_earlier_run_starts_with_bank_0_reset() {
    for bank in 0..5 {
        let device = Device::new();
        {
            let mut bus = device.0.borrow_mut();
            // Registers that a reset must bring back, and the bank.
            bus.write(INTF_CONFIG1, 0x82);
            bus.write(0x53, 0x77);
            bus.write(REG_BANK_SEL, bank);
        }
        assert_eq!(start(&device), Ok(()), "bank {bank}");
        let mut bus = device.0.borrow_mut();
        assert_eq!(bus.read(REG_BANK_SEL), 0, "bank {bank}");
        assert_eq!(bus.read(WHO_AM_I), 0x47, "bank {bank}");
        assert_eq!(bus.read(INTF_CONFIG1), 0x51, "bank {bank}");
        assert_eq!(bus.read(0x53), 0x0D, "bank {bank}: the filter's order is as reset");
    }
}

#[test]
fn a_setting_that_a_register_does_not_take_is_told_with_the_register() {
    for (register, mask, value) in SETTINGS {
        for bit in (0..8).map(|bit| 1 << bit) {
            let device = Device::new();
            device.0.borrow_mut().stuck = Some((register, bit));
            // The reset value of the bit may already be the wanted value.
            let reset = Device::new().0.borrow_mut().read(register);
            let expected = if mask & bit == 0 || (reset ^ value) & bit == 0 {
                Ok(())
            } else {
                Err(register)
            };
            let told = start(&device).map_err(|error| match error {
                ImuError::NotConfigured { register, value: held } => {
                    assert_eq!(held & bit, reset & bit, "register {register:#x}, bit {bit:#x}");
                    register
                }
                other => panic!("{other:?}"),
            });
            assert_eq!(told, expected, "register {register:#x}, bit {bit:#x}");
        }
    }
}

#[test]
fn a_part_that_stays_in_another_bank_is_not_believed() {
    let device = Device::new();
    {
        let mut bus = device.0.borrow_mut();
        bus.write(REG_BANK_SEL, 1);
        bus.stuck = Some((REG_BANK_SEL, 0x07));
    }
    assert_eq!(start(&device), Err(ImuError::WrongPart(0)));
}

/// For 1 ms after its reset the part answers nothing and loses all writes.
#[test]
fn the_driver_waits_for_the_reset_and_for_the_gyro() {
    let device = Device::new();
    let mut imu = Icm42688p::new(device.clone());
    let ((started, sampled), took_us) = run(async { (imu.start().await, imu.sample().await) });
    assert_eq!(started, Ok(()));
    let raw = sampled.expect("the gyro has data when the start is over");
    assert_eq!(raw.accel[2], 4096, "1 g at +-8 g");
    assert!((46_000..60_000).contains(&took_us), "{took_us} us");
}
