//! The effects of a scenario's steps on a running plant.

use model::sample::MOTORS;

use crate::analog::AnalogFault;
use crate::body::{Payload, Push};
use crate::imu::imperfection::Vibration;
use crate::wiring::{DeadHalf, Leads, Wiring};
use crate::{IDLE_A, Plant};

impl Plant {
    /// Puts chocks to the wheels (a hand on the rims) or takes them away.
    pub fn set_chocked(&mut self, chocked: bool) {
        self.body.set_chocked(chocked);
    }

    /// Seizes a wheel (left 0, right 1) against the arm, or frees it.
    pub fn set_jammed(&mut self, wheel: usize, jammed: bool) {
        self.body.set_jammed(wheel, jammed);
    }

    /// Puts the axle on a stand with the wheels off the ground, or back on the ground.
    pub fn set_on_stand(&mut self, on_stand: bool) {
        self.body.set_on_stand(&self.ground, on_stand);
    }

    /// Fixes a payload to the arm in place of the present payload; mass 0 removes the payload.
    pub fn set_payload(&mut self, payload: Payload) {
        self.body.set_payload(payload);
    }

    /// Pushes for `for_s` seconds. The push replaces a push that still acts.
    pub fn push(&mut self, push: Push, for_s: f64) {
        self.body.set_push(Some(push));
        // Half a nanosecond of slack, because the sum of the steps is rounded.
        self.push_until_s = self.time_s + for_s - 5e-10;
    }

    /// Ends the present push.
    pub(super) fn end_push(&mut self) {
        self.body.set_push(None);
        self.push_until_s = f64::INFINITY;
    }

    /// Makes the analogue sensor of an input fail, or repairs it. `input` is the input's name in
    /// [`model::analog::Analog`].
    pub fn set_analog_fault(&mut self, input: &str, fault: AnalogFault) {
        self.analog.set_fault(input, fault);
    }

    /// Makes the encoder of motor `index` lose a share of its edges.
    pub fn set_edge_loss(&mut self, index: usize, share: f64) {
        if let Some(encoder) = self.encoders.get_mut(index) {
            encoder.set_edge_loss(share);
        }
    }

    /// Breaks, shorts, exchanges or repairs the leads of motor `index`.
    pub fn set_leads(&mut self, index: usize, leads: Leads) {
        self.rewire(|wiring| {
            if let Some(slot) = wiring.leads.get_mut(index) {
                *slot = leads;
            }
        });
    }

    /// Disables half of the bridge of motor `index`, or repairs the bridge.
    pub fn set_dead_half(&mut self, index: usize, dead: DeadHalf) {
        self.rewire(|wiring| {
            if let Some(slot) = wiring.dead.get_mut(index) {
                *slot = dead;
            }
        });
    }

    /// Changes the wiring.
    pub(super) fn rewire(&mut self, change: impl FnOnce(&mut Wiring)) {
        change(&mut self.wiring);
        self.wiring_is_faulty = self.wiring.faulty();
    }

    /// Sets the battery's open-circuit voltage from now on, whatever its charge.
    pub fn set_open_circuit_v(&mut self, volts: f64) {
        self.supply.set_open_circuit_v(volts, &mut self.battery);
    }

    /// Opens the battery's contact, or closes it.
    pub fn set_battery_connected(&mut self, connected: bool) {
        let was = self.supply.connected();
        self.supply.set_connected(connected, &mut self.battery);
        self.rewire(|wiring| wiring.unsupplied = !connected);
        if connected && !was {
            self.battery_v = self.battery.open_circuit_v - self.battery.resistance_ohm * IDLE_A;
        } else if !connected {
            (self.battery_v, self.battery_a) = (0.0, 0.0);
        }
    }

    /// Whether the supply is enough for the board to run; below, it is held in reset.
    pub fn powers_board(&self) -> bool {
        self.supply.powers_board(self.battery_v)
    }

    /// Brings both IMUs to the temperature `to_c` within `over_s` seconds.
    pub fn heat(&mut self, to_c: f64, over_s: f64) {
        for imu in [&mut self.arm_imu, &mut self.spar_imu] {
            imu.heat(to_c, over_s);
        }
    }

    /// Shakes both IMUs from now on.
    pub fn shake(&mut self, vibration: &Vibration) {
        for imu in [&mut self.arm_imu, &mut self.spar_imu] {
            imu.sensor_mut().shake(vibration);
        }
    }

    /// Whether a bridge has shut itself down because it is too hot. Such a bridge asserts its
    /// fault output.
    #[inline]
    pub fn bridge_shut_down(&self) -> bool {
        self.bridge_heat.any_shut()
    }

    /// Currents through the bridges, which the board's sensors measure.
    pub fn bridge_current_a(&self) -> [f64; MOTORS] {
        let currents_a =
            core::array::from_fn(|i| self.motors.get(i).map_or(0.0, crate::motor::DcMotor::bridge_current_a));
        self.wiring.seen_by_bridges(currents_a)
    }
}

#[cfg(test)]
mod tests;
