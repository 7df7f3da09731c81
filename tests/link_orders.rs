//! Which orders the virtual board takes from the link and which it drops.

use firmware::protocol::frame::encode;
use firmware::protocol::message::{Answer, Envelope, HostMessage, Order, OrderId, ParameterRequest, Refusal};
use model::command::{DriveCommand, Request};
use model::supervise::arming::Mode;
use model::supervise::codes::{Blocker, Fault};
use virtual_board::link_client::LinkClient;

mod support;
use support::Bench;

const DRIVE: Order = Order::Drive(DriveCommand::driving(1.0, 0.0));

/// The modes of the vehicle during `ms` milliseconds, each with the millisecond in which it began.
fn modes(bench: &mut Bench, ms: u64) -> Vec<(u64, Mode)> {
    let mut seen: Vec<(u64, Mode)> = vec![(0, bench.mode())];
    let mut at = 0;
    bench.run_watching(ms, |bench| {
        at += 1;
        let mode = bench.mode();
        if seen.last().is_none_or(|(_, last)| *last != mode) {
            seen.push((at, mode));
        }
    });
    seen
}

#[test]
fn a_disarm_comes_through_whatever_comes_with_it() {
    let storms: [&dyn Fn(usize) -> Order; 4] = [
        &|_| Order::Request(Request::ClearFaults),
        &|_| Order::Request(Request::Arm),
        &|_| Order::Parameters(ParameterRequest::Read { number: 0 }),
        &|n| {
            [
                Order::Request(Request::ClearFaults),
                Order::Request(Request::Arm),
                DRIVE,
                Order::StatusRate { hz: 50 },
            ][n % 4]
        },
    ];
    for (n, storm) in storms.iter().enumerate() {
        for (before, after) in [(6, 0), (0, 6), (200, 200)] {
            let mut bench = Bench::armed(20 + n as u64);
            for k in 0..before {
                bench.order(storm(k));
            }
            bench.request(Request::Disarm);
            for k in 0..after {
                bench.order(storm(k));
            }
            bench.drive = None;
            let mut off_after = None;
            let mut ms = 0;
            bench.run_watching(3, |bench| {
                ms += 1;
                if off_after.is_none() && !bench.bridges_on() {
                    off_after = Some(ms);
                }
            });
            assert!(
                off_after.is_some_and(|ms| ms <= 2),
                "storm {n}, {before} before, {after} after"
            );
            bench.run(50);
            let link = bench.status().link;
            let told = link.dropped_requests + link.dropped_answers;
            assert!(before + after < 100 || n == 3 || told > 0, "storm {n}: {link:?}");
        }
    }
}

#[test]
fn the_boards_button_opens_the_bridges_in_a_flood() {
    let mut bench = Bench::armed(24);
    bench.run_watching(200, |bench| {
        for _ in 0..15 {
            bench.order(Order::Request(Request::ClearFaults));
            bench.order(Order::Parameters(ParameterRequest::Read { number: 0 }));
        }
    });
    assert_eq!(bench.mode(), Mode::Armed);
    bench.board.press_button();
    for _ in 0..15 {
        bench.order(Order::Request(Request::ClearFaults));
    }
    bench.run(2);
    assert!(!bench.bridges_on());
    assert_eq!(bench.mode(), Mode::Disarmed);
    bench.run(20);
    assert!(bench.status().link.dropped_requests > 1000, "{:?}", bench.status().link);
}

#[test]
fn a_disarm_is_taken_from_anybody_and_nothing_else_is() {
    for (session, sequence) in [(0, 0), (0, 1), (12345, u32::MAX)] {
        let mut bench = Bench::armed(25);
        let id = OrderId { session, sequence };
        let frame = |message| encode(&message).expect("fits");
        for order in [
            Order::Request(Request::Arm),
            Order::Request(Request::ClearFaults),
            DRIVE,
        ] {
            let envelope = Envelope {
                id,
                given_at_us: bench.now_ms() * 1000,
            };
            bench.put(&frame(HostMessage::Order { envelope, order }));
        }
        bench.run(20);
        assert_eq!(bench.status().link.foreign_frames, 3);
        assert!(bench.status().vehicle.speed_reference_m_s.abs() < 0.002);
        assert_eq!(bench.mode(), Mode::Armed);
        bench.put(&frame(HostMessage::Disarm(id)));
        bench.run(2);
        assert!(!bench.bridges_on(), "{session} {sequence}");
    }
}

#[test]
fn frames_recorded_on_one_board_do_nothing_on_another() {
    for seed in [26, 27, 28] {
        let recorded = {
            let mut bench = Bench::driving(seed, 1.0);
            bench.run(200);
            std::mem::take(&mut bench.sent)
        };
        assert!(recorded.len() > 263, "{}", recorded.len());
        // Another board that boots in the same way, at the same instants.
        let mut bench = Bench::new(seed);
        bench.drive = None;
        bench.client = LinkClient::new(999);
        let mut frames = recorded.iter().peekable();
        let mut ms = 0;
        bench.run_watching(recorded.last().expect("some").0 + 10, |bench| {
            while let Some((_, bytes)) = frames.next_if(|(at_ms, _)| *at_ms <= ms) {
                bench.board.send(bytes);
            }
            ms += 1;
            assert!(!bench.bridges_on());
            let mode = bench.board.status().map(|status| status.mode);
            assert!(mode.is_none_or(|mode| mode == Mode::Disarmed));
        });
        let vehicle = bench.board.status().expect("runs");
        assert_eq!(vehicle.refused_arms, 0, "a request came through");
        assert!(vehicle.blockers.contains(Blocker::NoCommand));
        bench.run(20);
        assert!(bench.status().link.foreign_frames > 200, "{:?}", bench.status().link);
    }
}

