//! The clocks: the instants of the ticks of the firmware's tasks (TIM5), and corrections of the models.

use rigless::emulator::{Access, AccessKind};
use rigless::mcu::Operate;
use rigless::session::Session;
use rigless::soc::Width;
use rigless::time::VirtualNanos;

use crate::board::DriveBoard;
use crate::error::Error;
use crate::time::{MS, US};

/// Control register, and its bit that enables the counter.
const CONTROL: u64 = 0x4000_0C00;
const RUNS: u64 = 1;
/// Status register.
const TICK_STATUS: u64 = 0x4000_0C10;
/// Event generation register.
const EVENTS: u64 = 0x4000_0C14;
/// Counter, in us.
const COUNT: u64 = 0x4000_0C24;

/// Control register of the part's clocks, and its bit that switches the external clock on.
const CLOCK_CONTROL: u64 = 0x5802_4400;
const EXTERNAL_ON: u64 = 1 << 16;

/// The four compare flags of the status register.
const COMPARE_FLAGS: u64 = 0x1E;
/// Range of the counter's low 16 bits, which the firmware uses, in us.
const RANGE_US: u64 = 1 << 16;

/// Time in ns from a step of the plant to the firmware's tick. The tick senses the state just before it, and the plant
/// moves with the bridges as the previous tick left them.
const STEP_BEFORE_TICK: u64 = 20 * US;

/// Instant at which the firmware's clock started after the board's last start, in ns. `None` while the clock does not
/// run yet.
pub(super) fn started_at(session: &mut Session<DriveBoard>, at: VirtualNanos) -> Result<Option<u64>, Error> {
    let started = session.resets().last().map_or(0, |reset| reset.at.0);
    match session.mcu().read(at, CONTROL, Width::W32) {
        Ok(control) if control & RUNS != 0 => {}
        Err(fault) if !fault.is_shut_gate() => return Err(Error::access(&fault)),
        _ => return Ok(None),
    }
    let count_us = session
        .mcu()
        .read(at, COUNT, Width::W32)
        .map_err(|fault| Error::access(&fault))?;
    Ok(Some(clock_start(at.0, count_us % RANGE_US, started)))
}

/// Start of a clock that reads `count_us` at `now`, on a board that started at `started`. The clock is read within its
/// range after it began to run, however long the boot loader took before.
fn clock_start(now: u64, count_us: u64, started: u64) -> u64 {
    let elapsed_us = (now - started) / US;
    started + elapsed_us.saturating_sub(count_us) * US
}

/// The first instant after `now`, in ns, that lies just before a tick of a clock that started at `started`.
pub(super) fn just_before_tick(now: u64, started: u64) -> u64 {
    let before = started + MS - STEP_BEFORE_TICK;
    before + now.saturating_sub(before).div_ceil(MS) * MS
}

/// Keeps an absent external clock from becoming ready after `access`.
///
/// The model of the clocks reports an oscillator with nothing on its pins as ready, at no frequency. On the real part
/// such an oscillator never becomes ready.
pub(super) fn withhold_external(session: &mut Session<DriveBoard>, access: &Access) -> Result<(), Error> {
    if access.address != CLOCK_CONTROL || access.kind != AccessKind::Write || access.value & EXTERNAL_ON == 0 {
        return Ok(());
    }
    let withheld = access.value & !EXTERNAL_ON;
    let written = session
        .mcu()
        .write(access.virtual_time, CLOCK_CONTROL, Width::W32, withheld);
    written.map_err(|fault| Error::access(&fault))
}

/// Clears the compare flags that the clock's model sets wrongly after `access`.
///
/// The model sets the flags on a software update event while the compare registers are zero. The real part does not
/// set them. The firmware's clock would take such a flag for an elapsed half period.
pub(super) fn correct_flags(session: &mut Session<DriveBoard>, access: &Access) -> Result<(), Error> {
    if access.address != EVENTS || access.kind != AccessKind::Write {
        return Ok(());
    }
    let kept = u64::from(u32::MAX) & !COMPARE_FLAGS;
    let written = session.mcu().write(access.virtual_time, TICK_STATUS, Width::W32, kept);
    written.map_err(|fault| Error::access(&fault))
}
