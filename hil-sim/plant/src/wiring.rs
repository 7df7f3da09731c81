//! Faults between the board's bridges and its motors: broken, shorted and exchanged leads, dead half-bridges, bridges
//! that have shut themselves down.

use model::sample::MOTORS;
use serde::Deserialize;

use crate::motor::BridgeState;

/// A motor's two leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Leads {
    /// Both leads are connected.
    #[default]
    Sound,
    /// One lead is broken.
    Open,
    /// The leads touch each other.
    Shorted,
    /// Each lead is at the other one's place: the motor turns the other way.
    Exchanged,
}

/// A bridge that drives in one direction only, because the high side of one leg is dead. In the dead direction such a
/// bridge is open for the driven share of each period. The model leaves it open for the whole period and neglects the
/// weak braking of a turning motor in the other share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeadHalf {
    /// The bridge drives in both directions.
    #[default]
    None,
    /// The bridge does not drive forward.
    Forward,
    /// The bridge does not drive backward.
    Backward,
}

/// The wiring of every motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Wiring {
    pub(crate) leads: [Leads; MOTORS],
    pub(crate) dead: [DeadHalf; MOTORS],
    /// Bridges that are open because they are too hot, whatever their inputs.
    pub(crate) shut_down: [bool; MOTORS],
    /// The battery is disconnected, so no current flows.
    pub(crate) unsupplied: bool,
}

impl Wiring {
    /// Whether any fault is present.
    pub(crate) fn faulty(self) -> bool {
        self != Self::default()
    }

    /// The motors' currents as their bridges see them.
    #[inline]
    pub(crate) fn seen_by_bridges(self, mut currents_a: [f64; MOTORS]) -> [f64; MOTORS] {
        // Each simulated millisecond asks, and few scenarios touch a lead.
        if self.leads == [Leads::Sound; MOTORS] {
            return currents_a;
        }
        for (current_a, leads) in currents_a.iter_mut().zip(self.leads) {
            if leads == Leads::Exchanged {
                *current_a = -*current_a;
            }
        }
        currents_a
    }

    /// The bridge states that reach the motors through the faulty wiring.
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
                Leads::Exchanged => match *state {
                    BridgeState::Duty(duty) => BridgeState::Duty(-duty),
                    _ => *state,
                },
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
        wiring.leads = [Leads::Exchanged, Leads::Sound, Leads::Exchanged];
        assert_eq!(wiring.through(&bridges), [Duty(-0.4), Open, Open]);
        wiring.unsupplied = true;
        assert_eq!(wiring.through(&bridges), [Disconnected; MOTORS]);
    }
}
