//! The control task: once per tick it samples the sensors, takes one step of the vehicle's core, and drives the
//! bridges.
//!
//! The age of every sample follows from this task's design and does not depend on the order in which an executor
//! polls: the tick reads the encoders, waits for the IMUs' samples of the tick, and uses the analogue reading of half
//! a tick before ([`crate::analog`]).

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::{Duration, Instant, with_timeout};
use model::command::{Command, Request};
use model::sample::{Actuation, ImuRaw, ImuSample, MOTORS, Sample};
use model::supervise::arming::Mode;
use model::supervise::codes::{BlockerSet, FaultSet};
use model::tick::VehicleCore;
use model::vehicle::Vehicle;

use crate::checkins::CriticalTask;
use crate::encoders::Encoders;
use crate::fault_list::NewFaults;
use crate::flight_record::{FlightRecord, Recorder};
use crate::hardware::{Bridges, CycleCounter, EmergencyStop, EncoderCounters};
use crate::orders::Orders;
use crate::protocol::message::TickCycles;
use crate::records::recorder::TickRecorder;
use crate::ticks::{TICK, Ticks, tick_of};
use crate::topics::{Topic, Topics};

/// Longest time that a tick waits for its IMU samples before it continues without them.
const IMU_WAIT: Duration = Duration::from_micros(400);

/// The hardware of the control task.
#[derive(Debug)]
pub struct DriveHardware<N, B, E, C, R> {
    /// The encoders' counters.
    pub encoders: N,
    /// The motor bridges.
    pub bridges: B,
    /// The emergency stop.
    pub emergency_stop: E,
    /// The counter of CPU cycles.
    pub cycles: C,
    /// The recorder of ticks.
    pub recorder: R,
    /// What the board's self-test found at boot.
    pub blockers: BlockerSet,
}

/// Runs the vehicle, tick after tick: `core` decides, `hardware` acts. The core stays in the caller's storage, because
/// moving it from future to future would take kilobytes of stack.
pub async fn run<M, N, B, E, C, R>(
    topics: &Topics<M>,
    core: &mut VehicleCore,
    hardware: DriveHardware<N, B, E, C, R>,
) -> !
where
    M: RawMutex,
    N: EncoderCounters,
    B: Bridges,
    E: EmergencyStop,
    C: CycleCounter,
    R: Recorder,
{
    let DriveHardware {
        encoders,
        mut bridges,
        mut emergency_stop,
        cycles: counter,
        mut recorder,
        blockers,
    } = hardware;
    bridges.apply(&Actuation::SAFE);
    let mut encoders = Encoders::new(encoders);
    let mut cycles = TickCycles::default();
    let mut ticks = TickRecorder::new();
    let mut latched = FaultSet::EMPTY;
    let mut tick = 0_u32;
    let mut vehicle_ticks = Ticks::from_now();
    loop {
        vehicle_ticks.next().await;
        // Reading the IMUs takes some tens of microseconds. If no sample comes in time, the tick uses the last sample,
        // and the core checks its age.
        let _ = with_timeout(IMU_WAIT, imu_samples(topics, tick_of(Instant::now()))).await;

        let started = counter.cycles();
        let now = Instant::now();
        let mode = core.mode();
        let orders = Orders::take(topics, mode);
        let request = orders.request();
        // Only while disarmed, because a break that trips in the tick of the request must not be cleared unseen.
        if request == Request::ClearFaults && core.mode() == Mode::Disarmed {
            bridges.clear_break();
        }
        tick = tick.wrapping_add(1);
        // The record exists from the beginning of the tick, so none of its parts is copied.
        let mut record = FlightRecord {
            tick,
            sample: gather(
                topics,
                now,
                encoders.counts(),
                Switched {
                    emergency_stop: emergency_stop.is_pressed(),
                    break_input: bridges.break_input_active(),
                    bridge_break: bridges.break_tripped(),
                    board_blockers: blockers.union(topics.blockers.raised()).bits(),
                },
            ),
            command: command(topics, now, request),
            actuation: Actuation::SAFE,
        };

        if core.mode() == Mode::Disarmed
            && let Some(vehicle) = topics.new_vehicle.take()
        {
            change_vehicle(core, &vehicle);
        }
        let sensed = core.sense(&record.sample);
        let after_sense = counter.cycles();
        let estimated = core.estimate(&sensed);
        let after_estimate = counter.cycles();
        let decision = core.decide(&sensed, &estimated, &record.command);
        let after_decide = counter.cycles();
        let output = core.actuate(&sensed, &estimated.estimate, decision);
        bridges.apply(&output.actuation);
        let after_actuate = counter.cycles();

        record.actuation = output.actuation;
        recorder.record(&record);
        if recorder.for_host() {
            ticks.record(&topics.records, &record, &output.status);
        }
        let faults = FaultSet::from_bits(output.status.faults.bits() & !latched.bits());
        if !faults.is_empty() {
            // If the channel to the fault history is full, the latest faults are lost, because the tick never waits.
            let _ = topics.new_faults.try_send(NewFaults {
                time_us: record.sample.time_us,
                mode,
                faults,
            });
        }
        latched = output.status.faults;
        topics.status.publish(now, output.status);
        orders.answer(topics, &output.status);
        let total = after_actuate.wrapping_sub(started);
        cycles = TickCycles {
            sense: after_sense.wrapping_sub(started),
            estimate: after_estimate.wrapping_sub(after_sense),
            decide: after_decide.wrapping_sub(after_estimate),
            actuate: after_actuate.wrapping_sub(after_decide),
            total,
            worst: cycles.worst.max(total),
        };
        topics.cycles.publish(now, cycles);
        topics.checkins.check_in(CriticalTask::Drive);
    }
}

