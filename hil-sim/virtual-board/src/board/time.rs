//! Virtual time: embassy-time's clock and alarms, one set per thread.
//!
//! The firmware's tasks read the time from embassy-time, as on the board. Here the time changes only when
//! [`VirtualTime::advance_to`] advances it. Each thread has its own clock, so parallel tests in one process do not share
//! time by accident. A second vehicle in the same thread is refused.

use std::cell::{Cell, RefCell};
use std::task::Waker;

use embassy_time_driver::Driver;

/// The thread's clock is in use, because the thread runs another vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("this thread already runs a virtual vehicle: one at a time, or one a thread")]
pub struct ClockTaken;

/// Number of places of tasks that set their alarms by place: the bits of a word.
pub(super) const PLACES: usize = u64::BITS as usize;

/// The alarm of a waker that is no task of the executor. The alarm is kept after it has rung.
struct Alarm {
    waker: Waker,
    /// Due time; `u64::MAX` means not set.
    due_us: u64,
}

struct Clock {
    taken: Cell<bool>,
    others: RefCell<Vec<Alarm>>,
}

impl Clock {
    /// Rings the due alarms and returns the time of the next alarm.
    fn ring(&self) -> u64 {
        let now_us = ALARMS.with(|alarms| alarms.now_us.get());
        let mut next_us = u64::MAX;
        for alarm in self.others.borrow_mut().iter_mut() {
            if alarm.due_us <= now_us {
                alarm.due_us = u64::MAX;
                alarm.waker.wake_by_ref();
            }
            next_us = next_us.min(alarm.due_us);
        }
        next_us
    }

    #[cold]
    #[inline(never)]
    fn set_other(&self, at_us: u64, waker: &Waker) {
        let mut others = self.others.borrow_mut();
        match others.iter_mut().find(|alarm| alarm.waker.will_wake(waker)) {
            Some(alarm) => alarm.due_us = alarm.due_us.min(at_us),
            None => others.push(Alarm {
                waker: waker.clone(),
                due_us: at_us,
            }),
        }
    }
}

/// The time and the alarms of the executor's tasks. They are separate from the clock's other parts because they are read
/// some fifty times per millisecond, and a thread-local without a destructor is cheaper to access.
struct Alarms {
    now_us: Cell<u64>,
    /// A time at or before the first due alarm.
    next_us: Cell<u64>,
    /// The places that have set an alarm, one bit per place, and the due times.
    set: Cell<u64>,
    due_us: [Cell<u64>; PLACES],
    /// The place that is being polled, and the data of its waker; [`PLACES`] while no task is polled.
    polled: Cell<(usize, *const ())>,
    /// Whether a waker other than that of the polled task has set an alarm.
    others: Cell<bool>,
}

thread_local! {
    static ALARMS: Alarms = const {
        Alarms {
            now_us: Cell::new(0),
            next_us: Cell::new(u64::MAX),
            set: Cell::new(0),
            due_us: [const { Cell::new(0) }; PLACES],
            polled: Cell::new((PLACES, std::ptr::null())),
            others: Cell::new(false),
        }
    };
    static CLOCK: Clock =
        const {
            Clock {
                taken: Cell::new(false),
                others: RefCell::new(Vec::new()),
            }
        };
}

impl Alarms {
    /// Sets the alarm of the task at `place`, unless an earlier one is set.
    #[inline]
    fn set(&self, place: usize, at_us: u64) {
        let (bit, Some(due_us)) = (1_u64 << (place % PLACES), self.due_us.get(place)) else {
            return;
        };
        let set = self.set.get();
        if set & bit == 0 || at_us < due_us.get() {
            due_us.set(at_us);
            self.set.set(set | bit);
        }
    }

    /// Takes the due alarms, one bit per place, and finds the next alarm among the others.
    fn take_due(&self) -> u64 {
        let now_us = self.now_us.get();
        let (mut due, mut next_us) = (0, u64::MAX);
        let mut waiting = self.set.get();
        while waiting != 0 {
            let place = waiting.trailing_zeros() as usize;
            waiting &= waiting - 1;
            let due_us = self.due_us[place].get();
            if due_us > now_us {
                next_us = next_us.min(due_us);
            } else {
                due |= 1 << place;
            }
        }
        self.set.set(self.set.get() & !due);
        if self.others.get() {
            next_us = next_us.min(CLOCK.with(Clock::ring));
        }
        self.next_us.set(next_us);
        due
    }
}

/// Marks that the task at `place` is being polled with a waker of these data. Only this task sets its alarms, which are
/// found by the place instead of the waker.
#[inline]
pub(super) fn poll_place(place: usize, waker: *const ()) {
    ALARMS.with(|alarms| alarms.polled.set((place, waker)));
}

/// Marks that no task is being polled.
#[inline]
pub(super) fn poll_none() {
    poll_place(PLACES, std::ptr::null());
}

struct ThreadClock;

