//! The link's sending task: the status at the host's rate, and answers.

use embassy_futures::select::{Either5, select5};
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Ticker};
use embedded_io_async::Write;

use crate::checkins::CriticalTask;
use crate::drive_board::LINK_BAUD;
use crate::hardware::ClockSource;
use crate::protocol::frame::encode;
use crate::protocol::message::{BoardMessage, BoardStatus, Read, Reading, STATUS_RATE_HZ};
use crate::topics::{Answered, Topics, Wanted};

/// Longest frame of a status, bytes; a test of this module proves it.
const STATUS_FRAME_MAX: u32 = 400;
/// Bits on the line for a byte: start, eight, stop.
const BITS_PER_BYTE: u32 = 10;
/// Share of the line that statuses may take, percent: the rest is for answers.
const STATUS_SHARE_PERCENT: u32 = 87;

/// Largest rate of the status that the line carries, Hz.
pub const fn status_rate_max_hz() -> u16 {
    let bytes_per_s = LINK_BAUD / BITS_PER_BYTE;
    (bytes_per_s * STATUS_SHARE_PERCENT / 100 / STATUS_FRAME_MAX) as u16
}

/// The task's period while the host wants no status: the task still checks in with the watchdog.
const IDLE_PERIOD: Duration = Duration::from_millis(100);

/// Sends the status and the answers for ever; `boot` is the number of this boot, `clock` what the board's clocks run
/// from.
pub async fn run<M: RawMutex>(topics: &Topics<M>, mut uart: impl Write, boot: u32, clock: ClockSource) -> ! {
    let mut rate_hz = STATUS_RATE_HZ;
    let mut ticker = Ticker::every(period(rate_hz));
    let mut sequence = 0_u32;
    let mut round = 0_u32;
    let mut next_block = None;
    loop {
        // The status has priority: no flood of questions delays it.
        let next = select5(
            ticker.next(),
            topics.identity.wait(),
            topics.answers.receive(),
            topics.readings.receive(),
            topics.records.ready.wait(),
        );
        match next.await {
            Either5::First(()) => {
                topics.checkins.check_in(CriticalTask::Link);
                if let Some(hz) = topics.status_rate.take()
                    && hz != rate_hz
                {
                    rate_hz = hz;
                    ticker = Ticker::every(period(rate_hz));
                }
                round = round.wrapping_add(1);
                if rounds_per_status(rate_hz).is_some_and(|rounds| round.is_multiple_of(rounds))
                    && let Some(vehicle) = topics.status.latest()
                {
                    sequence = sequence.wrapping_add(1);
                    let status = BoardStatus {
                        boot,
                        sequence,
                        vehicle: vehicle.value,
                        link: topics.link_counters(),
                        cycles: topics.cycles.latest().map(|c| c.value).unwrap_or_default(),
                        clock,
                    };
                    send(&mut uart, &BoardMessage::Status(status)).await;
                }
            }
            Either5::Second(identity) => send(&mut uart, &BoardMessage::Identity(identity)).await,
            Either5::Third(Answered { id, answer }) => {
                send(&mut uart, &BoardMessage::Answer { id, answer }).await;
            }
            Either5::Fourth(Wanted { id, read }) => {
                let reading = read_memory(topics, read);
                send(&mut uart, &BoardMessage::Reading { id, reading }).await;
            }
            Either5::Fifth(()) => {
                if let Some(from) = topics.recording.take() {
                    next_block = from;
                }
                // One block per round, so that the status can be sent between two blocks.
                if let Some(from) = next_block
                    && let Some(block) = topics.records.streamed_from(from)
                {
                    next_block = Some(block.number.wrapping_add(1));
                    send(&mut uart, &BoardMessage::Records(block)).await;
                    topics.records.ready.signal(());
                }
            }
        }
    }
}

