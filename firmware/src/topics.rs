//! The data that the tasks share. Each topic contains its latest value with a time stamp; the reader checks the
//! value's age.

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_time::Instant;
use model::analog::Analog;
use model::command::{DriveCommand, Request};
use model::sample::ImuRaw;
use model::status::Status;
use model::supervise::codes::{Blocker, BlockerSet};
use model::vehicle::Vehicle;

use crate::checkins::Checkins;
use crate::events::Log;
use crate::fault_list::{FaultList, NewFaults};
use crate::protocol::message::{
    Answer, Identity, LinkCounters, OrderId, ParameterRequest, Read, TickCycles, UpdateRequest,
};
use crate::records::ring::RecordRings;

/// A value with its time stamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stamped<T> {
    /// When the value was taken.
    pub at: Instant,
    /// The value.
    pub value: T,
}

/// A value, or none yet. "None yet" is all zeros, whatever the value's type (an `Option` may use another number in one
/// of the value's bytes): the topics, with 100 KiB of records, therefore take no room in the flash.
#[derive(Debug, Clone, Copy)]
#[repr(u8)]
enum Held<T> {
    Nothing = 0,
    Value(T) = 1,
}

impl<T> Held<T> {
    fn value(self) -> Option<T> {
        match self {
            Self::Nothing => None,
            Self::Value(value) => Some(value),
        }
    }
}

/// The latest value of one kind, for any number of readers.
#[derive(Debug)]
pub struct Topic<M: RawMutex, T: Copy> {
    latest: Mutex<M, Cell<Held<Stamped<T>>>>,
}

impl<M: RawMutex, T: Copy> Topic<M, T> {
    /// A topic without a value.
    pub const fn new() -> Self {
        Self {
            latest: Mutex::new(Cell::new(Held::Nothing)),
        }
    }

    /// Replaces the value, stamped `at`.
    pub fn publish(&self, at: Instant, value: T) {
        self.latest.lock(|cell| cell.set(Held::Value(Stamped { at, value })));
    }

    /// The latest value.
    pub fn latest(&self) -> Option<Stamped<T>> {
        self.latest.lock(Cell::get).value()
    }

    /// The latest value, if any, and its age at `now` in us: `u32::MAX` without a value, or for an older one.
    pub fn with_age(&self, now: Instant) -> (Option<T>, u32) {
        match self.latest() {
            None => (None, u32::MAX),
            Some(Stamped { at, value }) => {
                let age = now.saturating_duration_since(at).as_micros();
                (Some(value), u32::try_from(age).unwrap_or(u32::MAX))
            }
        }
    }
}

impl<M: RawMutex, T: Copy> Default for Topic<M, T> {
    fn default() -> Self {
        Self::new()
    }
}

/// A value that one task leaves for another task, which takes the value once, at its own time. A later value replaces
/// an earlier value.
#[derive(Debug)]
pub struct Slot<M: RawMutex, T: Copy> {
    held: Mutex<M, Cell<Held<T>>>,
}

impl<M: RawMutex, T: Copy> Slot<M, T> {
    /// An empty slot.
    pub const fn new() -> Self {
        Self {
            held: Mutex::new(Cell::new(Held::Nothing)),
        }
    }

    /// Stores a value. Returns whether it replaces a value that was not taken.
    pub fn put(&self, value: T) -> bool {
        self.replace(value).is_some()
    }

    /// Leaves a value. Returns the one that it replaces, which nobody has taken.
    pub fn replace(&self, value: T) -> Option<T> {
        self.held.lock(|cell| cell.replace(Held::Value(value))).value()
    }

    /// Takes the value, if any.
    pub fn take(&self) -> Option<T> {
        self.held.lock(|cell| cell.replace(Held::Nothing)).value()
    }
}

impl<M: RawMutex, T: Copy> Default for Slot<M, T> {
    fn default() -> Self {
        Self::new()
    }
}

/// Who requested open bridges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DisarmBy {
    /// The host, by this message.
    Host(OrderId),
    /// A person at the vehicle, by the board's button.
    Button,
}

/// The host's requests to the arming state machine: the newest request of each kind, until the control task takes it.
#[derive(Debug)]
pub struct Requests<M: RawMutex>([Slot<M, OrderId>; Request::ALL.len()]);

impl<M: RawMutex> Requests<M> {
    const fn new() -> Self {
        Self([const { Slot::new() }; Request::ALL.len()])
    }

    /// Stores an order for the control task. Returns whether it replaces a waiting order of the same kind, which is
    /// dropped.
    pub fn put(&self, request: Request, id: OrderId) -> bool {
        self.0.get(request as usize).is_some_and(|waiting| waiting.put(id))
    }

    /// Takes the order with this request, if it is waiting.
    pub fn take(&self, request: Request) -> Option<OrderId> {
        self.0.get(request as usize)?.take()
    }
}

/// Blockers that other tasks raise and lower. The control task reads them in each tick, all at once.
#[derive(Debug, Default)]
pub struct TaskBlockers(AtomicU32);

impl TaskBlockers {
    const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    /// Raises a blocker if it is `present`, else lowers it.
    pub fn set(&self, blocker: Blocker, present: bool) {
        let bit = BlockerSet::EMPTY.with(blocker).bits();
        if present {
            self.0.fetch_or(bit, Ordering::Relaxed);
        } else {
            self.0.fetch_and(!bit, Ordering::Relaxed);
        }
    }

    /// The raised blockers.
    pub fn raised(&self) -> BlockerSet {
        BlockerSet::from_bits(self.0.load(Ordering::Relaxed))
    }
}

