//! Virtual time: embassy-time's clock and alarms, one set per thread.
//!
//! The firmware's tasks ask embassy-time for the time as they do on the board. Here the time stands
//! still until [`VirtualTime::advance_to`] moves it. Each thread has its own clock, so tests that run side by
//! side in one process do not share time by accident; two vehicles in one thread are refused.

use std::cell::{Cell, RefCell};
use std::task::Waker;

use embassy_time_driver::Driver;

/// The thread's clock is taken: the thread runs another vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("this thread already runs a virtual vehicle: one at a time, or one a thread")]
pub struct ClockTaken;

/// The alarm of one task, which is kept when it has rung: the task sets the alarm again in the next millisecond.
struct Alarm {
    waker: Waker,
    /// `u64::MAX`: not set.
    due_us: u64,
}

struct Clock {
    taken: Cell<bool>,
    /// One for each task that has ever waited: some ten.
    alarms: RefCell<Vec<Alarm>>,
}

impl Clock {
    /// Rings the alarms that are due; returns when the next one is.
    fn ring(&self) -> u64 {
        let now_us = NOW_US.get();
        let mut next_us = u64::MAX;
        for alarm in self.alarms.borrow_mut().iter_mut() {
            if alarm.due_us <= now_us {
                alarm.due_us = u64::MAX;
                alarm.waker.wake_by_ref();
            }
            next_us = next_us.min(alarm.due_us);
        }
        next_us
    }
}

thread_local! {
    /// The time: apart from the clock's other parts because it is read some forty times each millisecond, and a number
    /// needs no destructor, which every access would look for.
    static NOW_US: Cell<u64> = const { Cell::new(0) };
    /// When the first alarm is due, or earlier; apart for the same reason.
    static NEXT_US: Cell<u64> = const { Cell::new(u64::MAX) };
    static CLOCK: Clock =
        const {
            Clock {
                taken: Cell::new(false),
                alarms: RefCell::new(Vec::new()),
            }
        };
}

/// A task waits for the first time.
#[cold]
#[inline(never)]
fn add_alarm(alarms: &mut Vec<Alarm>, waker: &Waker, due_us: u64) {
    let waker = waker.clone();
    alarms.push(Alarm { waker, due_us });
}

struct ThreadClock;

impl Driver for ThreadClock {
    fn now(&self) -> u64 {
        NOW_US.get()
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        CLOCK.with(|clock| {
            let mut alarms = clock.alarms.borrow_mut();
            match alarms.iter_mut().find(|alarm| alarm.waker.will_wake(waker)) {
                Some(alarm) => alarm.due_us = alarm.due_us.min(at),
                None => add_alarm(&mut alarms, waker, at),
            }
        });
        NEXT_US.set(NEXT_US.get().min(at));
    }
}

// The driver's two entry points are linked by name; the macro exports them.
#[allow(unsafe_code)]
mod driver {
    use super::ThreadClock;
    embassy_time_driver::time_driver_impl!(static DRIVER: ThreadClock = ThreadClock);
}

/// This thread's clock, from 0, until dropped.
#[derive(Debug)]
pub struct VirtualTime {
    /// Not to be sent: the clock belongs to the thread.
    _not_send: std::marker::PhantomData<*const ()>,
}

impl VirtualTime {
    /// Takes the thread's clock and sets it to 0.
    ///
    /// # Errors
    /// [`ClockTaken`] while another vehicle of this thread has it.
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
        NOW_US.get()
    }

    /// Wakes what is due and returns when the next alarm is due (`u64::MAX` if none is set).
    #[inline]
    pub fn next_alarm_us(&self) -> u64 {
        if NEXT_US.get() <= NOW_US.get() {
            NEXT_US.set(CLOCK.with(Clock::ring));
        }
        NEXT_US.get()
    }

    /// Sets the clock to 0 and forgets every alarm, as a reset does: whoever set one is gone.
    pub fn restart(&self) {
        NOW_US.set(0);
        NEXT_US.set(u64::MAX);
        CLOCK.with(|clock| clock.alarms.borrow_mut().clear());
    }

    /// Moves the clock forward.
    pub fn advance_to(&self, now_us: u64) {
        NOW_US.set(NOW_US.get().max(now_us));
    }
}

impl Drop for VirtualTime {
    fn drop(&mut self) {
        CLOCK.with(|clock| clock.taken.set(false));
    }
}

#[cfg(test)]
mod tests {
    use embassy_time::{Duration, Instant, Timer};

    use super::*;
    use crate::board::executor::Executor;

    #[test]
    fn a_timer_fires_exactly_when_the_clock_gets_there() {
        let time = VirtualTime::take().expect("free");
        let mut executor = Executor::default();
        let fired = std::rc::Rc::new(Cell::new(None));
        let seen = fired.clone();
        executor
            .spawn(async move {
                Timer::after(Duration::from_micros(1500)).await;
                seen.set(Some(Instant::now().as_micros()));
            })
            .expect("spawns");
        executor.run_until_stalled();
        assert_eq!(time.next_alarm_us(), 1500);
        time.advance_to(1499);
        assert_eq!(time.next_alarm_us(), 1500);
        executor.run_until_stalled();
        assert_eq!(fired.get(), None);
        time.advance_to(1500);
        assert_eq!(time.next_alarm_us(), u64::MAX);
        executor.run_until_stalled();
        assert_eq!(fired.get(), Some(1500));
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
