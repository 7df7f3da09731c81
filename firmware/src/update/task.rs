//! The update task: answers the host's requests while the vehicle is disarmed, and confirms a new firmware.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, Timer, with_timeout};
use embedded_storage_async::nor_flash::NorFlash;
use model::supervise::arming::Mode;
use model::supervise::codes::Blocker;

use super::store::UpdateStore;
use crate::blocking::{Withheld, withhold};
use crate::hardware::Restart;
use crate::image::Image;
use crate::protocol::message::{Answer, UPDATE_BYTES, UpdateAnswer, UpdateRefusal, UpdateRequest, UpdateState};
use crate::topics::{Answered, Topics, UpdateAsked};

/// Time that a new firmware must run before it confirms itself. By then its tasks have fed the watchdog some hundred
/// times, and the control task has calibrated the gyros.
pub const CONFIRM_AFTER: Duration = Duration::from_secs(3);
/// Time after a host's last message at which the update is given up, so that the vehicle can be armed again.
const LEFT_AFTER: Duration = Duration::from_secs(10);
/// Time for the last answer to leave the board before the restart.
const ANSWER_TIME: Duration = Duration::from_millis(100);
/// Period at which the task checks whether the vehicle is disarmed, while it has something to store.
const UPDATE_PERIOD: Duration = Duration::from_millis(100);

/// Answers for ever. `restart` restarts the part into its boot loader; a board without a boot loader only stores the
/// image. `self_test_passed` is the result of the board's self-test at boot.
pub async fn run<M: RawMutex, F: NorFlash, R: Restart>(
    topics: &Topics<M>,
    store: Option<UpdateStore<F>>,
    mut restart: Option<R>,
    self_test_passed: bool,
) -> ! {
    topics.blockers.set(Blocker::Update, false);
    let Some(mut store) = store else {
        loop {
            let UpdateAsked { id, .. } = topics.update_requests.receive().await;
            let answer = Answer::Update(UpdateAnswer::Refused(UpdateRefusal::NoRoom));
            topics.answers.send(Answered { id, answer }).await;
        }
    };
    let mut on_trial = store.state().await.0 == UpdateState::OnTrial;
    if on_trial {
        info!("update: this firmware is on trial");
    }
    let mut pending = false;
    loop {
        let patience = match (on_trial, pending) {
            (true, _) => UPDATE_PERIOD,
            (false, true) => LEFT_AFTER,
            (false, false) => Duration::MAX,
        };
        let asked = if patience == Duration::MAX {
            Some(topics.update_requests.receive().await)
        } else {
            with_timeout(patience, topics.update_requests.receive()).await.ok()
        };
        if on_trial && Instant::now() >= Instant::MIN + CONFIRM_AFTER {
            on_trial = confirm(topics, &mut store, restart.as_mut(), self_test_passed).await;
        }
        let Some(UpdateAsked { id, request }) = asked else {
            if pending && !on_trial {
                warning!("update: its host has left");
                pending = false;
                topics.blockers.set(Blocker::Update, false);
            }
            continue;
        };
        let answer = match request {
            UpdateRequest::State => {
                let (state, checksum) = store.state().await;
                UpdateAnswer::State { state, checksum }
            }
            _ if on_trial => UpdateAnswer::Refused(UpdateRefusal::OnTrial),
            _ if !self_test_passed => UpdateAnswer::Refused(UpdateRefusal::SelfTest),
            UpdateRequest::Begin(image) => match begin(topics, &mut store, image).await {
                Ok(next) => UpdateAnswer::Ready { next },
                Err(refusal) => UpdateAnswer::Refused(refusal),
            },
            UpdateRequest::Write { at, bytes } => match write(topics, &mut store, at, bytes.as_flattened()).await {
                Ok(next) => UpdateAnswer::Ready { next },
                Err(refusal) => UpdateAnswer::Refused(refusal),
            },
            UpdateRequest::Install => match install(topics, &mut store, restart.is_some()).await {
                Ok(()) if restart.is_some() => UpdateAnswer::Restarting,
                Ok(()) => UpdateAnswer::OnlyStored,
                Err(refusal) => UpdateAnswer::Refused(refusal),
            },
        };
        if request != UpdateRequest::State {
            pending = matches!(answer, UpdateAnswer::Ready { .. } | UpdateAnswer::Restarting);
            topics.blockers.set(Blocker::Update, pending);
        }
        let answered = Answered {
            id,
            answer: Answer::Update(answer),
        };
        topics.answers.send(answered).await;
        if answer == UpdateAnswer::Restarting
            && let Some(restart) = &mut restart
        {
            info!("update: restarting into the boot loader");
            // Arming stays blocked until then.
            Timer::after(ANSWER_TIME).await;
            restart.restart();
        }
    }
}