#[test]
fn repeated_and_overtaken_frames_are_dropped_and_counted() {
    // Where the newest command arrives alone.
    let expected = {
        let mut bench = Bench::armed(29);
        bench.drive = None;
        let newest = Order::Drive(DriveCommand::driving(0.5, 0.0));
        let (_, newest) = bench.frame(newest).expect("identified");
        bench.put(&newest);
        bench.run(200);
        bench.status().vehicle.speed_reference_m_s
    };
    let mut bench = Bench::armed(29);
    bench.drive = None;
    let frames: Vec<Vec<u8>> = (0..4)
        .map(|n| {
            let order = Order::Drive(DriveCommand::driving(if n == 3 { 0.5 } else { 0.0 }, 0.0));
            bench.frame(order).expect("identified").1
        })
        .collect();
    let before = bench.status().link.repeated_frames;
    for n in [0, 0, 2, 1, 3, 3, 2] {
        bench.put(&frames[n]);
    }
    bench.run(200);
    assert_eq!(bench.status().link.repeated_frames - before, 4);
    let reference = bench.status().vehicle.speed_reference_m_s;
    assert!(reference > 0.1, "{reference}");
    assert_eq!(reference.to_bits(), expected.to_bits(), "{reference} {expected}");
    // An order to arm that a Disarm has overtaken.
    let (_, arm) = bench.frame(Order::Request(Request::Arm)).expect("identified");
    bench.request(Request::Disarm);
    bench.put(&arm);
    bench.run(20);
    assert_eq!(bench.mode(), Mode::Disarmed);
    assert_eq!(bench.status().vehicle.refused_arms, 0);
}

#[test]
fn a_command_is_as_old_as_when_it_was_given() {
    for latency_ms in [300, 1000, 3000] {
        for (speed_m_s, seed) in [(1.0, 30), (-0.4, 130)] {
            let mut bench = Bench::driving(seed, speed_m_s);
            bench.latency_ms[0] = latency_ms;
            let seen = modes(&mut bench, 9000);
            let [(0, Mode::Armed), (stopping, Mode::Stopping), (_, Mode::Disarmed)] = seen[..] else {
                panic!("{latency_ms} ms, seed {seed}: {seen:?}")
            };
            assert!(
                (225..=252).contains(&stopping),
                "{latency_ms} ms, seed {seed}: {seen:?}"
            );
            bench.run(4000);
            assert_eq!(bench.mode(), Mode::Disarmed, "an old command arms the vehicle");
            assert!(bench.status().link.late_orders > 50, "{:?}", bench.status().link);
        }
    }
}

/// Frames arrive without a gap, each a little later than the frame before: their age stops the vehicle.
#[test]
fn a_delay_that_creeps_up_stops_the_vehicle_by_the_age_of_its_commands() {
    for (ms_per_s, seed) in [(50, 33), (200, 34), (500, 133)] {
        let mut bench = Bench::driving(seed, 0.8);
        let (from_ms, mut stopped_at_ms) = (bench.now_ms(), None);
        bench.run_watching(400 * 1000 / ms_per_s, |bench| {
            bench.latency_ms[0] = (bench.now_ms() - from_ms) * ms_per_s / 1000;
            if bench.mode() != Mode::Armed {
                stopped_at_ms.get_or_insert(bench.latency_ms[0]);
            }
        });
        // A command is up to 20 ms old when the next command is given, and the growing delay holds the next command back.
        let stopped_at_ms = stopped_at_ms.expect("stops");
        let story = format!("{ms_per_s} ms per second, seed {seed}: at {stopped_at_ms} ms");
        println!("{story}");
        let least_ms = 250 - 30 - 250 * ms_per_s / 1000;
        assert!(
            (least_ms..=250 + 250 * ms_per_s / 1000).contains(&stopped_at_ms),
            "{story}"
        );
        assert!(
            bench
                .board
                .status()
                .expect("runs")
                .faults
                .contains(Fault::CommandTimeout),
            "{story}"
        );
    }
}