/// A request about parameters, and the order that made it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asked {
    /// The order.
    pub id: OrderId,
    /// The request.
    pub request: ParameterRequest,
}

/// A request about an update, and the order that made it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UpdateAsked {
    /// The order.
    pub id: OrderId,
    /// The request.
    pub request: UpdateRequest,
}

/// The part of the board's memory that the host wants to read, and the order with this request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// The order.
    pub id: OrderId,
    /// The part to read.
    pub read: Read,
}

/// An answer, and the order that it answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answered {
    /// The order.
    pub id: OrderId,
    /// The answer.
    pub answer: Answer,
}

/// All data that the tasks share; one per vehicle.
#[allow(missing_debug_implementations)] // Signals and channels have none.
pub struct Topics<M: RawMutex> {
    /// Readings of the arm IMU.
    pub arm_imu: Topic<M, ImuRaw>,
    /// Readings of the spar IMU.
    pub spar_imu: Topic<M, ImuRaw>,
    /// Raised with each reading of either IMU; the control task waits for the signal.
    pub imu_ready: Signal<M, ()>,
    /// Analogue readings.
    pub analog: Topic<M, Analog<u16>>,
    /// The latest drive command, stamped with the time at which the operator gave it. Every quantity is a number: the
    /// receiving task drops other commands.
    pub command: Topic<M, DriveCommand>,
    /// A request to open the bridges. It has its own slot, which no other request can fill, and the control task
    /// checks this slot first.
    pub disarm: Slot<M, DisarmBy>,
    /// The host's requests to the arming state machine, except Disarm.
    pub requests: Requests<M>,
    /// The host's requests about parameters.
    pub parameter_requests: Channel<M, Asked, 4>,
    /// The host's requests about updates: one at a time, as each waits for the flash.
    pub update_requests: Channel<M, UpdateAsked, 1>,
    /// Blockers that other tasks raise: an update that is being stored, the board's own supply.
    pub blockers: TaskBlockers,
    /// Answers to the host's orders, in order of their sending.
    pub answers: Channel<M, Answered, 8>,
    /// Answers that the control task dropped, since boot: [`Topics::answer_of_the_tick`].
    pub dropped_answers: AtomicU32,
    /// Whether a changed set is about to come into force: the vehicle must not arm meanwhile.
    pub parameters_pending: Topic<M, bool>,
    /// A new set of parameters, in force from the next disarmed tick on.
    pub new_vehicle: Slot<M, Vehicle<f32>>,
    /// Answer to the host's latest Identify.
    pub identity: Signal<M, Identity>,
    /// The rate at which the host wants the status, Hz.
    pub status_rate: Slot<M, u16>,
    /// The vehicle's status after the last tick.
    pub status: Topic<M, Status>,
    /// CPU cycles of the last tick.
    pub cycles: Topic<M, TickCycles>,
    /// The last faults, of this boot and of those before.
    pub faults: FaultList<M>,
    /// Faults that the control task has latched, for the history.
    pub new_faults: Channel<M, NewFaults, 8>,
    /// The log for the link.
    pub log: Log<M>,
    /// The records of the last ticks.
    pub records: RecordRings<M>,
    /// The host's requests to read the board's memory.
    pub readings: Channel<M, Wanted, 4>,
    /// The block number at which the host wants the stream of records to begin; `None` stops the stream.
    pub recording: Slot<M, Option<u32>>,
    /// Counters of the link's input.
    pub link: Topic<M, LinkCounters>,
    /// Check-ins of the critical tasks.
    pub checkins: Checkins<M>,
}

impl<M: RawMutex> Topics<M> {
    /// All topics empty.
    pub const fn new() -> Self {
        Self {
            arm_imu: Topic::new(),
            spar_imu: Topic::new(),
            imu_ready: Signal::new(),
            analog: Topic::new(),
            command: Topic::new(),
            disarm: Slot::new(),
            requests: Requests::new(),
            parameter_requests: Channel::new(),
            update_requests: Channel::new(),
            blockers: TaskBlockers::new(),
            answers: Channel::new(),
            dropped_answers: AtomicU32::new(0),
            parameters_pending: Topic::new(),
            new_vehicle: Slot::new(),
            identity: Signal::new(),
            status_rate: Slot::new(),
            status: Topic::new(),
            cycles: Topic::new(),
            faults: FaultList::new(),
            new_faults: Channel::new(),
            log: Log::new(),
            records: RecordRings::new(),
            readings: Channel::new(),
            recording: Slot::new(),
            link: Topic::new(),
            checkins: Checkins::new(),
        }
    }
}

impl<M: RawMutex> Topics<M> {
    /// Leaves an answer to the sending task. One that finds no room is dropped and counted: a tick waits for nobody.
    pub fn answer_of_the_tick(&self, id: OrderId, answer: Answer) {
        if self.answers.try_send(Answered { id, answer }).is_err() {
            self.dropped_answers.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Leaves the wish to open the bridges. A host's wish that another one replaces before the tick has it is carried out
    /// with it, and its answer is dropped and counted.
    pub fn ask_to_disarm(&self, by: DisarmBy) {
        if let Some(DisarmBy::Host(_)) = self.disarm.replace(by) {
            self.dropped_answers.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The counters of the link's input, with the answers that the control task has dropped.
    pub fn link_counters(&self) -> LinkCounters {
        let mut counters = self.link.latest().map(|link| link.value).unwrap_or_default();
        let dropped = self.dropped_answers.load(Ordering::Relaxed);
        counters.dropped_answers = counters.dropped_answers.wrapping_add(dropped);
        counters
    }
}

impl<M: RawMutex> Default for Topics<M> {
    fn default() -> Self {
        Self::new()
    }
}