/// Confirms a firmware on trial, or ends its trial. Returns whether the firmware is still on trial. Does nothing while
/// the vehicle is armed, and keeps it from arming meanwhile.
async fn confirm<M: RawMutex, F: NorFlash, R: Restart>(
    topics: &Topics<M>,
    store: &mut UpdateStore<F>,
    restart: Option<&mut R>,
    self_test_passed: bool,
) -> bool {
    let disarmed = topics
        .status
        .latest()
        .is_some_and(|status| status.value.mode == Mode::Disarmed);
    if !disarmed {
        return true;
    }
    let withheld = withhold(topics, Blocker::Update, || topics.blockers.set(Blocker::Update, true)).await;
    if withheld == Withheld::No {
        topics.blockers.set(Blocker::Update, false);
        return true;
    }
    if self_test_passed {
        let confirmed = store.confirm().await.is_ok();
        topics.blockers.set(Blocker::Update, false);
        if confirmed {
            info!("update: this firmware has come up and is confirmed");
        } else {
            warning!("update: the flash failed, this firmware is not confirmed");
        }
        return !confirmed;
    }
    warning!("update: the self-test failed, this firmware is rolled back");
    if let Some(restart) = restart {
        restart.restart();
    }
    true
}

/// Keeps the vehicle from arming, and returns whether an update may write.
async fn may_write<M: RawMutex>(topics: &Topics<M>) -> Result<(), UpdateRefusal> {
    if withhold(topics, Blocker::Update, || topics.blockers.set(Blocker::Update, true)).await == Withheld::No {
        return Err(UpdateRefusal::NotDisarmed);
    }
    let low = topics.status.latest().is_none_or(|status| {
        let blockers = status.value.blockers;
        blockers.contains(Blocker::Battery) || blockers.contains(Blocker::PartSupply)
    });
    if low { Err(UpdateRefusal::LowSupply) } else { Ok(()) }
}

async fn begin<M: RawMutex, F: NorFlash>(
    topics: &Topics<M>,
    store: &mut UpdateStore<F>,
    image: Image,
) -> Result<u32, UpdateRefusal> {
    store.fits(&image)?;
    may_write(topics).await?;
    info!("update: room for an image of {} bytes", image.length);
    store.begin(image).await
}

async fn write<M: RawMutex, F: NorFlash>(
    topics: &Topics<M>,
    store: &mut UpdateStore<F>,
    at: u32,
    piece: &[u8],
) -> Result<u32, UpdateRefusal> {
    may_write(topics).await?;
    let piece: &[u8; UPDATE_BYTES] = piece.try_into().map_err(|_| UpdateRefusal::NotBegun)?;
    store.write(at, piece).await
}

async fn install<M: RawMutex, F: NorFlash>(
    topics: &Topics<M>,
    store: &mut UpdateStore<F>,
    with_loader: bool,
) -> Result<(), UpdateRefusal> {
    may_write(topics).await?;
    let image = store.check().await?;
    if with_loader {
        store.order(&image).await?;
    }
    Ok(())
}
