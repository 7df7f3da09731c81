//! The drive board: the part, and what the firmware's wiring table connects to the part's pins.

use std::num::{NonZeroU32, NonZeroU64};

use model::analog::Analog;
use rigless::device::Level;
use rigless::machine::{Board, Crystal, Target, armv7m};
use rigless::mcu::{Mcu, Operate};
use rigless::soc::Error;
use rigless::soc::stm32h743::generated::pwr;
use rigless::soc::stm32h743::peripherals::spi::Select;
use rigless::soc::stm32h743::peripherals::tim::Channel;
use rigless::time::VirtualNanos;

use super::bridges::{self, BridgeWiring};
use super::imu::EmulatedImu;
use super::pins::{BridgeOutput, MOTORS, SensedAtPins, pin};
use super::wire::LinkLine;
use crate::part::{Part, PartSetup};

/// Instructions that the emulated core retires per second of virtual time, unless a run sets another rate. The
/// 400 MHz core at one instruction per four cycles is a cautious figure for code in flash with the cache on.
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
    /// GPIOC.
    pub const PORT_C: usize = 2;
    /// GPIOG.
    pub const PORT_G: usize = 6;
}

/// Chip selects of the arm IMU and the spar IMU.
const IMU_SELECTS: [(&str, u8); 2] = [("GPIOD", 14), ("GPIOE", 4)];
/// Converter channels of the analogue inputs.
const ANALOG_CHANNELS: Analog<u8> = Analog {
    battery_voltage: 15,
    left_current: 10,
    right_current: 5,
    ballast_current: 18,
};
/// The emergency stop's first contact, PG2.
const STOP_PIN: u8 = 2;
/// The board's button, PC13.
const BUTTON_PIN: u8 = 13;

/// Levels of A and B in the four phases of a quadrature encoder that turns forward: A leads B.
const PHASES: [(Level, Level); 4] = [
    (Level::Low, Level::Low),
    (Level::High, Level::Low),
    (Level::High, Level::High),
    (Level::Low, Level::High),
];

/// The emulated drive board.
#[derive(Debug)]
pub struct DriveBoard {
    mcu: Part,
    instructions_per_second: u64,
    /// Encoder positions, in counts, up to which the timers have received edges.
    fed_counts: [i64; MOTORS],
    /// IMUs that do not answer.
    silent_imus: [bool; 2],
    /// The lines between board and bridges.
    wiring: BridgeWiring,
}

rigless::store!(DriveBoard {
    values: [instructions_per_second, fed_counts, silent_imus, wiring],
    parts: [mcu],
    built: []
});

impl DriveBoard {
    /// The board at power-up: emergency stop released, vehicle at rest.
    ///
    /// # Errors
    /// When the emulated part lacks a peripheral of the wiring table.
    pub fn new(instructions_per_second: u64, part: PartSetup) -> Result<Self, Error> {
        let mut mcu = Part::new(part)?;
        let h7 = &mut mcu.h7;
        let external_hz = if part.external_clock {
            CRYSTAL_HZ
        } else {
            Crystal::NONE.0
        };
        h7.rcc.attach_crystals(external_hz, Crystal::NONE.0);
        h7.set_supply(SUPPLY_MV);
        h7.set_analog_supply(SUPPLY_MV);
        for (bus, (port, number)) in at::IMU_BUSES.into_iter().zip(IMU_SELECTS) {
            let select = Select {
                port,
                pin: pin(number),
                active: Level::Low,
            };
            h7.spi[bus].attach_selected(EmulatedImu::new(), select);
        }
        h7.usart[at::LINK].attach(LinkLine::default());
        mcu.converter.set_reference(SUPPLY_MV);
        let mut board = Self {
            mcu,
            instructions_per_second,
            fed_counts: [0; MOTORS],
            silent_imus: [false; 2],
            wiring: BridgeWiring::default(),
        };
        board.set_stop(VirtualNanos(0), false);
        Ok(board)
    }

    /// State of each bridge.
    pub fn bridges(&mut self, now: VirtualNanos) -> [BridgeOutput; MOTORS] {
        self.wiring.outputs(&mut self.mcu, now)
    }

    /// Whether the timers drive the bridges' pins. Until then pull-downs keep the pins low. For tests.
    pub fn bridge_pins_connected(&mut self) -> bool {
        bridges::all_connected(&mut self.mcu)
    }

    /// What the drivers wrote to INTF_CONFIG1 of the IMUs: arm, spar.
    pub fn intf_config1(&mut self) -> [u8; 2] {
        at::IMU_BUSES.map(|bus| {
            let imu = self.mcu.h7.spi[bus].chip_mut::<EmulatedImu>(0);
            imu.map_or(0, |imu| imu.intf_config1())
        })
    }

