//! The board: what hangs on the part's pins, as the firmware's wiring table has it.

use std::num::{NonZeroU32, NonZeroU64};

use rigless::device::Level;
use rigless::machine::{Board, Crystal, Target, armv7m};
use rigless::mcu::{Mcu, Operate};
use rigless::soc::Error;
use rigless::soc::stm32h743::Stm32h743;
use rigless::soc::stm32h743::peripherals::gpio::Pin;
use rigless::soc::stm32h743::peripherals::spi::Select;
use rigless::soc::stm32h743::peripherals::tim::Channel;
use rigless::soc::stm32h743::peripherals::{adc, gpio};
use rigless::time::VirtualNanos;

use crate::imu::Imu;
use crate::link::Wire;
use crate::part::Part;
use crate::plant::{BridgeState, MOTORS, Sensed};

/// Instructions the emulated core retires in a second of virtual time, unless a run asks otherwise: the
/// 400 MHz core at one instruction in four cycles, a cautious figure for code in flash with its cache on.
pub const INSTRUCTIONS_PER_SECOND: u64 = 100_000_000;

const CORE_HZ: u64 = 400_000_000;
const CRYSTAL_HZ: u64 = 8_000_000;
const SUPPLY_MV: u32 = 3300;

/// Indices into the part's arrays of peripherals.
mod at {
    /// SPI1, SPI4.
    pub const IMU_BUSES: [usize; 2] = [0, 3];
    /// USART3.
    pub const LINK: usize = 2;
    /// ADC1.
    pub const CONVERTER: usize = 0;
    /// GPIOG, GPIOB.
    pub const PORT_G: usize = 6;
    pub const PORT_B: usize = 1;
}

/// Chip selects of the arm IMU and the spar IMU.
const IMU_SELECTS: [(&str, u8); 2] = [("GPIOD", 14), ("GPIOE", 4)];
/// Converter channels of the battery and the motors' currents.
const ANALOG_CHANNELS: [u8; 1 + MOTORS] = [15, 10, 5, 18];
/// The emergency stop's first contact, PG2.
const STOP_PIN: u8 = 2;
/// Pins of the bridges on port E: forward, reverse.
const BRIDGE_PINS: [(u8, u8); MOTORS] = [(9, 8), (11, 10), (13, 12)];
/// TIM1's alternate function on them.
const BRIDGE_FUNCTION: u8 = 1;

/// One turn through the four phases of a quadrature encoder: forward is A before B.
const PHASES: [(Level, Level); 4] = [
    (Level::Low, Level::Low),
    (Level::High, Level::Low),
    (Level::High, Level::High),
    (Level::Low, Level::High),
];

/// The emulated drive board.
#[derive(Debug)]
pub struct DriveBoard {
    /// The part.
    pub mcu: Part,
    instructions_per_second: u64,
    /// Encoder positions fed so far.
    fed_counts: [i64; MOTORS],
    /// IMUs that do not answer.
    silent_imus: [bool; 2],
    /// Both contacts of the emergency stop open.
    stop_pressed: bool,
    /// Level on the break pin that the stop does not explain: a bridge driver's fault.
    driver_fault: bool,
}

rigless::store!(DriveBoard {
    values: [
        instructions_per_second,
        fed_counts,
        silent_imus,
        stop_pressed,
        driver_fault
    ],
    parts: [mcu],
    built: []
});

impl DriveBoard {
    /// The board, powered, its stop released, its vehicle at rest.
    ///
    /// # Errors
    /// When the emulated part does not carry a peripheral of the wiring table.
    pub fn new(instructions_per_second: u64) -> Result<Self, Error> {
        let mut mcu = Part::new()?;
        let h7 = &mut mcu.h7;
        h7.rcc.attach_crystals(CRYSTAL_HZ, Crystal::NONE.0);
        h7.set_supply(SUPPLY_MV);
        h7.set_analog_supply(SUPPLY_MV);
        for converter in &mut h7.adc {
            converter.set_reference(SUPPLY_MV);
        }
        for (bus, (port, number)) in at::IMU_BUSES.into_iter().zip(IMU_SELECTS) {
            let select = Select {
                port,
                pin: pin(number),
                active: Level::Low,
            };
            h7.spi[bus].attach_selected(Imu::new(), select);
        }
        h7.usart[at::LINK].attach(Wire::default());
        let mut board = Self {
            mcu,
            instructions_per_second,
            fed_counts: [0; MOTORS],
            silent_imus: [false; 2],
            stop_pressed: false,
            driver_fault: false,
        };
        board.set_stop(VirtualNanos(0), false);
        Ok(board)
    }