impl Driver for ThreadClock {
    fn now(&self) -> u64 {
        ALARMS.with(|alarms| alarms.now_us.get())
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        ALARMS.with(|alarms| {
            let (place, polled) = alarms.polled.get();
            if waker.data() == polled && place < PLACES {
                alarms.set(place, at);
            } else {
                alarms.others.set(true);
                CLOCK.with(|clock| clock.set_other(at, waker));
            }
            alarms.next_us.set(alarms.next_us.get().min(at));
        });
    }
}

// The driver's two entry points are linked by name; the macro exports these names.
#[allow(unsafe_code)]
mod driver {
    use super::ThreadClock;
    embassy_time_driver::time_driver_impl!(static DRIVER: ThreadClock = ThreadClock);
}

/// This thread's clock, which starts at 0 and is released when dropped.
#[derive(Debug)]
pub struct VirtualTime {
    /// Makes the type `!Send`, because the clock belongs to the thread.
    _not_send: std::marker::PhantomData<*const ()>,
}

impl VirtualTime {
    /// Takes the thread's clock and sets it to 0.
    ///
    /// # Errors
    /// [`ClockTaken`] while another vehicle of this thread uses the clock.
    pub fn take() -> Result<Self, ClockTaken> {
        CLOCK.with(|clock| {
            if clock.taken.replace(true) {
                return Err(ClockTaken);
            }
            let time = Self {
                _not_send: std::marker::PhantomData,
            };
            time.restart();
            Ok(time)
        })
    }

    /// The time, us.
    pub fn now_us(&self) -> u64 {
        ALARMS.with(|alarms| alarms.now_us.get())
    }

    /// Takes the due alarms of the executor's tasks, one bit per place, and wakes every other due waker.
    #[inline]
    pub fn take_due(&self) -> u64 {
        ALARMS.with(|alarms| {
            if alarms.next_us.get() <= alarms.now_us.get() {
                alarms.take_due()
            } else {
                0
            }
        })
    }

    /// Due time of the next alarm (`u64::MAX` if no alarm is set).
    #[inline]
    pub fn next_us(&self) -> u64 {
        ALARMS.with(|alarms| alarms.next_us.get())
    }

    /// Sets the clock to 0 and forgets every alarm, as a reset does: whoever set one is gone.
    pub fn restart(&self) {
        ALARMS.with(|alarms| {
            alarms.now_us.set(0);
            alarms.next_us.set(u64::MAX);
            alarms.set.set(0);
            alarms.others.set(false);
        });
        CLOCK.with(|clock| clock.others.borrow_mut().clear());
    }

    /// Moves the clock forward.
    #[inline]
    pub fn advance_to(&self, now_us: u64) {
        ALARMS.with(|alarms| alarms.now_us.set(alarms.now_us.get().max(now_us)));
    }
}

impl Drop for VirtualTime {
    fn drop(&mut self) {
        CLOCK.with(|clock| clock.taken.set(false));
    }
}

#[cfg(test)]
mod tests {
    use std::future::Future;

    use embassy_time::{Duration, Timer};

    use super::*;

    #[test]
    fn whoever_waits_without_the_executor_is_woken_when_the_clock_gets_there() {
        use std::pin::pin;
        use std::sync::Arc;
        use std::sync::atomic::{AtomicU32, Ordering};
        use std::task::{Context, Wake};

        struct Count(AtomicU32);
        impl Wake for Count {
            fn wake(self: Arc<Self>) {
                self.0.fetch_add(1, Ordering::Relaxed);
            }
        }

        let time = VirtualTime::take().expect("free");
        let wakes = Arc::new(Count(AtomicU32::new(0)));
        let waker = Waker::from(wakes.clone());
        let mut late = pin!(Timer::after(Duration::from_micros(900)));
        let mut early = pin!(Timer::after(Duration::from_micros(700)));
        for _ in 0..2 {
            assert!(late.as_mut().poll(&mut Context::from_waker(&waker)).is_pending());
            assert!(early.as_mut().poll(&mut Context::from_waker(&waker)).is_pending());
        }
        for (to_us, next_us, woken) in [(699, 700, 0), (700, u64::MAX, 1), (900, u64::MAX, 1)] {
            time.advance_to(to_us);
            time.take_due();
            assert_eq!(time.next_us(), next_us, "{to_us}");
            assert_eq!(wakes.0.load(Ordering::Relaxed), woken, "{to_us}");
        }
        assert!(late.as_mut().poll(&mut Context::from_waker(&waker)).is_ready());
    }

    #[test]
    fn a_thread_has_one_clock_and_another_thread_its_own() {
        let time = VirtualTime::take().expect("free");
        assert_eq!(VirtualTime::take().expect_err("taken"), ClockTaken);
        time.advance_to(77);
        let other = std::thread::spawn(|| VirtualTime::take().map(|t| t.now_us()))
            .join()
            .expect("thread ends");
        assert_eq!(other, Ok(0));
        drop(time);
        assert_eq!(VirtualTime::take().expect("free again").now_us(), 0);
    }
}
