//! The arming state machine: it derives the mode from time and conditions.

use super::codes::{Blocker, BlockerSet, Fault, FaultSet};
use crate::command::Request;

/// The vehicle's mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum Mode {
    /// Every bridge open.
    #[default]
    Disarmed = 0,
    /// Driving as commanded.
    Armed = 1,
    /// A controlled stop on the way to [`Mode::Disarmed`].
    Stopping = 2,
}

impl Mode {
    /// The mode's name, as logs and tools print it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Disarmed => "disarmed",
            Self::Armed => "armed",
            Self::Stopping => "stopping",
        }
    }
}

/// Input of the state machine in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Conditions {
    /// Faults whose cause is present in this tick.
    pub faults: FaultSet,
    /// Blockers present in this tick; the state machine adds [`Blocker::FaultLatched`].
    pub blockers: BlockerSet,
    /// The operator's request.
    pub request: Request,
    /// Whether the vehicle is stopped. A controlled stop ends once this has lasted.
    pub stopped: bool,
}

/// The arming state machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Arming {
    mode: Mode,
    latched: FaultSet,
    blockers: BlockerSet,
    stopping_ticks: u32,
    stopped_ticks: u32,
    stop_timeout_ticks: u32,
    refused: u32,
}

/// Consecutive ticks for which the vehicle must be stopped before a controlled stop ends.
const STOPPED_TICKS: u32 = 300;

impl Arming {
    /// Disarmed, with every blocker set.
    pub fn new(stop_timeout_ticks: u32) -> Self {
        Self {
            mode: Mode::Disarmed,
            latched: FaultSet::EMPTY,
            blockers: BlockerSet::FULL,
            stopping_ticks: 0,
            stopped_ticks: 0,
            stop_timeout_ticks,
            refused: 0,
        }
    }

    /// The same state with another time after which the machine gives up a controlled stop.
    pub fn with_stop_timeout(self, stop_timeout_ticks: u32) -> Self {
        Self {
            stop_timeout_ticks,
            ..self
        }
    }

    /// One tick.
    pub fn step(&mut self, conditions: &Conditions) -> Mode {
        let Conditions {
            faults,
            request,
            stopped,
            ..
        } = *conditions;
        if self.mode != Mode::Disarmed {
            // A fault that occurs while the bridges are on stays latched until the operator clears it.
            self.latched = self.latched.union(faults);
        }
        self.blockers = conditions.blockers;
        // Spar faults leave the vehicle drivable.
        let blocking = self.latched.bits() & !FaultSet::SPAR.bits() != 0;
        self.blockers.set(Blocker::FaultLatched, blocking);

        self.mode = match self.mode {
            Mode::Disarmed => self.disarmed(request),
            _ if request == Request::Disarm || faults.has_any(FaultSet::OPENING) => Mode::Disarmed,
            Mode::Armed if faults.has_any(FaultSet::STOPPING) => self.begin_stop(),
            Mode::Armed => Mode::Armed,
            Mode::Stopping => self.stopping(stopped),
        };
        self.mode
    }

    fn disarmed(&mut self, request: Request) -> Mode {
        match request {
            Request::Arm if self.blockers.is_empty() => {
                // Arming clears the spar faults of the last drive.
                self.latched = FaultSet::EMPTY;
                Mode::Armed
            }
            Request::Arm => {
                self.refused = self.refused.wrapping_add(1);
                Mode::Disarmed
            }
            Request::ClearFaults => {
                self.latched = FaultSet::EMPTY;
                Mode::Disarmed
            }
            Request::None | Request::Disarm => Mode::Disarmed,
        }
    }

    fn begin_stop(&mut self) -> Mode {
        self.stopping_ticks = 0;
        self.stopped_ticks = 0;
        Mode::Stopping
    }

    fn stopping(&mut self, stopped: bool) -> Mode {
        self.stopping_ticks = self.stopping_ticks.saturating_add(1);
        self.stopped_ticks = if stopped {
            self.stopped_ticks.saturating_add(1)
        } else {
            0
        };
        if self.stopped_ticks >= STOPPED_TICKS {
            Mode::Disarmed
        } else if self.stopping_ticks >= self.stop_timeout_ticks {
            self.latched.insert(Fault::StopTimeout);
            Mode::Disarmed
        } else {
            Mode::Stopping
        }
    }

