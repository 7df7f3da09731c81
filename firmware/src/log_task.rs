//! The log: one line per second, and a line at every change of mode or fault; looked at 20 times per second, never in
//! the fast loop.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Ticker};
use model::supervise::arming::Mode;
use model::supervise::codes::{Blocker, Fault, FaultSet};

use crate::hardware::{Indicators, ResetCause};
use crate::topics::Topics;

const PERIOD: Duration = Duration::from_millis(50);
/// Rounds per summary: one summary per second.
const SUMMARY_EVERY: u32 = 20;

fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Disarmed => "disarmed",
        Mode::Armed => "armed",
        Mode::Stopping => "stopping",
    }
}

/// Says how the board came up.
pub fn boot(version: &str, cause: ResetCause) {
    let cause = match cause {
        ResetCause::PowerOn => "power-on",
        ResetCause::BrownOut => "brown-out",
        ResetCause::Pin => "reset pin",
        ResetCause::Software => "software",
        ResetCause::Watchdog => "watchdog",
        ResetCause::Other => "unknown",
    };
    info!("biplanar drive board {}, reset by {}", version, cause);
}

/// Logs and shows the vehicle's state for ever.
pub async fn run<M: RawMutex>(topics: &Topics<M>, mut indicators: impl Indicators) -> ! {
    let mut ticker = Ticker::every(PERIOD);
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
            info!("self-check done: calibrated after {} ms", t.time_us / 1000);
        }
        for fault in Fault::ALL {
            if t.faults.contains(*fault) && !faults.contains(*fault) {
                warning!("fault {}: {}", *fault as u8, fault.name());
            }
        }
        faults = t.faults;
        if t.mode != mode {
            mode = t.mode;
            info!("{}", mode_name(mode));
        }
        if t.refused_arms != refused {
            refused = t.refused_arms;
            for blocker in t.blockers.iter() {
                warning!("not armed: blocked by {}", blocker.name());
            }
        }
        if round.is_multiple_of(SUMMARY_EVERY) {
            let cycles = topics.cycles.latest().map(|c| c.value).unwrap_or_default();
            info!(
                "{}: {} mm/s, phi {} mrad, slope {} mrad, {} mV, tick {} cycles (worst {}), late {}",
                mode_name(t.mode),
                (t.estimate.speed_m_s * 1000.0) as i32,
                (t.estimate.phi_rad * 1000.0) as i32,
                (t.estimate.slope_rad * 1000.0) as i32,
                (t.battery_v * 1000.0) as i32,
                cycles.total,
                cycles.worst,
                t.late_ticks
            );
        }
        round = round.wrapping_add(1);
    }
}
