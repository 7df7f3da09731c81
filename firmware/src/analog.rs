//! The analogue task: publishes the battery voltage and the motor currents once per tick, halfway between two
//! ticks, and reports when the board's own supply is low.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, with_timeout};
use model::supervise::codes::Blocker;

use crate::checkins::CriticalTask;
use crate::hardware::AnalogInputs;
use crate::ticks::between_ticks;
use crate::topics::Topics;

/// Longest time that a reading may take: four periods of the bridges' PWM. The reading waits for at most one of them.
const READING: Duration = Duration::from_micros(200);

/// Reads the inputs halfway between the ticks and publishes the readings. A tick therefore finds the reading of half a
/// tick ago, whichever task runs first. At the time of the reading the currents have settled to the previous tick's
/// voltages, because the electrical time constant is a quarter of a tick. The stamp is the time of the request. A board
/// that waits for its PWM samples up to one period later, so the reported age is too large by at most one period.
///
/// `supply_is_low` reads the board's own supply: the blocker PartSupply follows it.
///
/// After a failed or missing reading the last good reading stays published and becomes stale: a current that is older
/// than the vehicle's `sensor_timeout_s` stops an armed vehicle and keeps a disarmed vehicle from arming.
pub async fn run<M: RawMutex>(
    topics: &Topics<M>,
    mut inputs: impl AnalogInputs,
    supply_is_low: impl Fn() -> bool,
) -> ! {
    let mut ticker = between_ticks();
    loop {
        ticker.next().await;
        let at = Instant::now();
        if let Ok(Ok(reading)) = with_timeout(READING, inputs.read()).await {
            topics.analog.publish(at, reading);
        }
        topics.blockers.set(Blocker::PartSupply, supply_is_low());
        topics.checkins.check_in(CriticalTask::Analog);
    }
}
