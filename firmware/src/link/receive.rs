//! The link's receiving task: bytes to commands.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::Instant;
use embedded_io_async::Read;

use crate::protocol::frame::{Decoder, Received};
use crate::protocol::message::{HostMessage, LinkCounters};
use crate::topics::{DriveCommand, Topics};

/// Reads frames for ever and publishes what they command.
pub async fn run<M: RawMutex>(topics: &Topics<M>, mut uart: impl Read) -> ! {
    let mut decoder = Decoder::new();
    let mut counters = LinkCounters::default();
    let mut bytes = [0; 64];
    loop {
        if let Ok(length) = uart.read(&mut bytes).await {
            for byte in bytes.iter().take(length) {
                take(topics, &mut counters, decoder.push(*byte));
            }
        } else {
            // Bytes were lost: what comes next is not the rest of what came before.
            decoder.resync();
            counters.uart_errors = counters.uart_errors.wrapping_add(1);
        }
        topics.link.publish(Instant::now(), counters);
    }
}

fn take<M: RawMutex>(topics: &Topics<M>, counters: &mut LinkCounters, received: Received<HostMessage>) {
    match received {
        Received::Nothing => {}
        Received::Bad => counters.bad_frames = counters.bad_frames.wrapping_add(1),
        Received::Overlong => counters.overlong_frames = counters.overlong_frames.wrapping_add(1),
        Received::Message(message) => {
            counters.frames = counters.frames.wrapping_add(1);
            match message {
                HostMessage::Drive {
                    speed_m_s,
                    yaw_rate_rad_s,
                } => {
                    // A command that is not a number is no command: the dead-man time runs on.
                    if speed_m_s.is_finite() && yaw_rate_rad_s.is_finite() {
                        topics.command.publish(
                            Instant::now(),
                            DriveCommand {
                                speed_m_s,
                                yaw_rate_rad_s,
                            },
                        );
                    } else {
                        counters.bad_frames = counters.bad_frames.wrapping_add(1);
                    }
                }
                HostMessage::Request(request) => {
                    if topics.requests.try_send(request).is_err() {
                        counters.dropped_requests = counters.dropped_requests.wrapping_add(1);
                    }
                }
                HostMessage::Parameters(request) => {
                    if topics.parameter_requests.try_send(request).is_err() {
                        counters.dropped_requests = counters.dropped_requests.wrapping_add(1);
                    }
                }
                HostMessage::Identify => topics.identify.signal(()),
            }
        }
    }
}
