//! Runs the firmware's tasks on one thread until all of them wait.
//!
//! The project has its own executor because every millisecond of virtual time polls some ten futures. These futures
//! never end, and none is added later, so one word can mark the ready tasks. In each round the tasks run in the
//! order of their start, so a run does not depend on the order of the wake-ups.

use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::{Context, Wake, Waker};

use super::time::{PLACES, poll_none, poll_place};

/// Largest number of tasks: the bits of the word.
const TASKS_MAX: usize = PLACES;

/// A set of tasks.
#[derive(Default)]
pub struct Executor {
    tasks: Vec<BoardTask>,
    /// One bit per task, set if the task is to be polled.
    ready: Arc<AtomicU64>,
}

struct BoardTask {
    future: Pin<Box<dyn Future<Output = ()>>>,
    waker: Waker,
    ended: bool,
}

/// A waker that makes one task ready.
struct Bell {
    ready: Arc<AtomicU64>,
    bit: u64,
}

impl Wake for Bell {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.ready.fetch_or(self.bit, Ordering::Relaxed);
    }
}

/// The executor is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooManyTasks;

impl Executor {
    /// Adds a task, which is ready at once.
    ///
    /// # Errors
    /// [`TooManyTasks`]: beyond 64.
    pub fn spawn(&mut self, future: impl Future<Output = ()> + 'static) -> Result<(), TooManyTasks> {
        let place = self.tasks.len();
        if place == TASKS_MAX {
            return Err(TooManyTasks);
        }
        let bell = Arc::new(Bell {
            ready: self.ready.clone(),
            bit: 1 << place,
        });
        bell.wake_by_ref();
        self.tasks.push(BoardTask {
            future: Box::pin(future),
            waker: bell.into(),
            ended: false,
        });
        Ok(())
    }

    /// Number of tasks.
    pub fn tasks(&self) -> usize {
        self.tasks.len()
    }

    /// Makes the tasks from the place `first` on hang, in the order of their start: the executor never polls them
    /// again.
    pub fn hang_from(&mut self, first: usize) {
        for task in self.tasks.iter_mut().skip(first) {
            task.ended = true;
        }
    }

    /// Never polls the task at a place again: it hangs.
    pub fn hang(&mut self, place: usize) {
        if let Some(task) = self.tasks.get_mut(place) {
            task.ended = true;
        }
    }

    /// Polls the tasks at the places `due`, a bit for each, and what is ready, in rounds, until no task is.
    pub fn run_until_stalled(&mut self, due: u64) {
        let mut due = due;
        loop {
            let mut round = self.ready.swap(0, Ordering::Relaxed) | std::mem::take(&mut due);
            if round == 0 {
                poll_none();
                return;
            }
            while round != 0 {
                let place = round.trailing_zeros() as usize;
                round &= round - 1;
                if let Some(task) = self.tasks.get_mut(place).filter(|task| !task.ended) {
                    poll_place(place, task.waker.data());
                    let polled = task.future.as_mut().poll(&mut Context::from_waker(&task.waker));
                    task.ended = polled.is_ready();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::{Cell, RefCell};
    use std::future::poll_fn;
    use std::rc::Rc;
    use std::task::Poll;

    use embassy_time::{Duration, Instant, Timer};

    use super::*;
    use crate::board::time::VirtualTime;

    /// A task that records its name at each poll, wakes itself in between, and ends after `polls` polls.
    fn noting(notes: &Rc<RefCell<String>>, name: char, polls: usize) -> impl Future<Output = ()> + 'static {
        let notes = notes.clone();
        let mut left = polls;
        poll_fn(move |context| {
            notes.borrow_mut().push(name);
            left -= 1;
            if left == 0 {
                return Poll::Ready(());
            }
            context.waker().wake_by_ref();
            Poll::Pending
        })
    }

    #[test]
    fn tasks_run_in_rounds_in_the_order_of_their_start_and_end_once() {
        let notes = Rc::default();
        let mut executor = Executor::default();
        for (name, polls) in [('a', 3), ('b', 1), ('c', 2)] {
            executor.spawn(noting(&notes, name, polls)).expect("room");
        }
        executor.run_until_stalled(0);
        assert_eq!(*notes.borrow(), "abcaca");
        executor.run_until_stalled(0);
        assert_eq!(*notes.borrow(), "abcaca");
    }

    #[test]
    fn a_task_that_waits_is_polled_again_only_when_woken() {
        let (polls, kept) = (Rc::new(RefCell::new(0)), Rc::new(RefCell::new(None::<Waker>)));
        let mut executor = Executor::default();
        let (counted, keeper) = (polls.clone(), kept.clone());
        executor
            .spawn(poll_fn(move |context| {
                *counted.borrow_mut() += 1;
                *keeper.borrow_mut() = Some(context.waker().clone());
                Poll::Pending
            }))
            .expect("room");
        executor.run_until_stalled(0);
        executor.run_until_stalled(0);
        assert_eq!(*polls.borrow(), 1);
        kept.borrow_mut().take().expect("polled").wake();
        executor.run_until_stalled(0);
        assert_eq!(*polls.borrow(), 2);
    }

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
        executor.run_until_stalled(time.take_due());
        assert_eq!(time.next_us(), 1500);
        time.advance_to(1499);
        assert_eq!(time.next_us(), 1500);
        executor.run_until_stalled(time.take_due());
        assert_eq!(fired.get(), None);
        time.advance_to(1500);
        executor.run_until_stalled(time.take_due());
        assert_eq!(fired.get(), Some(1500));
        assert_eq!(time.next_us(), u64::MAX);
    }

    #[test]
    fn there_is_room_for_sixty_four_tasks() {
        let mut executor = Executor::default();
        for _ in 0..TASKS_MAX {
            assert_eq!(executor.spawn(async {}), Ok(()));
        }
        assert_eq!(executor.spawn(async {}), Err(TooManyTasks));
        executor.run_until_stalled(0);
    }
}
