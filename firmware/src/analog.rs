//! The analogue task: publishes the battery voltage and the motor currents once per tick, halfway between two
//! ticks, and reports when the board's own supply is low.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, with_timeout};
use model::supervise::codes::Blocker;

use crate::checkins::Critical;
use crate::hardware::AnalogInputs;
use crate::ticks::between_ticks;
use crate::topics::Topics;

/// Longest time that a reading may take: four periods of the bridges' PWM, of which it waits for one at most.
const READING: Duration = Duration::from_micros(200);

/// Reads the inputs halfway between the ticks and publishes the readings. A tick therefore finds the reading of half
/// a tick ago, whichever of the tasks runs first: by then the currents have settled to the voltages of the tick
/// before, as the electrical time constant is a quarter of a tick. The stamp is the time at which the reading was asked for:
/// a board that waits for its PWM samples up to a period later, so that the reported age is at most that much too
/// large.
///
/// `supply_is_low` reads the board's own supply: the blocker PartSupply follows it.
///
/// After a failed reading, or one that did not come, the last good one stays published and grows stale: a current that is
/// older than the vehicle's `sensor_timeout_s` stops an armed vehicle and keeps a disarmed one from arming.
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
        topics.checkins.check_in(Critical::Analog);
    }
}
