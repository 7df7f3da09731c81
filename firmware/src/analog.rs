//! The analogue task: publishes the battery voltage and the motor currents once per tick.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::Instant;

use crate::checkins::Critical;
use crate::hardware::AnalogInputs;
use crate::ticks::every_tick;
use crate::topics::Topics;

/// Reads the inputs every tick and publishes the readings. After a failed reading the last good one stays
/// published and grows stale.
pub async fn run<M: RawMutex>(topics: &Topics<M>, mut inputs: impl AnalogInputs) -> ! {
    let mut ticker = every_tick();
    loop {
        ticker.next().await;
        let at = Instant::now();
        if let Ok(reading) = inputs.read().await {
            topics.analog.publish(at, reading);
        }
        topics.checkins.check_in(Critical::Analog);
    }
}
