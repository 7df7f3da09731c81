//! The analogue task: publishes the battery voltage and the motor currents once per tick, halfway between two
//! ticks.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::Instant;

use crate::checkins::Critical;
use crate::hardware::AnalogInputs;
use crate::ticks::between_ticks;
use crate::topics::Topics;

/// Reads the inputs halfway between the ticks and publishes the readings. A tick therefore finds the reading of half
/// a tick ago, whichever of the tasks runs first: by then the currents have settled to the voltages of the tick
/// before, as the electrical time constant is a quarter of a tick. After a failed reading the last good one stays
/// published and grows stale.
pub async fn run<M: RawMutex>(topics: &Topics<M>, mut inputs: impl AnalogInputs) -> ! {
    let mut ticker = between_ticks();
    loop {
        ticker.next().await;
        let at = Instant::now();
        if let Ok(reading) = inputs.read().await {
            topics.analog.publish(at, reading);
        }
        topics.checkins.check_in(Critical::Analog);
    }
}
