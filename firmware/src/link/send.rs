//! The link's sending task: the vehicle's state, and answers.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, Ticker};
use embedded_io_async::Write;

use crate::checkins::Critical;
use crate::protocol::frame::encode;
use crate::protocol::message::{BoardMessage, PROTOCOL_VERSION, Status};
use crate::topics::Topics;

/// How often the state is sent.
const PERIOD: Duration = Duration::from_millis(10);

/// Sends the state for ever.
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
        let Some(telemetry) = topics.telemetry.latest() else {
            continue;
        };
        let link = topics.link.latest().map(|l| l.value).unwrap_or_default();
        let cycles = topics.cycles.with_age(Instant::now()).0.unwrap_or_default();
        let bad = link.bad_frames.wrapping_add(link.overlong_frames);
        let status = Status::new(&telemetry.value, bad, [cycles.total, cycles.worst]);
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
    use model::supervise::arming::Mode;

    /// The longest state there can be fits a frame: every varint at its longest.
    #[test]
    fn the_longest_state_fits_a_frame() {
        let status = Status {
            tick: u32::MAX,
            time_us: u64::MAX,
            mode: Mode::Stopping,
            faults: u32::MAX,
            blockers: u32::MAX,
            limits: u32::MAX,
            phi_rad: 0.0,
            phi_rate_rad_s: 0.0,
            speed_m_s: 0.0,
            speed_reference_m_s: 0.0,
            slope_rad: 0.0,
            heading_rad: 0.0,
            yaw_rate_rad_s: 0.0,
            x_m: 0.0,
            y_m: 0.0,
            spar_rad: 0.0,
            ballast_rad: 0.0,
            voltage_v: [0.0; 3],
            current_a: [0.0; 3],
            battery_v: 0.0,
            late_ticks: u32::MAX,
            refused_arms: u32::MAX,
            bad_frames: u32::MAX,
            tick_cycles: [u32::MAX; 2],
        };
        let frame = encode(&BoardMessage::Status(status)).expect("fits");
        assert!(frame.len() > 100 && frame.len() < FRAME_MAX, "{}", frame.len());
    }
}
