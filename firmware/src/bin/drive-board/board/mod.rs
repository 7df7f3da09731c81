//! The drive board: every pin, timer, DMA channel and interrupt of the NUCLEO-H743ZI2, in one place.
//!
//! | Function | Part | Pins | DMA | Interrupt |
//! |---|---|---|---|---|
//! | Left bridge | TIM1 CH1, CH1N | PE9, PE8 | | |
//! | Right bridge | TIM1 CH2, CH2N | PE11, PE10 | | |
//! | Ballast bridge | TIM1 CH3, CH3N | PE13, PE12 | | |
//! | Hardware break: stop's second contact, bridge fault | TIM1 BKIN | PE15, pull-up, open = break | | |
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
//! | Watchdog | IWDG1 | | | |
//! | Clock of the tasks, 1 MHz | TIM5 | | | TIM5 |
//! | Executor of the control task | | | | UART5, as a software interrupt |
//! | Lamps: armed (green), faulted (red) | GPIO | PB0, PB14 | | |
//! | User button: disarm | GPIO | PC13, high = pressed | | |
//!
//! Of two DMA streams of one controller the lower wins: input has the lower one, or the SPI's FIFO would
//! overrun. The buffers lie in the AXI SRAM, which DMA1 and DMA2 reach; the stack does not. The power stage
//! needs pull-downs at the inputs of its bridges: the pins float until this code runs.

mod analog;
mod boot_number;
mod bridges;
mod clocks;
pub mod crash;
mod cycle_counter;
mod encoders;
mod flight_record;
mod image;
mod lamps;
pub mod link;
mod ram;
mod reset_cause;
mod self_test;
mod storage;
mod switches;
mod watchdog;

use embassy_executor::InterruptExecutor;
use embassy_stm32::flash::Flash;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::mode::Async;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::usart::Uart;
use embassy_stm32::{bind_interrupts, dma, flash, pac, peripherals, usart};
use embassy_time::Delay;
use embedded_hal_bus::spi::ExclusiveDevice;
use firmware::drive_board::analog::INPUTS;
use firmware::hardware::{ClockSource, ResetCause};
use model::supervise::codes::BlockerSet;

pub use analog::AnalogSequence;
pub use bridges::{BridgePins, Tim1Bridges};
pub use cycle_counter::CoreCycles;
pub use encoders::QuadratureCounters;
pub use flight_record::FlightRecorder;
pub use lamps::Lamps;
pub use storage::Region;
pub use switches::{StopContact, UserButton};
pub use watchdog::{RunningWatchdog, WatchdogAtRest};

bind_interrupts!(struct Interrupts {
    DMA1_STREAM0 => dma::InterruptHandler<peripherals::DMA1_CH0>;
    DMA1_STREAM1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    DMA2_STREAM0 => dma::InterruptHandler<peripherals::DMA2_CH0>;
    DMA2_STREAM1 => dma::InterruptHandler<peripherals::DMA2_CH1>;
    DMA2_STREAM2 => dma::InterruptHandler<peripherals::DMA2_CH2>;
    DMA2_STREAM3 => dma::InterruptHandler<peripherals::DMA2_CH3>;
    DMA2_STREAM4 => dma::InterruptHandler<peripherals::DMA2_CH4>;
    FLASH => flash::InterruptHandler;
    USART3 => usart::InterruptHandler<peripherals::USART3>;
});

/// An IMU on its own bus.
pub type ImuDevice = ExclusiveDevice<Spi<'static, Async, Master>, Output<'static>, Delay>;

/// Everything the application runs on.
pub struct Board {
    /// Why the part started.
    pub reset_cause: ResetCause,
    /// What the part's clocks run from.
    pub clock: ClockSource,
    /// A number that differs from boot to boot.
    pub boot_number: u32,
    /// The message of the last run, if a panic or a fault ended it.
    pub last_words: Option<crash::LastWords>,
    /// Motor bridges, open.
    pub bridges: Tim1Bridges,
    /// Motor encoders.
    pub encoders: QuadratureCounters,
    /// IMU on the arm.
    pub arm_imu: ImuDevice,
    /// IMU on the camera spar.
    pub spar_imu: ImuDevice,
    /// Battery and currents.
    pub analog: AnalogSequence,
    /// Emergency stop.
    pub emergency_stop: StopContact,
    /// Watchdog, not started: the task that feeds it starts with it.
    pub watchdog: WatchdogAtRest,
    /// Cycle counter, running.
    pub cycles: CoreCycles,
    /// Armed and faulted lamps.
    pub lamps: Lamps,
    /// Keeper of the last tick's record.
    pub flight_recorder: FlightRecorder,
    /// The board's button.
    pub user_button: UserButton,
    /// Host link, out.
    pub link_sender: link::LinkSender,
    /// Host link, in.
    pub link_receiver: link::LinkReceiver,
    /// Stored parameters.
    pub parameters: Region,
    /// Fault history.
    pub fault_history: Region,
    /// What the self-test found.
    pub blockers: BlockerSet,
}