    /// The present mode.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Begins a controlled stop for a fault that the control laws found, and latches it; no effect unless armed.
    pub fn stop(&mut self, fault: Fault) {
        if self.mode == Mode::Armed {
            self.latched.insert(fault);
            self.mode = self.begin_stop();
        }
    }

    /// Opens the bridges for a fault that was found after the decision, and latches it.
    pub fn trip(&mut self, fault: Fault) {
        if self.mode != Mode::Disarmed {
            self.latched.insert(fault);
        }
        self.mode = Mode::Disarmed;
    }

    /// Faults that have been latched since the operator last cleared them.
    pub fn latched(&self) -> FaultSet {
        self.latched
    }

    /// Blockers of the last tick.
    pub fn blockers(&self) -> BlockerSet {
        self.blockers
    }

    /// Number of refused requests to arm.
    pub fn refused(&self) -> u32 {
        self.refused
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const CLEAR: Conditions = Conditions {
        faults: FaultSet::EMPTY,
        blockers: BlockerSet::EMPTY,
        request: Request::None,
        stopped: true,
    };
    const MOVING: Conditions = Conditions {
        stopped: false,
        ..CLEAR
    };

    fn armed() -> Arming {
        let mut arming = Arming::new(1000);
        assert_eq!(
            arming.step(&Conditions {
                request: Request::Arm,
                ..CLEAR
            }),
            Mode::Armed
        );
        arming
    }

    fn fault(fault: Fault) -> Conditions {
        let mut faults = FaultSet::EMPTY;
        faults.insert(fault);
        Conditions { faults, ..CLEAR }
    }

    #[test]
    fn it_boots_disarmed_with_every_blocker() {
        let arming = Arming::new(1000);
        assert_eq!(arming.mode(), Mode::Disarmed);
        assert_eq!(arming.blockers(), BlockerSet::FULL);
    }

    #[test]
    fn each_mode_has_its_name() {
        let names = [Mode::Disarmed, Mode::Armed, Mode::Stopping].map(Mode::name);
        assert_eq!(names, ["disarmed", "armed", "stopping"]);
    }

    #[test]
    fn another_stop_timeout_changes_nothing_else() {
        let mut arming = armed();
        arming.step(&fault(Fault::Overcurrent));
        arming.step(&Conditions {
            request: Request::Arm,
            ..CLEAR
        });
        assert_eq!((arming.latched().is_empty(), arming.refused()), (false, 1));
        let mut shorter = arming.with_stop_timeout(5);
        assert_eq!(shorter.with_stop_timeout(1000), arming);
        // The new time applies.
        shorter.step(&Conditions {
            request: Request::ClearFaults,
            ..CLEAR
        });
        let moving = |faults| Conditions {
            faults,
            stopped: false,
            ..CLEAR
        };
        shorter.step(&Conditions {
            request: Request::Arm,
            ..CLEAR
        });
        shorter.step(&moving(fault(Fault::CommandTimeout).faults));
        let ticks = (0..).take_while(|_| shorter.step(&moving(FaultSet::EMPTY)) == Mode::Stopping);
        assert_eq!(ticks.count(), 4);
        assert!(shorter.latched().contains(Fault::StopTimeout));
    }

    #[test]
    fn each_single_blocker_refuses_arming() {
        for blocker in Blocker::ALL.iter().copied().filter(|b| *b != Blocker::FaultLatched) {
            let mut arming = Arming::new(1000);
            let mut blockers = BlockerSet::EMPTY;
            blockers.insert(blocker);
            let mode = arming.step(&Conditions {
                blockers,
                request: Request::Arm,
                ..CLEAR
            });
            assert_eq!((mode, arming.refused()), (Mode::Disarmed, 1), "{}", blocker.name());
        }
    }

    #[test]
    fn every_refused_request_counts_and_an_accepted_one_does_not() {
        let mut arming = armed();
        assert_eq!(arming.refused(), 0);
        arming.step(&fault(Fault::Overcurrent));
        for refused in 1..=3 {
            for request in [Request::None, Request::Disarm, Request::Arm] {
                arming.step(&Conditions { request, ..CLEAR });
            }
            assert_eq!(arming.refused(), refused);
        }
    }

    #[test]
    fn every_fault_ends_as_its_class_says_and_blocks_until_cleared() {
        for code in Fault::ALL.iter().copied() {
            let mut arming = armed();
            let mode = arming.step(&fault(code));
            let mut only = FaultSet::EMPTY;
            only.insert(code);
            let expected = if only.has_any(FaultSet::SPAR) {
                Mode::Armed
            } else if only.has_any(FaultSet::STOPPING) {
                Mode::Stopping
            } else {
                Mode::Disarmed
            };
            assert_eq!(mode, expected, "{}", code.name());
            assert!(arming.latched().contains(code));
            if mode == Mode::Disarmed {
                assert_eq!(
                    arming.step(&Conditions {
                        request: Request::Arm,
                        ..CLEAR
                    }),
                    Mode::Disarmed
                );
                arming.step(&Conditions {
                    request: Request::ClearFaults,
                    ..CLEAR
                });
                assert_eq!(
                    arming.step(&Conditions {
                        request: Request::Arm,
                        ..CLEAR
                    }),
                    Mode::Armed
                );
            }
        }
    }

    #[test]
    fn a_stop_for_what_the_laws_found_begins_while_armed_only_and_once() {
        let mut arming = armed();
        arming.stop(Fault::SteepSlope);
        assert_eq!(arming.mode(), Mode::Stopping);
        assert!(arming.latched().contains(Fault::SteepSlope));
        // A repeated stop request does not prolong the stop.
        let ticks = (1..10_000).find(|_| {
            arming.stop(Fault::SteepSlope);
            arming.step(&CLEAR) == Mode::Disarmed
        });
        assert_eq!(ticks, Some(STOPPED_TICKS));
        let mut disarmed = Arming::new(1000);
        disarmed.stop(Fault::SteepSlope);
        assert_eq!((disarmed.mode(), disarmed.latched()), (Mode::Disarmed, FaultSet::EMPTY));
    }

    #[test]
    fn a_stop_ends_stopped_or_in_time() {
        let mut arming = armed();
        arming.step(&fault(Fault::CommandTimeout));
        let ticks = (1..10_000)
            .find(|_| arming.step(&CLEAR) == Mode::Disarmed)
            .expect("ends");
        assert_eq!(ticks, STOPPED_TICKS);
        let mut arming = armed();
        arming.step(&fault(Fault::CommandTimeout));
        let ticks = (1..10_000)
            .find(|_| arming.step(&MOVING) == Mode::Disarmed)
            .expect("ends");
        assert_eq!(ticks, 1000);
        assert!(arming.latched().contains(Fault::StopTimeout));
    }

    proptest! {
        /// For any input, the mode leaves Disarmed only by an Arm request with no blocker and no latched fault,
        /// and an opening fault or a Disarm request always ends in Disarmed at once.
        #[test]
        fn only_an_unblocked_request_arms(
            steps in proptest::collection::vec((any::<u32>(), any::<u32>(), proptest::sample::select(Request::ALL), any::<bool>(), any::<bool>()), 1..200)
        ) {
            let mut arming = Arming::new(50);
            for (faults, blockers, request, stopped, clean) in steps {
                let before = arming;
                let conditions = Conditions {
                    faults: if clean { FaultSet::EMPTY } else { FaultSet::from_bits(faults) },
                    blockers: if clean { BlockerSet::EMPTY } else { BlockerSet::from_bits(blockers) },
                    request,
                    stopped,
                };
                let mode = arming.step(&conditions);
                if before.mode() == Mode::Disarmed && mode != Mode::Disarmed {
                    prop_assert_eq!(conditions.request, Request::Arm);
                    let blocked = conditions.blockers.bits() & !(1 << Blocker::FaultLatched as u8);
                    prop_assert_eq!(blocked, 0);
                    prop_assert_eq!(before.latched().bits() & !FaultSet::SPAR.bits(), 0);
                }
                if before.mode() != Mode::Disarmed
                    && (conditions.request == Request::Disarm
                        || conditions.faults.has_any(FaultSet::OPENING))
                {
                    prop_assert_eq!(mode, Mode::Disarmed);
                }
            }
        }
    }
}
