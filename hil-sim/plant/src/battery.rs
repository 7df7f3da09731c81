//! The battery that the motors share.

use crate::motor::{BridgeState, DcMotor, MotorSpan};

/// A battery: a voltage behind a resistance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Battery {
    /// Voltage without load, in V.
    pub open_circuit_v: f64,
    /// Internal resistance in Ohm.
    pub resistance_ohm: f64,
    /// Current of the other consumers, in A: the board and its sensors.
    pub idle_a: f64,
}

impl Battery {
    /// Terminal voltage over a span, for which the motors are prepared, under the currents of `motors` with these `bridges` at
    /// the joints' `rates`. Voltage and currents are solved together, so regeneration and sag are stable for
    /// any resistance. `last_v` is the voltage of the previous substep.
    // Each substep and each look-ahead calls this function once; inlined, its arguments stay in registers.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    pub fn terminal_v<const N: usize>(
        &self,
        span: MotorSpan,
        last_v: f64,
        motors: &[DcMotor; N],
        bridges: &[BridgeState; N],
        rates: &[f64; N],
    ) -> f64 {
        let mut current = self.idle_a;
        let mut conductance = 0.0;
        for ((motor, &bridge), &rate) in motors.iter().zip(bridges).zip(rates) {
            let (a, b) = motor.battery_load(span, bridge, last_v, rate);
            current += a;
            conductance += b;
        }
        let r = self.resistance_ohm;
        (self.open_circuit_v - r * current) / (1.0 + r * conductance)
    }
}
