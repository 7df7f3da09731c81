//! The parameter task: answers the host's requests, stores a changed set and puts it in force.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, Timer};
use embedded_storage_async::nor_flash::NorFlash;
use model::supervise::arming::Mode;
use model::supervise::codes::Blocker;
use model::vehicle::{NotSet, Vehicle};

use super::numbered::{number_of, schema};
use super::store::{NoSet, ParameterStore};
use crate::events::Event;
use crate::protocol::message::{Answer, ParameterAnswer, ParameterRequest};
use crate::topics::{Answered, Asked, Topics};

/// Returns the vehicle to boot with, stored or built in, and logs which of the two.
pub async fn boot<F: NorFlash>(store: &mut ParameterStore<F>, built_in: &Vehicle<f32>) -> Vehicle<f32> {
    match store.load(built_in.parameters()).await {
        Ok(vehicle) => {
            info!("parameters: stored set");
            vehicle
        }
        Err(NoSet::Absent) => {
            info!("parameters: nothing stored, built-in set");
            *built_in
        }
        Err(NoSet::Corrupt) => {
            warning!("parameters: stored set is corrupt or belongs to another firmware, built-in set");
            *built_in
        }
    }
}

/// Longest time that the control task may take to report that arming is blocked.
const BLOCK_TIMEOUT: Duration = Duration::from_millis(20);

/// Answers requests for ever. `vehicle` holds the set in force, `built_in` the set of the build.
pub async fn run<M: RawMutex, F: NorFlash>(
    topics: &Topics<M>,
    mut store: ParameterStore<F>,
    vehicle: Vehicle<f32>,
    built_in: Vehicle<f32>,
) -> ! {
    let mut staged = *vehicle.parameters();
    loop {
        let Asked { id, request } = topics.parameter_requests.receive().await;
        let answer = match request {
            ParameterRequest::Read { number } => match staged.value(number) {
                Some(value) => ParameterAnswer::Value {
                    number,
                    count: staged.count(),
                    value,
                    schema: schema(&staged),
                },
                None => ParameterAnswer::NoSuchNumber,
            },
            ParameterRequest::Write { number, value } => match staged.set(number, value) {
                Ok(()) => ParameterAnswer::Value {
                    number,
                    count: staged.count(),
                    value,
                    schema: schema(&staged),
                },
                Err(NotSet::NoSuchNumber) => ParameterAnswer::NoSuchNumber,
                Err(NotSet::OutOfRange(out)) => ParameterAnswer::OutOfRange {
                    min: out.field.min as f32,
                    max: out.field.max as f32,
                },
            },
            ParameterRequest::Defaults => {
                staged = *built_in.parameters();
                ParameterAnswer::DefaultsReady
            }
            ParameterRequest::Store => match Vehicle::new(staged) {
                Err(error) => ParameterAnswer::Inconsistent {
                    number: number_of(&staged, &error),
                },
                Ok(vehicle) => keep(topics, &mut store, &vehicle).await,
            },
        };
        let answer = Answer::Parameters(answer);
        topics.answers.send(Answered { id, answer }).await;
    }
}

/// Blocks arming, stores the set, puts the set in force, and unblocks arming.
async fn keep<M: RawMutex, F: NorFlash>(
    topics: &Topics<M>,
    store: &mut ParameterStore<F>,
    vehicle: &Vehicle<f32>,
) -> ParameterAnswer {
    let since = Instant::now();
    topics.parameters_pending.publish(since, true);
    let answer = if blocked(topics, since).await {
        if store.store(vehicle).await.is_ok() {
            topics.new_vehicle.signal(*vehicle);
            topics.log.push(Event::SetStored);
            info!("parameters: new set stored and in force");
            ParameterAnswer::Stored
        } else {
            topics.log.push(Event::FlashFailed);
            warning!("parameters: not stored, the flash failed");
            ParameterAnswer::FlashFailed
        }
    } else {
        ParameterAnswer::Armed
    };
    topics.parameters_pending.publish(Instant::now(), false);
    answer
}

/// Waits for the first tick after `since`. Returns whether the vehicle was disarmed in that tick with arming
/// blocked; `false` if no tick came in time.
async fn blocked<M: RawMutex>(topics: &Topics<M>, since: Instant) -> bool {
    while Instant::now().saturating_duration_since(since) < BLOCK_TIMEOUT {
        if let Some(status) = topics.status.latest()
            && status.at > since
        {
            let t = status.value;
            return t.mode == Mode::Disarmed && t.blockers.contains(Blocker::Parameters);
        }
        Timer::after(Duration::from_millis(1)).await;
    }
    false
}