/// The task's period at a rate of the status in Hz.
fn period(rate_hz: u16) -> Duration {
    if rate_hz == 0 {
        IDLE_PERIOD
    } else {
        Duration::from_hz(u64::from(rate_hz)).min(IDLE_PERIOD)
    }
}

/// Number of the task's periods between two statuses; `None` if the host wants no status. Below the rate of an idle
/// task, every second, third, ... period sends a status.
fn rounds_per_status(rate_hz: u16) -> Option<u32> {
    let status_us = 1_000_000_u64.checked_div(u64::from(rate_hz))?;
    Some(status_us.div_ceil(period(rate_hz).as_micros().max(1)).max(1) as u32)
}

/// Reads a part of the board's memory.
fn read_memory<M: RawMutex>(topics: &Topics<M>, read: Read) -> Reading {
    match read {
        Read::LookBack { from } => {
            let (frozen, block) = topics.records.look_back_from(from);
            Reading::LookBack { frozen, block }
        }
        Read::Log { from } => Reading::Log(topics.log.from(from)),
        Read::Faults { from } => Reading::Faults(topics.faults.from(from)),
    }
}

/// Sends one message. If the UART fails, the message is lost, and the next message is sent anyway.
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

    #[test]
    fn the_status_comes_at_every_rate() {
        let per_status = [0, 1, 3, 10, 100, 200].map(rounds_per_status);
        assert_eq!(per_status, [None, Some(10), Some(4), Some(1), Some(1), Some(1)]);
    }

    /// While no status is wanted, and between rare ones, the task wakes every 100 ms to check in with the watchdog.
    #[test]
    fn the_task_wakes_with_each_status_and_at_least_every_100_ms() {
        let periods_us = [0, 1, 10, 20, 100, 200].map(|hz| period(hz).as_micros());
        assert_eq!(periods_us, [100_000, 100_000, 100_000, 50_000, 10_000, 5_000]);
    }

    #[test]
    fn each_part_of_the_memory_is_read_for_itself() {
        use embassy_sync::blocking_mutex::raw::NoopRawMutex;
        let topics = std::boxed::Box::new(Topics::<NoopRawMutex>::new());
        let entry = crate::fault_list::FaultEntry {
            number: 4,
            boot: 1,
            time_us: 2,
            mode: Mode::Armed,
            fault: 3,
        };
        topics.faults.push(entry);
        let read = |read| read_memory(&topics, read);
        let Reading::Faults(faults) = read(Read::Faults { from: 4 }) else {
            panic!("faults were asked for");
        };
        assert_eq!(faults.as_slice(), [entry]);
        assert_eq!(read(Read::Faults { from: 5 }), Reading::Faults(heapless::Vec::new()));
        assert!(matches!(read(Read::Log { from: 0 }), Reading::Log(_)));
        topics.records.freeze();
        assert_eq!(
            read(Read::LookBack { from: 0 }),
            Reading::LookBack {
                frozen: true,
                block: None
            }
        );
    }

    #[test]
    fn the_line_carries_the_largest_rate() {
        assert_eq!(status_rate_max_hz(), 200);
    }

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
            repeated_frames: u32::MAX,
            foreign_frames: u32::MAX,
            late_orders: u32::MAX,
            dropped_answers: u32::MAX,
        };
        let cycles = TickCycles {
            sense: u32::MAX,
            estimate: u32::MAX,
            decide: u32::MAX,
            actuate: u32::MAX,
            total: u32::MAX,
            worst: u32::MAX,
        };
        let frame = encode(&BoardMessage::Status(BoardStatus {
            boot: u32::MAX,
            sequence: u32::MAX,
            vehicle,
            link,
            cycles,
            clock: ClockSource::Internal,
        }))
        .expect("fits");
        assert!(
            frame.len() > 200 && frame.len() <= STATUS_FRAME_MAX as usize && frame.len() < FRAME_MAX - 100,
            "{}",
            frame.len()
        );
    }
}