    /// What each bridge does to its motor.
    pub fn bridges(&mut self, now: VirtualNanos) -> [BridgeState; MOTORS] {
        self.mcu.with_bridge_timer(now, |timer, registers, context| {
            timer.touch(registers, context);
            let timer = &timer.model;
            std::array::from_fn(|n| {
                let channel = Channel::new(n as u8 + 1).expect("a timer has six channels");
                match (
                    timer.pulse(channel, registers),
                    timer.complementary_pulse(channel, registers),
                ) {
                    (Some(forward), Some(reverse)) => BridgeState::Switching {
                        forward_ns: forward.width.0,
                        reverse_ns: reverse.width.0,
                        period_ns: forward.period.0,
                    },
                    (None, None) => {
                        let low = |level: Option<Level>| level != Some(Level::High);
                        let forward = timer.output(channel, registers);
                        if low(forward) && low(timer.complementary_output(channel, registers)) {
                            BridgeState::Open
                        } else {
                            BridgeState::Held
                        }
                    }
                    _ => BridgeState::Held,
                }
            })
        })
    }

    /// Whether TIM1 drives the bridges' pins, as opposed to their being left to their pull-downs.
    pub fn bridge_pins_connected(&mut self) -> bool {
        let port = self.mcu.h7.bus().slot("GPIOE").expect("the part has port E");
        let registers = self.mcu.h7.bus_mut().slot_mut(port).registers_mut();
        BRIDGE_PINS
            .into_iter()
            .flat_map(|(forward, reverse)| [forward, reverse])
            .all(|number| gpio::Gpio::function(pin(number), registers) == Some(BRIDGE_FUNCTION))
    }

    /// Puts what the vehicle's sensors see on the board's pins.
    pub fn sense(&mut self, now: VirtualNanos, sensed: &Sensed) {
        for n in 0..MOTORS {
            self.turn_encoder(now, n, sensed.encoder_counts[n]);
        }
        for (n, imu) in sensed.imus.iter().enumerate() {
            if imu.silent != self.silent_imus[n] {
                self.silent_imus[n] = imu.silent;
                // There is a chip on either bus: they were attached when the board was built.
                let _ = self.mcu.h7.spi[at::IMU_BUSES[n]].silence(0, imu.silent);
            }
        }
        let h7 = &mut self.mcu.h7;
        for (bus, imu) in at::IMU_BUSES.into_iter().zip(&sensed.imus) {
            if let Some(Imu { chip }) = h7.spi[bus].chip_mut(0) {
                let [x, y, z] = imu.rate_mdeg_s;
                chip.set_rate(x, y, z);
                let [x, y, z] = imu.specific_force_ug;
                chip.set_acceleration(x, y, z);
            }
        }
        let levels = std::iter::once(sensed.battery_mv).chain(sensed.current_mv);
        for (channel, millivolts) in ANALOG_CHANNELS.into_iter().zip(levels) {
            let channel = adc::Channel::new(channel).expect("a converter has twenty channels");
            h7.adc[at::CONVERTER].set_input(channel, millivolts);
        }
    }

    /// Presses or releases the emergency stop: both its contacts.
    pub fn set_stop(&mut self, now: VirtualNanos, pressed: bool) {
        self.set_stop_contact(now, pressed);
        self.stop_pressed = pressed;
        self.drive_break(now);
    }

    /// Opens or closes the stop's first contact alone, which software reads.
    pub fn set_stop_contact(&mut self, now: VirtualNanos, open: bool) {
        // Closed is ground; open is left to the pin's own pull.
        let level = (!open).then_some(Level::Low);
        self.mcu.h7.drive_port(now, at::PORT_G, |port, registers, context| {
            port.drive(pin(STOP_PIN), level, registers, context);
        });
    }