    /// Puts what the vehicle's sensors measure on the board's pins.
    pub fn sense(&mut self, now: VirtualNanos, sensed: &SensedAtPins) {
        for n in 0..MOTORS {
            self.turn_encoder(now, n, sensed.encoder_counts[n]);
        }
        if sensed.bridge_shut_down != self.wiring.driver_hot {
            self.rewire(now, |wiring| wiring.driver_hot = sensed.bridge_shut_down);
        }
        for (n, imu) in sensed.imus.iter().enumerate() {
            if imu.silent != self.silent_imus[n] {
                self.silent_imus[n] = imu.silent;
                // This cannot fail: each bus has had its chip since the board was built.
                let _ = self.mcu.h7.spi[at::IMU_BUSES[n]].silence(0, imu.silent);
            }
        }
        let h7 = &mut self.mcu.h7;
        for (bus, imu) in at::IMU_BUSES.into_iter().zip(&sensed.imus) {
            if let Some(EmulatedImu { chip, .. }) = h7.spi[bus].chip_mut(0) {
                let [x, y, z] = imu.rate_mdeg_s;
                chip.set_rate(x, y, z);
                let [x, y, z] = imu.specific_force_ug;
                chip.set_acceleration(x, y, z);
            }
        }
        let mut ripples = Analog::all(None);
        let [left, right, ballast] = std::array::from_fn(|motor| {
            let slope = sensed.current_slope_uv_per_us[motor];
            Some(bridges::ripple(motor, slope))
        });
        ripples.left_current = left;
        ripples.right_current = right;
        ripples.ballast_current = ballast;
        let inputs = sensed
            .analog_mv
            .with(&ripples, |millivolts, ripple| (millivolts, ripple));
        for (channel, (millivolts, ripple)) in ANALOG_CHANNELS.values().into_iter().zip(inputs.values()) {
            self.mcu.converter.set_input(channel, millivolts, ripple);
        }
    }

    /// Presses or releases the emergency stop, which moves both of its contacts.
    pub fn set_stop(&mut self, now: VirtualNanos, pressed: bool) {
        self.set_stop_contact(now, pressed);
        self.rewire(now, |wiring| wiring.stop_pressed = pressed);
    }

    /// Opens or closes the stop's first contact alone, which software reads.
    pub fn set_stop_contact(&mut self, now: VirtualNanos, open: bool) {
        // A closed contact grounds the pin. An open contact leaves the pin to its pull-up.
        let level = (!open).then_some(Level::Low);
        self.mcu.h7.drive_port(now, at::PORT_G, |port, registers, context| {
            port.drive(pin(STOP_PIN), level, registers, context);
        });
    }

    /// Presses or releases the board's button. Its line is high while the button is pressed. For tests.
    pub fn set_button(&mut self, now: VirtualNanos, pressed: bool) {
        let level = if pressed { Level::High } else { Level::Low };
        self.mcu.h7.drive_port(now, at::PORT_C, |port, registers, context| {
            port.drive(pin(BUTTON_PIN), Some(level), registers, context);
        });
    }

    /// Welds the stop's second contact shut: it no longer opens when the stop is pressed. For tests.
    pub fn weld_second_contact(&mut self) {
        self.wiring.second_contact_welded = true;
    }

    /// Stops the external clock.
    pub fn fail_external_clock(&mut self, now: VirtualNanos) {
        self.mcu.fail_external_clock(now);
    }

    /// Sets the part's own supply, in mV.
    pub fn set_supply(&mut self, now: VirtualNanos, millivolts: u32) {
        self.mcu.h7.set_supply(millivolts);
        let power = self.mcu.h7.bus().slot("PWR").expect("the part has a power controller");
        let registers = self.mcu.h7.bus_mut().slot_mut(power).registers_mut();
        if pwr::csr1::PVDO.is_set(registers.get(pwr::Register::Csr1)) {
            for nth in [0, 1] {
                self.mcu.with_bridge_timer(now, nth, |timer, registers, context| {
                    timer.supply_fell(registers, context);
                });
            }
        }
    }

    /// The part.
    pub fn part(&mut self) -> &mut Part {
        &mut self.mcu
    }

    /// Sets or clears the fault output of the bridge drivers, which shares the wire of the break inputs. For tests.
    pub fn set_driver_fault(&mut self, now: VirtualNanos, fault: bool) {
        self.rewire(now, |wiring| wiring.driver_fault = fault);
    }

    /// Shorts the break input of a bridge timer to ground: TIM1 for 0, TIM8 for 1. For tests.
    pub fn ground_break(&mut self, now: VirtualNanos, nth: usize) {
        self.rewire(now, |wiring| wiring.grounded[nth] = true);
    }

    /// Breaks a line to a bridge: IN1 for 0, IN2 for 1. From then on the bridge's pull-down keeps the input low.
    /// For tests.
    pub fn cut_line(&mut self, motor: usize, input: usize) {
        self.wiring.cut[motor][input] = true;
    }

    /// The host's end of the link.
    pub fn wire(&mut self) -> &mut LinkLine {
        self.mcu.h7.usart[at::LINK]
            .chip_mut::<LinkLine>()
            .expect("the wire was attached when the board was built")
    }

    /// Turns an encoder to a position, in counts, edge by edge.
    fn turn_encoder(&mut self, now: VirtualNanos, nth: usize, counts: i64) {
        let fed = &mut self.fed_counts[nth];
        if *fed == counts {
            return;
        }
        self.mcu.with_timer(now, nth, |timer, registers, context| {
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

    /// Changes the wiring and puts the break wire's new level on the break inputs.
    fn rewire(&mut self, now: VirtualNanos, change: impl FnOnce(&mut BridgeWiring)) {
        let before = self.wiring;
        change(&mut self.wiring);
        self.wiring.drive_breaks(&mut self.mcu, now, before);
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
        // The core as the part's reference manual and data sheet describe it.
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
        config.vector_table = Some(self.mcu.boot_address());
        let spec = self.mcu.with_memory_fault(config.spec());
        vec![Target::new("stm32h743", &mut self.mcu, spec)]
    }
}
