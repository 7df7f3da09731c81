//! Tells which of a motor's parts is to blame for what its watch has found.
//!
//! The other wheel and the gyro bear a working encoder out. A motor whose lead is open has no torque: its wheel falls
//! behind, or steering turns the two motors against each other. Behind a dead current sensor everything goes on as before.

use super::MotorWatch;
use super::follower::CurrentResponse;
use super::reading::{MotorReading, OPEN_CURRENT_SHARE};
use crate::sample::MOTORS;

/// The findings about a motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(clippy::struct_excessive_bools)] // Independent findings, not the states of one thing.
pub struct MotorHealth {
    /// The encoder jumped, or is the one of three that contradicts the other two.
    pub encoder: bool,
    /// The current sensor does not follow the current, or is the one of three that contradicts the other two.
    pub current_sensor: bool,
    /// The current sensor showed a current while the bridge was last open.
    pub current_offset: bool,
    /// No current follows the voltage, however large it grows: a lead is open.
    pub open: bool,
}

/// What the other drive motor and the gyro show of a motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Witness {
    /// How far the motor's rate is from the one that they show, rad/s, either way.
    pub(super) apart_rad_s: f32,
    /// Voltage across the other motor's armature, V: the share of the applied voltage that drives current.
    pub(super) other_v: f32,
}

/// An encoder that misses a rate differs by that rate from what the other wheel and the gyro show. They confirm the
/// encoder if its rate differs from theirs by less than this share of the rate that voltage and current show to be missing, plus
/// this back-EMF, V: three times the noise of the wheels' rates and of the gyro.
const BORNE_OUT_SHARE: f32 = 0.5;
const BORNE_OUT_V: f32 = 0.03;
/// Ticks without a response after which a current counts as dead although the motor works against the other, as one with
/// an open lead does: by then the lead has shown.
const DEAD_ALONE_TICKS: u16 = 400;
/// Rate by which an output without torque has then fallen behind the voltage, rad/s. With 0.4 of the current limit missing
/// it takes some 20 ms; behind a dead current sensor the motor has its torque, and a standing vehicle remains at rest.
const OPEN_BEHIND_RAD_S: f32 = 0.1;
/// Share of its voltage by which a motor without torque differs from the other motor: steering holds the heading against
/// the torque of the other motor, and neither turns the vehicle. The two motors of a vehicle that stands or drives straight
/// on share their work.
const OPEN_ALONE_SHARE: f32 = 0.5;

impl MotorWatch {
    /// Whether the encoder has begun to contradict voltage and current.
    fn is_doubted(&self) -> bool {
        self.contradicted.is_raised() || self.silent.is_raised()
    }

    /// Returns the part that is to blame for the signs of this tick's `reading`, judged by the witness if there is one;
    /// nothing unless the tick has shown something `wrong`.
    // Out of line: three copies would take flash.
    #[inline(never)]
    pub(super) fn health(&mut self, wrong: bool, reading: &MotorReading, witness: Option<Witness>) -> MotorHealth {
        if !wrong {
            return MotorHealth::default();
        }
        let signs = self.signs;
        let mut health = MotorHealth {
            encoder: signs.jumped,
            current_sensor: false,
            current_offset: signs.current_offset,
            open: false,
        };
        let MotorReading {
            applied_v,
            applied_shares,
            current_a,
            rate_rad_s,
            ..
        } = *reading;
        if let Some(voltage_v) = applied_v.filter(|_| !self.sensor_failed) {
            let voltage_v = self.likely_v(voltage_v, applied_shares, current_a, rate_rad_s);
            let missed_v = self.limits.residual_v(voltage_v, current_a, rate_rad_s).abs();
            let borne_out = witness.map(|witness| {
                self.limits.back_emf_v(witness.apart_rad_s).abs() < BORNE_OUT_SHARE * missed_v + BORNE_OUT_V
            });
            let driving_v = voltage_v - self.limits.back_emf_v(rate_rad_s);
            let much_v = driving_v.abs();
            let behind = (self.fed_rad_s - rate_rad_s) * driving_v > OPEN_BEHIND_RAD_S * much_v;
            let alone = witness.is_some_and(|witness| (driving_v - witness.other_v).abs() > OPEN_ALONE_SHARE * much_v);
            health.open = signs.starved && (behind || alone) && borne_out != Some(false);
            let idle = self.follower.answer() != CurrentResponse::Follows
                && self.limits.drop_v(current_a).abs() < OPEN_CURRENT_SHARE * much_v;
            health.current_sensor =
                signs.unanswered && !health.open && (!(idle && alone) || self.unanswered.lasts(DEAD_ALONE_TICKS));
            if signs.contradict {
                match borne_out {
                    Some(true) => health.current_sensor |= !health.open,
                    Some(false) => health.encoder = true,
                    // Where nothing else shows the rate, a motor without current says nothing of its encoder: a lead may be
                    // open.
                    None => health.encoder |= !idle,
                }
            }
        }
        self.sensor_failed |= health.current_sensor;
        health
    }

    /// The voltage across the armature in this tick's `reading`, V; 0 at an open bridge.
    // Out of line: two copies would take flash.
    #[inline(never)]
    fn driving_v(&self, reading: &MotorReading) -> f32 {
        let MotorReading {
            applied_shares,
            current_a,
            rate_rad_s,
            ..
        } = *reading;
        reading.applied_v.map_or(0.0, |voltage_v| {
            self.likely_v(voltage_v, applied_shares, current_a, rate_rad_s) - self.limits.back_emf_v(rate_rad_s)
        })
    }
}

/// Tells which parts of the left, right and ballast motors are to blame, of those that showed something `wrong` in this
/// tick. `yaw_rad_s` is what the gyro shows of the difference of the wheels' rates, right less left.
// Out of line: signs are rare.
#[cold]
#[inline(never)]
pub fn healths(
    watches: &mut [MotorWatch; MOTORS],
    wrong: [bool; MOTORS],
    readings: &[MotorReading; MOTORS],
    yaw_rad_s: f32,
) -> [MotorHealth; MOTORS] {
    let [left_watch, right_watch, ballast_watch] = watches;
    let [left, right, ballast] = readings;
    let apart_rad_s = right.rate_rad_s - left.rate_rad_s - yaw_rad_s;
    // Of two encoders that are both doubted neither tells of the other.
    let tells = !(left_watch.is_doubted() && right_watch.is_doubted());
    let witness = |other_v| tells.then_some(Witness { apart_rad_s, other_v });
    let of_left = witness(right_watch.driving_v(right));
    let of_right = witness(left_watch.driving_v(left));
    let [left_wrong, right_wrong, ballast_wrong] = wrong;
    [
        left_watch.health(left_wrong, left, of_left),
        right_watch.health(right_wrong, right, of_right),
        // No other sensor shows how the ballast turns.
        ballast_watch.health(ballast_wrong, ballast, None),
    ]
}
