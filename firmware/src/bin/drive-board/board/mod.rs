//! The drive board: every pin, timer, DMA channel and interrupt of the NUCLEO-H743ZI2, in one place.
//!
//! | Function | Part | Pins | DMA | Interrupt |
//! |---|---|---|---|---|
//! | Left bridge, IN1 and IN2 | TIM1 CH1, CH2 | PE9, PE11 | | |
//! | Right bridge, IN1 and IN2 | TIM1 CH3, CH4 | PE13, PE14 | | |
//! | Ballast bridge, IN1 and IN2 | TIM8 CH3, CH4 | PC8, PC9 | | |
//! | Hardware break: stop's second contact, bridge fault | TIM1 BKIN, TIM8 BKIN2 | PE15 and PA8 on one wire, pull-ups, open = break | | |
//! | Emergency stop, first contact | GPIO | PG2, pull-up, open = pressed | | |
//! | Left encoder | TIM2 CH1, CH2 | PA15, PB3 | | |
//! | Right encoder | TIM3 CH1, CH2 | PC6, PC7 | | |
//! | Ballast encoder | TIM4 CH1, CH2 | PD12, PD13 | | |
//! | Arm IMU, ICM-42688-P | SPI1 | PA5 SCK, PA6 MISO, PB5 MOSI, PD14 CS | DMA2 stream 0 in, 1 out | DMA2_STREAM0, 1 |
//! | Spar IMU, ICM-42688-P | SPI4 | PE2 SCK, PE5 MISO, PE6 MOSI, PE4 CS | DMA2 stream 2 in, 3 out | DMA2_STREAM2, 3 |
//! | Battery voltage | ADC1 channel 15 | PA3 | DMA2 stream 4 | DMA2_STREAM4 |
//! | Motor currents left, right, ballast | ADC1 channels 10, 5, 18 | PC0, PB1, PA4 | as above | as above |
//! | Host link | USART3 | PD8 out, PD9 in | DMA1 stream 0 in, 1 out | USART3, DMA1_STREAM0, 1 |
//! | Parameters | flash bank 2, last two sectors | | | FLASH |
//! | Fault history | flash bank 2, the two sectors before | | | FLASH |
//! | Image that arrives over the link | flash bank 2, first two sectors | | | FLASH |
//! | Image that ran before | flash bank 2, the two sectors behind; the boot loader writes it | | | |
//! | Watchdog | IWDG1 | | | |
//! | Clock of the tasks, 1 MHz | TIM5 | | | TIM5 |
//! | Executor of the control task | | | | UART5, as a software interrupt |
//! | Lamps: armed (green), faulted (red) | GPIO | PB0, PB14 | | |
//! | User button: disarm | GPIO | PC13, high = pressed | | |
//!
//! Of two DMA streams of one controller the lower has priority. Input uses the lower stream, because the SPI's FIFO
//! would overrun otherwise. The buffers lie in the AXI SRAM, which DMA1 and DMA2 can access; the stack does not. The
//! power stage needs pull-downs at the inputs of its bridges: the pins float until this code runs.

mod analog;
pub mod clocks;
pub mod core_supply;
pub mod flash;
mod flash_banks;
pub mod part;
pub mod reset_cause;
#[path = "../../stm32/mod.rs"]
pub mod stm32;
#[path = "../../stm32_registers/mod.rs"]
pub mod stm32_registers;

