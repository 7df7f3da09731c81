//! The link's sending task: the status, and answers.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Ticker};
use embedded_io_async::Write;

use crate::checkins::Critical;
use crate::protocol::frame::encode;
use crate::protocol::message::{BoardMessage, BoardStatus, PROTOCOL_VERSION};
use crate::topics::Topics;

/// How often the status is sent.
const PERIOD: Duration = Duration::from_millis(10);

/// Sends the status for ever.
pub async fn run<M: RawMutex>(topics: &Topics<M>, mut uart: impl Write) -> ! {
    let mut ticker = Ticker::every(PERIOD);
    loop {
        ticker.next().await;
        topics.checkins.check_in(Critical::Link);
        if topics.identify.try_take().is_some() {
            send(
                &mut uart,
                &BoardMessage::Identity {
                    protocol: PROTOCOL_VERSION,
                },
            )
            .await;
        }
        while let Ok(answer) = topics.parameter_answers.try_receive() {
            send(&mut uart, &BoardMessage::Parameters(answer)).await;
        }
        let Some(vehicle) = topics.status.latest() else {
            continue;
        };
        let status = BoardStatus {
            vehicle: vehicle.value,
            link: topics.link.latest().map(|l| l.value).unwrap_or_default(),
            cycles: topics.cycles.latest().map(|c| c.value).unwrap_or_default(),
        };
        send(&mut uart, &BoardMessage::Status(status)).await;
    }
}

/// Sends one message; a failing UART loses it, and the next one is sent all the same.
async fn send(uart: &mut impl Write, message: &BoardMessage) {
    if let Ok(frame) = encode(message) {
        let _ = uart.write_all(&frame).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::frame::FRAME_MAX;
    use crate::protocol::message::{LinkCounters, TickCycles};
    use model::estimate::Estimate;
    use model::status::{Status, Terms};
    use model::supervise::arming::Mode;
    use model::supervise::codes::{BlockerSet, FaultSet, LimitSet};

    /// The longest status there can be fits a frame, with room to grow: every varint at its longest.
    #[test]
    fn the_longest_status_fits_a_frame() {
        let vehicle = Status {
            tick: u32::MAX,
            time_us: u64::MAX,
            mode: Mode::Stopping,
            faults: FaultSet::FULL,
            blockers: BlockerSet::FULL,
            limits: LimitSet::FULL,
            estimate: Estimate::default(),
            speed_reference_m_s: 0.0,
            yaw_rate_reference_rad_s: 0.0,
            terms: Terms::default(),
            voltage_v: [0.0; 3],
            current_a: [0.0; 3],
            battery_v: 0.0,
            late_ticks: u32::MAX,
            refused_arms: u32::MAX,
        };
        let link = LinkCounters {
            frames: u32::MAX,
            bad_frames: u32::MAX,
            overlong_frames: u32::MAX,
            uart_errors: u32::MAX,
            dropped_requests: u32::MAX,
        };
        let cycles = TickCycles {
            sense: u32::MAX,
            estimate: u32::MAX,
            decide: u32::MAX,
            actuate: u32::MAX,
            total: u32::MAX,
            worst: u32::MAX,
        };
        let frame = encode(&BoardMessage::Status(BoardStatus { vehicle, link, cycles })).expect("fits");
        assert!(frame.len() > 200 && frame.len() < FRAME_MAX - 100, "{}", frame.len());
    }
}
