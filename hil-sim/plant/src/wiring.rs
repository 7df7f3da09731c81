//! Faults between the board's bridges and its motors: broken and shorted leads, dead half-bridges, bridges that have shut
//! themselves down.

use model::sample::MOTORS;
use serde::Deserialize;

use crate::motor::BridgeState;

/// A motor's two leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Leads {
    /// Sound.
    #[default]
    Sound,
    /// One is broken.
    Open,
    /// They touch each other.
    Shorted,
}

/// A bridge that drives one way only: the high side of one leg is dead. For the driven share of each period it is open, and
/// so it is here for the whole of it: the little that a turning motor brakes in the other share goes out through the diodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeadHalf {
    /// Drives both ways.
    #[default]
    None,
    /// Does not drive forward.
    Forward,
    /// Does not drive backward.
    Backward,
}

/// The wiring of every motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Wiring {
    pub(crate) leads: [Leads; MOTORS],
    pub(crate) dead: [DeadHalf; MOTORS],
    /// Bridges that are too hot: they are open, whatever their inputs say.
    pub(crate) shut_down: [bool; MOTORS],
    /// The battery is off: nothing flows anywhere.
    pub(crate) unsupplied: bool,
}

impl Wiring {
    /// Whether anything is wrong.
    #[inline]
    pub(crate) fn faulty(self) -> bool {
        self != Self::default()
    }

    /// What arrives at the motors of what the bridges do.
    pub(crate) fn through(self, bridges: &[BridgeState; MOTORS]) -> [BridgeState; MOTORS] {
        let mut arrives = *bridges;
        let faults = self.leads.into_iter().zip(self.dead).zip(self.shut_down);
        for (state, ((leads, dead), shut_down)) in arrives.iter_mut().zip(faults) {
            if let BridgeState::Duty(duty) = *state {
                let dies = match dead {
                    DeadHalf::None => false,
                    DeadHalf::Forward => duty > 0.0,
                    DeadHalf::Backward => duty < 0.0,
                };
                if dies || shut_down {
                    *state = BridgeState::Open;
                }
            }
            let duty = match *state {
                BridgeState::Duty(duty) => duty,
                _ => 0.0,
            };
            *state = match leads {
                _ if self.unsupplied => BridgeState::Disconnected,
                Leads::Sound => *state,
                Leads::Open => BridgeState::Disconnected,
                Leads::Shorted => BridgeState::Shorted(duty),
            };
        }
        arrives
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use BridgeState::{Disconnected, Duty, Open, Shorted};

    #[test]
    fn each_fault_lets_through_what_it_must() {
        let bridges = [Duty(0.4), Duty(-0.4), Open];
        let mut wiring = Wiring::default();
        assert_eq!(wiring.through(&bridges), bridges);
        wiring.dead = [DeadHalf::Forward, DeadHalf::Forward, DeadHalf::Backward];
        assert_eq!(wiring.through(&bridges), [Open, Duty(-0.4), Open]);
        wiring.dead = [DeadHalf::None; MOTORS];
        wiring.shut_down = [false, true, false];
        assert_eq!(wiring.through(&bridges), [Duty(0.4), Open, Open]);
        wiring.shut_down = [false; MOTORS];
        wiring.dead = [DeadHalf::Backward; MOTORS];
        assert_eq!(wiring.through(&bridges), [Duty(0.4), Open, Open]);
        wiring.leads = [Leads::Shorted, Leads::Shorted, Leads::Open];
        assert_eq!(wiring.through(&bridges), [Shorted(0.4), Shorted(0.0), Disconnected]);
        wiring.unsupplied = true;
        assert_eq!(wiring.through(&bridges), [Disconnected; MOTORS]);
    }
}