impl Board {
    /// Starts the board: the bridges first, open.
    ///
    /// # Panics
    /// When called twice.
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

        let (bridges, break_works) = Tim1Bridges::new(
            p.TIM1,
            BridgePins {
                left: p.PE9,
                left_n: p.PE8,
                right: p.PE11,
                right_n: p.PE10,
                ballast: p.PE13,
                ballast_n: p.PE12,
                break_input: p.PE15,
            },
        );
        let blockers = self_test::run(break_works);
        let last_words = crash::take(reset_cause);
        let boot_number = boot_number::take();

        let encoders = QuadratureCounters::new(
            Qei::new(p.TIM2, p.PA15, p.PB3, encoder_config()),
            Qei::new(p.TIM3, p.PC6, p.PC7, encoder_config()),
            Qei::new(p.TIM4, p.PD12, p.PD13, encoder_config()),
        );
        let arm_imu = imu(
            Spi::new(
                p.SPI1,
                p.PA5,
                p.PB5,
                p.PA6,
                p.DMA2_CH1,
                p.DMA2_CH0,
                Interrupts,
                imu_config(),
            ),
            Output::new(p.PD14, Level::High, Speed::VeryHigh),
        );
        let spar_imu = imu(
            Spi::new(
                p.SPI4,
                p.PE2,
                p.PE6,
                p.PE5,
                p.DMA2_CH3,
                p.DMA2_CH2,
                Interrupts,
                imu_config(),
            ),
            Output::new(p.PE4, Level::High, Speed::VeryHigh),
        );
        let analog = AnalogSequence::new(p.ADC1, p.DMA2_CH4, Interrupts, INPUTS.channels());
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
        let (parameters, fault_history) = storage::regions(Flash::new(p.FLASH, Interrupts));

        Self {
            reset_cause,
            clock,
            boot_number,
            last_words,
            bridges,
            encoders,
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
            parameters,
            fault_history,
            blockers,
            watchdog: WatchdogAtRest::new(p.IWDG1),
        }
    }
}

/// The counters count both edges of both channels; pull-ups keep the inputs of an unplugged encoder still.
fn encoder_config() -> qei::Config {
    qei::Config {
        ch1_pull: Pull::Up,
        ch2_pull: Pull::Up,
        ..qei::Config::default()
    }
}

/// The clock idles high, and the IMU samples on its second edge. A pull-up keeps the input of an unplugged IMU still.
fn imu_config() -> spi::Config {
    let mut config = spi::Config::default();
    config.mode = spi::MODE_3;
    config.frequency = IMU_CLOCK;
    config.miso_pull = Pull::Up;
    config
}

/// Bus clock of the IMUs, a quarter of the largest that they allow, for a cable of some decimetres: the answer has half a
/// period, 80 ns, for the way there and back and for the IMU's own delay. One tick's burst takes 20 us.
const IMU_CLOCK: Hertz = Hertz(6_250_000);

fn imu(bus: Spi<'static, Async, Master>, select: Output<'static>) -> ImuDevice {
    match ExclusiveDevice::new(bus, select, Delay) {
        Ok(device) => device,
        Err(error) => match error {},
    }
}

/// Makes a locked-up core, uncorrectable errors of the memory and a supply below 2.85 V trip the hardware break: they
/// would leave the bridges driven with nothing in control. The clock security system needs no switch. A debugger that halts the core stops TIM1, which switches its
/// outputs off, and the watchdog.
fn guard_outputs() {
    /// SYSCFG's configuration register, which the HAL's register description leaves out, and its lock bits.
    const SYSCFG_CFGR: *mut u32 = 0x5800_0418 as *mut u32;
    const AXI_SRAM_LOCK: u32 = 1 << 15;
    const DTCM_LOCK: u32 = 1 << 13;
    const CORE_LOCKUP_LOCK: u32 = 1 << 6;
    const SUPPLY_LOCK: u32 = 1 << 2;
    storage::watch_supply();
    pac::RCC.apb4enr().modify(|w| w.set_syscfgen(true));
    // SAFETY: this is a register of this part; start-up writes it once, and its bits can only be set.
    unsafe { SYSCFG_CFGR.write_volatile(CORE_LOCKUP_LOCK | DTCM_LOCK | AXI_SRAM_LOCK | SUPPLY_LOCK) };
    pac::DBGMCU.apb2fzr1().modify(|w| w.set_tim1(true));
    pac::DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(true));
}

/// The executor of the control task; its tasks interrupt every other task.
pub static CONTROL_EXECUTOR: InterruptExecutor = InterruptExecutor::new();

/// Starts the executor of the control task, with a priority below the drivers' interrupts and above the thread.
pub fn start_control_executor() -> embassy_executor::SendSpawner {
    interrupt::UART5.set_priority(Priority::P6);
    CONTROL_EXECUTOR.start(interrupt::UART5)
}

#[interrupt]
unsafe fn UART5() {
    // SAFETY: the executor runs on this interrupt, and this is the interrupt's handler.
    unsafe { CONTROL_EXECUTOR.on_interrupt() }
}
