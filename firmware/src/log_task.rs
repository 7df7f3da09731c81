//! The log task: checks the vehicle's state 20 times per second, logs one summary per second and one line
//! per change (mode, fault, refused request to arm), and drives the lamps. The same events go as codes into
//! the log for the link. The control task logs nothing.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Ticker};
use model::supervise::arming::Mode;
use model::supervise::codes::{Blocker, Fault, FaultSet};

use crate::built_in::BUILD_HASH;
use crate::events::Event;
use crate::hardware::{ClockSource, Indicators, ResetCause};
use crate::topics::Topics;

/// Period at which the task checks the vehicle's state.
const LOG_PERIOD: Duration = Duration::from_millis(50);
/// Rounds per summary: one summary per second.
const SUMMARY_EVERY: u32 = 20;

/// Logs the firmware's version, the cause of the start, and the source of the clocks.
pub fn boot<M: RawMutex>(topics: &Topics<M>, version: &str, cause: ResetCause, clock: ClockSource) {
    info!(
        "biplanar drive board {}, build {:08x}, reset by {}",
        version,
        BUILD_HASH,
        cause.name()
    );
    topics.log.push(Event::Booted(cause));
    if clock == ClockSource::Internal {
        warning!("no external clock: the board runs from its own oscillator");
        topics.log.push(Event::InternalClock);
    }
}

/// Logs the vehicle's state and shows it on the lamps, for ever.
pub async fn run<M: RawMutex>(topics: &Topics<M>, mut indicators: impl Indicators) -> ! {
    let mut ticker = Ticker::every(LOG_PERIOD);
    let mut mode = Mode::Disarmed;
    let mut faults = FaultSet::EMPTY;
    let mut refused = 0;
    let mut ready = false;
    let mut round = 0_u32;
    loop {
        ticker.next().await;
        let Some(status) = topics.status.latest() else {
            continue;
        };
        let t = status.value;
        indicators.show(t.mode != Mode::Disarmed, !t.faults.is_empty());
        if !ready && !t.blockers.contains(Blocker::NotCalibrated) {
            ready = true;
            topics.log.push(Event::Calibrated);
            info!("self-check done: gyros calibrated after {} ms", t.time_us / 1000);
        }
        for fault in Fault::ALL {
            if t.faults.contains(*fault) && !faults.contains(*fault) {
                warning!("fault {}: {}", *fault as u8, fault.name());
                topics.log.push(Event::Fault(*fault as u8));
            }
        }
        faults = t.faults;
        if t.mode != mode {
            mode = t.mode;
            info!("{}", mode.name());
            topics.log.push(Event::Mode(mode));
        }
        if t.refused_arms != refused {
            refused = t.refused_arms;
            topics.log.push(Event::NotArmed(t.blockers));
            for blocker in t.blockers.iter() {
                warning!("not armed: {} blocks arming", blocker.name());
            }
        }
        if round.is_multiple_of(SUMMARY_EVERY) {
            let cycles = topics.cycles.latest().map(|c| c.value).unwrap_or_default();
            info!(
                "{}: {} mm/s, phi {} mrad, slope {} mrad, {} mV, late {}",
                t.mode.name(),
                (t.estimate.speed_m_s * 1000.0) as i32,
                (t.estimate.phi_rad * 1000.0) as i32,
                (t.estimate.slope_rad * 1000.0) as i32,
                (t.battery_v * 1000.0) as i32,
                t.late_ticks
            );
            if cycles.are_counted() {
                info!("tick {} cycles (worst {})", cycles.total, cycles.worst);
            }
        }
        round = round.wrapping_add(1);
    }
}
