//! The sequence after a reset: inspect the flash, install or roll back, boot.

use core::panic::PanicInfo;

use cortex_m::Peripherals;
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, entry, exception};
use embassy_futures::block_on;
use embassy_stm32::pac::gpio::vals::{Moder, Odr};
use embassy_stm32::pac::{GPIOB, RCC};
use firmware::drive_board::IMAGE_START;
use firmware::drive_board::memory::{ARRIVED_SECTOR, IMAGE_SECTORS, KEPT_SECTOR, LOADER_SECTORS};
use firmware::update::loader::{Boot, Places, prepare};

use super::loader_flash::FlashPlace;
use super::slow_watchdog;

/// First sector of the arrived image.
const ARRIVED: usize = ARRIVED_SECTOR.expect("a board with a boot loader has a place for it");
/// The red lamp, PB14.
const LAMP: usize = 14;
/// Cycles of half a blink: a quarter of a second at the 64 MHz after a reset.
const BLINK_CYCLES: u32 = 16_000_000;

#[entry]
fn main() -> ! {
    // The watchdog keeps running in the image. An image that hangs before it takes over the
    // watchdog is reset, and rolled back if it is on trial.
    slow_watchdog::start();
    let core = Peripherals::take();
    let mut scb = core.map(|core| core.SCB);
    if let Some(scb) = &mut scb {
        scb.enable_icache();
    }
    let mut places = Places {
        running: FlashPlace::new(LOADER_SECTORS, IMAGE_SECTORS),
        arrived: FlashPlace::new(ARRIVED, IMAGE_SECTORS),
        kept: FlashPlace::new(KEPT_SECTOR, IMAGE_SECTORS),
    };
    let found = block_on(prepare(&mut places));
    if let Some(scb) = &mut scb {
        // Also empties the cache, because its contents from the image's place are older than the
        // image.
        scb.disable_icache();
    }
    match found {
        Boot::Image | Boot::Trial => boot(),
        Boot::Nothing => blink(),
    }
}

/// Hands the part over to the image, as a reset would.
fn boot() -> ! {
    // SAFETY: nothing of this program runs afterwards, because no interrupt was ever enabled.
    // `image_in` has checked the image: it was sealed for this board, its first vector is the end
    // of a stack in the part's RAM, and its second vector is an instruction of the image, so the
    // image is linked for this place. Its start-up code initialises its own RAM.
    unsafe {
        (*SCB::PTR).vtor.write(IMAGE_START);
        cortex_m::asm::dsb();
        cortex_m::asm::isb();
        cortex_m::asm::bootload(IMAGE_START as *const u32)
    }
}

/// Blinks for ever to show that there is no image to boot. Only a probe can help.
fn blink() -> ! {
    RCC.ahb4enr().modify(|w| w.set_gpioben(true));
    // Port B has no pin of a bridge. Only the lamp's pin leaves its reset state.
    GPIOB.moder().modify(|w| w.set_moder(LAMP, Moder::OUTPUT));
    let mut level = Odr::HIGH;
    loop {
        GPIOB.odr().modify(|w| w.set_odr(LAMP, level));
        level = if level == Odr::HIGH { Odr::LOW } else { Odr::HIGH };
        cortex_m::asm::delay(BLINK_CYCLES);
        slow_watchdog::feed();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    SCB::sys_reset();
}

#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    SCB::sys_reset();
}

#[exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    SCB::sys_reset();
}
