//! The task of one IMU: starts the part, publishes its readings, and restarts it when it fails.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, Timer};
use embedded_hal_async::spi::SpiDevice;
use model::sample::ImuRaw;

use super::driver::{Icm42688p, ImuError, WHO_AM_I_VALUE};
use crate::checkins::CriticalTask;
use crate::events::Event;
use crate::hardware::Place;
use crate::ticks::every_tick;
use crate::topics::{Topic, Topics};

/// Number of consecutive failed samples after which the task restarts the part.
const RESTART_AFTER: u32 = 20;
/// Pause before the task tries again to start a part that did not start.
const RETRY: Duration = Duration::from_millis(50);

/// Starts the IMU, reads it every tick and publishes the readings; restarts the IMU when it fails.
pub async fn run<M: RawMutex>(topics: &Topics<M>, place: Place, spi: impl SpiDevice<u16>) -> ! {
    let mut imu = Icm42688p::new(spi);
    let name = place.name();
    let mut complained = false;
    loop {
        let started = imu.start().await;
        check_in(topics, place);
        match started {
            Ok(()) => {
                info!("{} IMU: started", name);
                topics.log.push(Event::ImuStarted(place));
                complained = false;
                serve(topics, place, &mut imu).await;
                warning!("{} IMU: no samples, restarting", name);
                topics.log.push(Event::ImuLost(place));
            }
            Err(error) => {
                // One line per outage: a missing IMU must not fill the log.
                if !complained {
                    complain(name, &error);
                    topics.log.push(Event::ImuNotStarted(place));
                    complained = true;
                }
                Timer::after(RETRY).await;
            }
        }
    }
}

/// Reads and publishes until the part stops answering.
async fn serve<M: RawMutex, S: SpiDevice<u16>>(topics: &Topics<M>, place: Place, imu: &mut Icm42688p<S>) {
    let topic: &Topic<M, ImuRaw> = match place {
        Place::Arm => &topics.arm_imu,
        Place::Spar => &topics.spar_imu,
    };
    let mut ticker = every_tick();
    let mut failures = 0;
    while failures < RESTART_AFTER {
        ticker.next().await;
        let at = Instant::now();
        match imu.sample().await {
            Ok(raw) => {
                failures = 0;
                topic.publish(at, raw);
                topics.imu_ready.signal(());
            }
            Err(_) => failures += 1,
        }
        check_in(topics, place);
    }
}

fn check_in<M: RawMutex>(topics: &Topics<M>, place: Place) {
    if place == Place::Arm {
        topics.checkins.check_in(CriticalTask::ArmImu);
    }
}

/// Logs why an IMU did not start.
// In a build for the board the texts are in defmt's table, and without them the match arms look alike.
#[allow(clippy::match_same_arms)]
fn complain<E>(name: &str, error: &ImuError<E>) {
    match error {
        ImuError::Bus(_) => warning!("{} IMU: the SPI bus failed", name),
        ImuError::WrongPart(who) => warning!("{} IMU: WHO_AM_I is {}, expected {}", name, *who, WHO_AM_I_VALUE),
        ImuError::NotConfigured { register, value } => {
            warning!(
                "{} IMU: register {} holds {} after configuration",
                name,
                *register,
                *value
            );
        }
        ImuError::NoData => warning!("{} IMU: no data", name),
    }
}
