//! The parameter task: answers the host's requests, stores a changed set and puts it in force.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, with_deadline};
use embedded_storage_async::nor_flash::NorFlash;
use model::supervise::codes::Blocker;
use model::vehicle::Vehicle;

use super::stage::Stage;
use super::store::{BootOutcome, Booted, Disbelief, ParameterStore};
use crate::blocking::{Withheld, withhold};
use crate::events::Event;
use crate::protocol::message::{Answer, ParameterAnswer, ParameterRequest};
use crate::topics::{Answered, Asked, Topics};

/// Returns the vehicle to boot with, stored or built in, and logs its origin.
#[allow(clippy::match_same_arms)] // On the target the lint does not see the texts.
pub async fn boot<F: NorFlash>(store: &mut ParameterStore<F>, built_in: &Vehicle<f32>) -> Booted {
    let booted = store.load(built_in).await;
    match booted.outcome {
        BootOutcome::Stored => info!("parameters: stored set"),
        BootOutcome::NothingStored => info!("parameters: nothing stored, built-in set"),
        BootOutcome::Migrated { as_built_in, dropped } => warning!(
            "parameters: set of another firmware, read by name: {} new ones as built in, {} unknown ones dropped",
            as_built_in,
            dropped
        ),
        BootOutcome::NotBelieved(why) => {
            match why {
                Disbelief::Unreadable => warning!("parameters: the stored set cannot be read"),
                Disbelief::OutOfRange(number) => {
                    warning!("parameters: stored value {} is out of its range", number);
                }
                Disbelief::Inconsistent(number) => {
                    warning!("parameters: the stored set contradicts itself at value {}", number);
                }
            }
            warning!("parameters: built-in set, arming is blocked until a set is stored");
        }
    }
    booted
}

/// Age at which staged changes are dropped, because their host has gone and the next host must not store them.
const STAGE_TIMEOUT: Duration = Duration::from_secs(10);

/// Answers requests for ever. `booted` contains the set in force, `built_in` is the set of the build.
pub async fn run<M: RawMutex, F: NorFlash>(
    topics: &Topics<M>,
    mut store: ParameterStore<F>,
    booted: Booted,
    built_in: Vehicle<f32>,
) -> ! {
    let mut stage = Stage::new(&booted.vehicle);
    let mut changed_at = Instant::now();
    // A vehicle that has lost its own set must not drive with another set before a person has chosen that set.
    let mut lost = matches!(booted.outcome, BootOutcome::NotBelieved(_));
    topics.parameters_pending.publish(Instant::now(), lost);
    match booted.outcome {
        BootOutcome::Stored | BootOutcome::NothingStored => {}
        BootOutcome::Migrated { as_built_in, dropped } => topics.log.push(Event::SetMigrated { as_built_in, dropped }),
        BootOutcome::NotBelieved(_) => topics.log.push(Event::SetLost),
    }
    loop {
        let Asked { id, request } = if stage.has_changes() {
            let deadline = changed_at + STAGE_TIMEOUT;
            let Ok(asked) = with_deadline(deadline, topics.parameter_requests.receive()).await else {
                warning!("parameters: changes were not stored in time, dropped");
                stage.discard();
                continue;
            };
            asked
        } else {
            topics.parameter_requests.receive().await
        };
        let answer = match request {
            ParameterRequest::Read { number } => stage.read(number),
            ParameterRequest::ReadStaged { number } => stage.read_staged(number),
            ParameterRequest::Write { number, value } => {
                changed_at = Instant::now();
                stage.write(number, value)
            }
            ParameterRequest::BuiltIn => {
                changed_at = Instant::now();
                stage.stage(built_in.parameters());
                ParameterAnswer::BuiltInReady
            }
            ParameterRequest::Discard => {
                stage.discard();
                ParameterAnswer::Discarded
            }
            ParameterRequest::Store => match stage.take() {
                Err(number) => ParameterAnswer::Inconsistent { number },
                Ok(vehicle) => {
                    let answer = keep(topics, &mut store, &vehicle).await;
                    if answer == ParameterAnswer::Stored {
                        stage.put_in_force(&vehicle);
                        lost = false;
                    }
                    topics.parameters_pending.publish(Instant::now(), lost);
                    answer
                }
            },
        };
        let answer = Answer::Parameters(answer);
        topics.answers.send(Answered { id, answer }).await;
    }
}

/// Blocks arming, stores the set and puts it in force. The caller unblocks arming.
async fn keep<M: RawMutex, F: NorFlash>(
    topics: &Topics<M>,
    store: &mut ParameterStore<F>,
    vehicle: &Vehicle<f32>,
) -> ParameterAnswer {
    let raise = || topics.parameters_pending.publish(Instant::now(), true);
    if withhold(topics, Blocker::Parameters, raise).await == Withheld::No {
        return ParameterAnswer::Armed;
    }
    if store.store(vehicle).await.is_err() {
        topics.log.push(Event::FlashFailed);
        warning!("parameters: not stored, the flash failed");
        return ParameterAnswer::FlashFailed;
    }
    topics.new_vehicle.put(*vehicle);
    topics.log.push(Event::SetStored);
    info!("parameters: new set stored and in force");
    ParameterAnswer::Stored
}