/// Waits for the IMUs' samples of the tick that began at `begin`. The function waits for the spar IMU only if it gave
/// a sample in the previous tick, so a dead or missing spar IMU does not delay the drive.
async fn imu_samples<M: RawMutex>(topics: &Topics<M>, begin: Instant) {
    let since = |topic: &Topic<M, ImuRaw>, from: u64| topic.latest().is_some_and(|sample| sample.at.as_ticks() >= from);
    let begin = begin.as_ticks();
    let with_spar = since(&topics.spar_imu, begin.saturating_sub(TICK.as_ticks()));
    while !since(&topics.arm_imu, begin) || (with_spar && !since(&topics.spar_imu, begin)) {
        topics.imu_ready.wait().await;
    }
}

/// Replaces `core` by a core for another vehicle. Not inlined into the tick, because the new core takes kilobytes of
/// stack.
#[cold]
#[inline(never)]
fn change_vehicle(core: &mut VehicleCore, vehicle: &Vehicle<f32>) {
    *core = core.with_vehicle(vehicle);
}

/// The binary inputs of a sample.
#[derive(Clone, Copy)]
struct Switched {
    emergency_stop: bool,
    break_input: bool,
    bridge_break: bool,
    board_blockers: u32,
}

/// The sample of this tick: the present encoder counts, and the latest of every other reading.
fn gather<M: RawMutex>(topics: &Topics<M>, now: Instant, encoder_counts: [i64; MOTORS], switched: Switched) -> Sample {
    let Switched {
        emergency_stop,
        break_input,
        bridge_break,
        board_blockers,
    } = switched;
    let imu = |(raw, age_us): (Option<ImuRaw>, u32)| ImuSample {
        raw: raw.unwrap_or_default(),
        age_us,
    };
    let (analog, analog_age_us) = topics.analog.with_age(now);
    Sample {
        time_us: now.as_micros(),
        encoder_counts,
        encoder_age_us: 0,
        arm_imu: imu(topics.arm_imu.with_age(now)),
        spar_imu: imu(topics.spar_imu.with_age(now)),
        analog: analog.unwrap_or_default(),
        analog_age_us,
        emergency_stop,
        break_input,
        bridge_break,
        board_blockers,
    }
}

/// The present command in this tick.
fn command<M: RawMutex>(topics: &Topics<M>, now: Instant, request: Request) -> Command {
    let (drive, age_us) = topics.command.with_age(now);
    let parameters_pending = topics.parameters_pending.latest().is_some_and(|pending| pending.value);
    Command {
        drive: drive.unwrap_or_default(),
        age_us,
        request,
        parameters_pending,
    }
}
