//! The turn of a motor's joint from its encoder, and from its voltage and current.
//!
//! The voltage minus the resistance's drop is the back-EMF, so a joint turns by the integral of the back-EMF divided by the
//! motor constant, whatever its load.

use core::f64::consts::TAU;

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use model::control::motor::DUTY_FULL_SCALE;
use model::sample::Motor;
use model::vehicle::MotorParameters;

/// Turn of a joint, rad.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct JointTurn {
    /// By the encoder.
    pub(super) counted: f64,
    /// By the motor's voltage and current.
    pub(super) by_voltage: f64,
}

/// A motor as the step sees it, at its gearbox's output.
#[derive(Debug)]
pub(super) struct JointMotor {
    pub(super) counts_per_rad: f64,
    pub(super) back_emf_v_s_per_rad: f64,
    pub(super) resistance_ohm: f64,
    /// What the current sensor shows without a current, A.
    zero_a: f64,
}

impl JointMotor {
    /// A motor, whose current sensor shows `zero_a` without a current.
    pub(super) fn new(motor: &MotorParameters<f32>, zero_a: f64) -> Self {
        let gear = f64::from(motor.gear_ratio);
        Self {
            counts_per_rad: f64::from(motor.encoder_counts_per_rev) * gear / TAU,
            back_emf_v_s_per_rad: f64::from(motor.back_emf_constant_v_s_per_rad) * gear,
            resistance_ohm: f64::from(motor.resistance_ohm),
            zero_a,
        }
    }

    /// Adds the turn of `motor` from one tick to the next one.
    pub(super) fn add(&self, turn: &mut JointTurn, motor: Motor, before: &FlightRecord, tick: &FlightRecord) {
        let index = motor as usize;
        let dt_s = tick.sample.time_us.saturating_sub(before.sample.time_us) as f64 * 1e-6;
        let analog = tick.sample.analog.with(&SCALES.analog, |raw, scale| scale.value(raw));
        // The previous tick's decision acts until this tick.
        let share = f64::from(before.actuation.duty[index]) / f64::from(DUTY_FULL_SCALE);
        let drop_v = self.resistance_ohm * (f64::from(analog.currents()[index]) - self.zero_a);
        let back_emf_v = share * f64::from(analog.battery_voltage) - drop_v;
        turn.by_voltage += back_emf_v / self.back_emf_v_s_per_rad * dt_s;
        let counts = tick.sample.encoder_counts[index].wrapping_sub(before.sample.encoder_counts[index]);
        turn.counted += counts as f64 / self.counts_per_rad;
    }
}