#[test]
fn a_slow_way_back_counts_too_and_a_short_one_drives() {
    for (to_board_ms, to_host_ms, drives) in [(20, 20, true), (80, 100, true), (0, 400, false), (200, 100, false)] {
        let mut bench = Bench::new(31);
        bench.latency_ms = [to_board_ms, to_host_ms];
        bench.run(2500);
        let sequence = bench.order(Order::Request(Request::Arm));
        bench.run(1000);
        let (mode, answer) = (bench.mode(), bench.client.answer_to(sequence));
        if drives {
            assert_eq!(
                (mode, answer),
                (Mode::Armed, Some(Answer::Done)),
                "{to_board_ms} {to_host_ms}"
            );
            bench.drive = Some([0.5, 0.0]);
            bench.run(3000);
            assert_eq!(bench.mode(), Mode::Armed, "{to_board_ms} {to_host_ms}");
        } else {
            let late = Answer::Refused(Refusal::Late);
            assert_eq!(
                (mode, answer),
                (Mode::Disarmed, Some(late)),
                "{to_board_ms} {to_host_ms}"
            );
        }
    }
}

#[test]
fn a_program_that_hangs_on_one_frame_is_a_silent_operator() {
    let mut bench = Bench::driving(32, 1.0);
    bench.drive = None;
    let (_, frame) = bench.frame(DRIVE).expect("identified");
    let mut stopping = None;
    let mut ms = 0;
    bench.run_watching(400, |bench| {
        if ms % 20 == 0 {
            bench.put(&frame);
        }
        ms += 1;
        if stopping.is_none() && bench.mode() == Mode::Stopping {
            stopping = Some(ms);
        }
    });
    assert!(stopping.is_some_and(|ms| ms <= 254), "{stopping:?}");
    assert!(bench.status().vehicle.faults.contains(Fault::CommandTimeout));
}

#[test]
fn an_order_from_the_future_is_dropped() {
    let mut bench = Bench::armed(33);
    bench.drive = None;
    let identity = *bench.client.identity().expect("identified");
    let mut sequence = 1_000_000;
    let stopping = {
        let mut at = None;
        let mut ms = 0;
        bench.run_watching(300, |bench| {
            sequence += 1;
            ms += 1;
            let envelope = Envelope {
                id: OrderId {
                    session: identity.session,
                    sequence,
                },
                given_at_us: bench.now_ms() * 1000 + 60_000_000,
            };
            let order = DRIVE;
            bench.put(&encode(&HostMessage::Order { envelope, order }).expect("fits"));
            if at.is_none() && bench.mode() == Mode::Stopping {
                at = Some(ms);
            }
        });
        at
    };
    assert!(stopping.is_some_and(|ms| ms <= 254), "{stopping:?}");
    assert!(bench.status().link.late_orders > 200);
}

#[test]
fn orders_are_answered_by_their_number_and_refusals_say_why() {
    let mut bench = Bench::new(34);
    bench.run(100);
    let Some(Answer::Refused(Refusal::Blocked(blockers))) = bench.ask(Order::Request(Request::Arm)) else {
        panic!("not calibrated yet")
    };
    assert!(blockers.contains(Blocker::NotCalibrated), "{blockers}");
    bench.run(1000);
    assert_eq!(bench.ask(Order::Request(Request::ClearFaults)), Some(Answer::Done));
    assert_eq!(bench.ask(Order::Request(Request::Arm)), Some(Answer::Done));
    assert_eq!(bench.mode(), Mode::Armed);
    let refused = bench.ask(Order::Request(Request::ClearFaults));
    assert_eq!(refused, Some(Answer::Refused(Refusal::NotDisarmed)));
    bench.request(Request::Disarm);
    bench.run(20);
    let arm = bench.order(Order::Request(Request::Arm));
    bench.request(Request::Disarm);
    bench.run(20);
    assert_eq!(bench.client.answer_to(arm), Some(Answer::Refused(Refusal::Disarmed)));
    assert_eq!(bench.mode(), Mode::Disarmed);
}

#[test]
fn the_status_comes_at_the_rate_that_the_host_chooses() {
    let mut bench = Bench::new(35);
    bench.run(100);
    for (hz, least, most) in [(200, 195, 205), (10, 9, 11), (0, 0, 1), (100, 95, 105)] {
        assert_eq!(bench.ask(Order::StatusRate { hz }), Some(Answer::Done), "{hz}");
        bench.run(150);
        let mut statuses = 0;
        bench.run_watching(1000, |bench| {
            statuses += u32::from(bench.client.status.take().is_some());
        });
        assert!((least..=most).contains(&statuses), "{hz} Hz: {statuses}");
    }
    assert_eq!(
        bench.ask(Order::StatusRate { hz: 1000 }),
        Some(Answer::Refused(Refusal::StatusRate { max_hz: 200 }))
    );
}

#[test]
fn a_host_believes_no_status_before_the_board_has_said_who_it_is() {
    let mut bench = Bench::new(36);
    let mut listener = LinkClient::new(5);
    for ms in 1..=100 {
        bench.board.run_until(ms * 1000);
        listener.receive(ms * 1000, &bench.board.receive());
    }
    assert!(listener.status.is_none() && listener.unidentified > 5);
    bench.board.send(&listener.identify());
    for ms in 101..=200 {
        bench.board.run_until(ms * 1000);
        listener.receive(ms * 1000, &bench.board.receive());
    }
    assert!(listener.status.is_some());
    let about = listener.identity().expect("answered").about;
    assert_eq!(
        about.schema,
        firmware::parameters::schema(&support::reference().parameters().cast())
    );
    assert_ne!(about.build, 0);
}