use embassy_stm32::Peri;
use embassy_stm32::flash::Flash;
use embassy_stm32::gpio::{AfType, AnyPin, Flex, Input, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::spi::Spi;
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::qei::Qei;
use embassy_stm32::timer::simple_pwm::PwmPin;
use embassy_stm32::usart::Uart;
use embassy_stm32::{bind_interrupts, dma, flash as driver, pac, peripherals, usart};
use firmware::drive_board::ANALOG_CHANNELS;
use firmware::hardware::ClockSource;

pub use analog::{AnalogSequence, SAMPLES_AFTER_TRIGGER_NS};
pub use embassy_stm32::peripherals::IWDG1 as BoardWatchdog;
pub use flash::DriverFlash as PartFlash;
use stm32::{
    Board, BridgePins, CoreCycles, FlightRecorder, Lamps, MotorBridges, QuadratureCounters, StopContact, UserButton,
    WatchdogAtRest, boot_number, crash, encoders, imu, link, self_test, storage, supply,
};

bind_interrupts!(struct Interrupts {
    DMA1_STREAM0 => dma::InterruptHandler<peripherals::DMA1_CH0>;
    DMA1_STREAM1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    DMA2_STREAM0 => dma::InterruptHandler<peripherals::DMA2_CH0>;
    DMA2_STREAM1 => dma::InterruptHandler<peripherals::DMA2_CH1>;
    DMA2_STREAM2 => dma::InterruptHandler<peripherals::DMA2_CH2>;
    DMA2_STREAM3 => dma::InterruptHandler<peripherals::DMA2_CH3>;
    DMA2_STREAM4 => dma::InterruptHandler<peripherals::DMA2_CH4>;
    FLASH => driver::InterruptHandler;
    USART3 => usart::InterruptHandler<peripherals::USART3>;
});

/// TIM1's alternate function on its break pin.
const DRIVE_BREAK_FUNCTION: u8 = 1;
/// TIM8's alternate function on its break pin.
const BALLAST_BREAK_FUNCTION: u8 = 3;

/// Bus clock of the IMUs, a quarter of their largest clock, for a cable of some decimetres: half a period, 80 ns, must
/// cover the signal's way in both directions and the IMU's own delay. One tick's burst takes 20 us.
pub const IMU_CLOCK: Hertz = Hertz(6_250_000);

impl Board {
    /// Starts the board: first the bridges, which are open.
    ///
    /// # Panics
    /// Panics when called twice.
    pub fn take() -> Self {
        let reset_cause = reset_cause::take();
        let (config, clock) = clocks::config();
        let p = embassy_stm32::init(config);
        if clock == ClockSource::External {
            clocks::watch_external_clock();
        }
        let mut core = cortex_m::Peripherals::take().expect("the board is taken once");
        core.SCB.enable_icache();
        guard_outputs();

        let (bridges, break_works) = MotorBridges::new(p.TIM1, p.TIM8, || BridgePins {
            left: (
                PwmPin::new(p.PE9, OutputType::PushPull),
                PwmPin::new(p.PE11, OutputType::PushPull),
            ),
            right: (
                PwmPin::new(p.PE13, OutputType::PushPull),
                PwmPin::new(p.PE14, OutputType::PushPull),
            ),
            ballast: (
                PwmPin::new(p.PC8, OutputType::PushPull),
                PwmPin::new(p.PC9, OutputType::PushPull),
            ),
            break_inputs: [
                break_input(p.PE15.into(), DRIVE_BREAK_FUNCTION),
                break_input(p.PA8.into(), BALLAST_BREAK_FUNCTION),
            ],
        });
        let (blockers, image_checksum) = self_test::run(break_works);
        let last_words = crash::take(reset_cause);
        let boot_number = boot_number::take();

        let encoder_counters = QuadratureCounters::new(
            Qei::new(p.TIM2, p.PA15, p.PB3, encoders::config()),
            Qei::new(p.TIM3, p.PC6, p.PC7, encoders::config()),
            Qei::new(p.TIM4, p.PD12, p.PD13, encoders::config()),
        );
        let arm_imu = imu::device(
            Spi::new(
                p.SPI1,
                p.PA5,
                p.PB5,
                p.PA6,
                p.DMA2_CH1,
                p.DMA2_CH0,
                Interrupts,
                imu::config(),
            ),
            Output::new(p.PD14, Level::High, Speed::VeryHigh),
        );
        let spar_imu = imu::device(
            Spi::new(
                p.SPI4,
                p.PE2,
                p.PE6,
                p.PE5,
                p.DMA2_CH3,
                p.DMA2_CH2,
                Interrupts,
                imu::config(),
            ),
            Output::new(p.PE4, Level::High, Speed::VeryHigh),
        );
        let analog = AnalogSequence::new(p.ADC1, p.DMA2_CH4, Interrupts, ANALOG_CHANNELS);
        let uart = Uart::new(
            p.USART3,
            p.PD9,
            p.PD8,
            p.DMA1_CH1,
            p.DMA1_CH0,
            Interrupts,
            link::config(),
        )
        .expect("the part supports the link's settings");
        let (link_sender, link_receiver) = link::split(uart);
        let regions = storage::regions(PartFlash::new(Flash::new(p.FLASH, Interrupts)));

        Self {
            reset_cause,
            clock,
            boot_number,
            last_words,
            bridges,
            encoders: encoder_counters,
            arm_imu,
            spar_imu,
            analog,
            emergency_stop: StopContact(Input::new(p.PG2, Pull::Up)),
            cycles: CoreCycles::start(&mut core.DCB, &mut core.DWT),
            lamps: Lamps {
                armed: Output::new(p.PB0, Level::Low, Speed::Low),
                faulted: Output::new(p.PB14, Level::Low, Speed::Low),
            },
            flight_recorder: FlightRecorder::new(),
            user_button: UserButton::new(Input::new(p.PC13, Pull::None)),
            link_sender,
            link_receiver,
            regions,
            blockers,
            image_checksum,
            watchdog: WatchdogAtRest::new(p.IWDG1),
        }
    }
}

/// Connects a break's pin to its timer, pulled up.
fn break_input(pin: Peri<'static, AnyPin>, function: u8) -> Flex<'static> {
    let mut input = Flex::new(pin);
    input.set_as_af_unchecked(function, AfType::input(Pull::Up));
    input
}

/// Makes a locked-up core, uncorrectable errors of the memory and a supply below 2.85 V trip the hardware break: each
/// of them would leave the bridges driven without control. The clock security system needs no switch. A debugger that
/// halts the core stops TIM1 and TIM8, which switches their outputs off, and the watchdog.
fn guard_outputs() {
    /// SYSCFG's configuration register, which the HAL's register description leaves out, and its lock bits.
    const SYSCFG_CFGR: *mut u32 = 0x5800_0418 as *mut u32;
    const AXI_SRAM_LOCK: u32 = 1 << 15;
    const DTCM_LOCK: u32 = 1 << 13;
    const CORE_LOCKUP_LOCK: u32 = 1 << 6;
    const SUPPLY_LOCK: u32 = 1 << 2;
    supply::watch();
    pac::RCC.apb4enr().modify(|w| w.set_syscfgen(true));
    // SAFETY: this is a register of this part; start-up writes it once, and its bits can only be set.
    unsafe { SYSCFG_CFGR.write_volatile(CORE_LOCKUP_LOCK | DTCM_LOCK | AXI_SRAM_LOCK | SUPPLY_LOCK) };
    pac::DBGMCU.apb2fzr1().modify(|w| {
        w.set_tim1(true);
        w.set_tim8(true);
    });
    pac::DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(true));
}