    /// Raises or clears the fault output of the bridges' drivers, which shares the break's wire.
    pub fn set_driver_fault(&mut self, now: VirtualNanos, fault: bool) {
        self.driver_fault = fault;
        self.drive_break(now);
    }

    /// Whether the stop is pressed.
    pub fn stop_pressed(&self) -> bool {
        self.stop_pressed
    }

    /// Lamps: armed (green), faulted (red).
    pub fn lamps(&mut self) -> (bool, bool) {
        let h7 = &mut self.mcu.h7;
        let slot = h7.bus().slot("GPIOB").expect("the part has port B");
        let (bus, port) = (
            h7.bus_mut().slot_mut(slot).registers_mut().clone(),
            &h7.gpio[at::PORT_B],
        );
        let lit = |number| port.level(pin(number), &bus) == Level::High;
        (lit(0), lit(14))
    }

    /// The far end of the host link.
    pub fn wire(&mut self) -> &mut Wire {
        self.mcu.h7.usart[at::LINK]
            .chip_mut::<Wire>()
            .expect("the wire was attached when the board was built")
    }

    /// Turns an encoder to a position, edge by edge.
    fn turn_encoder(&mut self, now: VirtualNanos, nth: usize, counts: i64) {
        let fed = &mut self.fed_counts[nth];
        if *fed == counts {
            return;
        }
        self.mcu.with_encoder_timer(now, nth, |timer, registers, context| {
            while *fed != counts {
                let before = PHASES[fed.rem_euclid(4) as usize];
                *fed += (counts - *fed).signum();
                let after = PHASES[fed.rem_euclid(4) as usize];
                let (input, level) = if before.0 == after.0 {
                    (2, after.1)
                } else {
                    (1, after.0)
                };
                let input = Channel::new(input).expect("a timer has six channels");
                timer.model.drive_input(input, level, registers, context);
            }
        });
    }

    /// The break's wire: high when a contact opens or a driver pulls it up.
    fn drive_break(&mut self, now: VirtualNanos) {
        let level = if self.stop_pressed || self.driver_fault {
            Level::High
        } else {
            Level::Low
        };
        self.mcu.with_bridge_timer(now, |timer, registers, context| {
            timer.drive_break(level, registers, context);
        });
    }
}

fn pin(number: u8) -> Pin {
    Pin::new(number).expect("a port has sixteen pins")
}

/// The part of a board, for reading a peripheral of it by field.
impl AsMut<Stm32h743> for DriveBoard {
    fn as_mut(&mut self) -> &mut Stm32h743 {
        &mut self.mcu.h7
    }
}

impl Board for DriveBoard {
    fn name(&self) -> &'static str {
        "drive-board"
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec!["stm32h743"]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.mcu)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let core = armv7m::Core {
            variant: armv7m::Variant::M7,
            clock_hz: NonZeroU64::new(CORE_HZ).expect("a running clock"),
            interrupt_lines: NonZeroU32::new(u32::from(Operate::cpu(&self.mcu).interrupt_lines))
                .expect("the part has interrupts"),
            priority_bits: 4,
            refclk_divider: NonZeroU32::new(8).expect("not zero"),
            instructions_per_second: NonZeroU64::new(self.instructions_per_second).unwrap_or(NonZeroU64::MIN),
            boot: "flash",
        };
        // The part's own core, as its reference manual and its data sheet describe it.
        let mut config = armv7m::Config::new(core, &rigless::cpu::armv7m::windows(self.mcu.bus()));
        config.fpu = armv7m::Fpu::FpV5Dp;
        config.mpu_regions = armv7m::MpuRegions::Sixteen;
        config.cpuid = 0x411F_C271;
        config.caches = Some(armv7m::Caches {
            clidr: 0x0900_0003,
            ctr: 0x8303_C003,
            ccsidr: &[0xF00F_E019, 0xF01F_E009],
        });
        config.branch_prediction = armv7m::BranchPrediction::Always;
        config.vector_table = Some(0x0800_0000);
        vec![Target::new("stm32h743", &mut self.mcu, config.spec())]
    }
}
