//! Checks one motor's encoder, current sensor and leads against each other and against the applied voltage.
//!
//! The armature equation `V = R i + k w` relates voltage, current and rate, so it shows that one of the three is wrong,
//! but not which. The response of the current to the voltage shows which. The laws change the voltage by some hundredths
//! of a volt in every tick, and a measured current follows within a fraction of a tick, whatever the motor's constants,
//! temperature and load. The reading of a dead or stuck sensor, or of a motor with an open lead, does not follow.
//!
//! A voltage that rests, as at hold or at a limit, has no response. Then motion tells the three apart (`motor_watch/blame.rs`).

use super::plausibility::Suspicion;
use crate::bounded::Bounded;
use crate::control::motor::MotorLimits;
use crate::estimate::rate_filter::LowPass;
use crate::persistence::Persistence;
use crate::sample::TICK_S;
use crate::vehicle::MotorParameters;

mod blame;
mod follower;
mod reading;
mod silence;

pub use blame::{MotorHealth, healths};
use follower::{CurrentResponse, Follower};
pub use reading::MotorReading;
use reading::{OPEN_CURRENT_SHARE, RESIDUAL_TICKS};
use silence::Silence;

/// What one tick shows of a motor, before [`healths`] has told which part is to blame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(clippy::struct_excessive_bools)] // Independent signs, not the states of one thing.
struct MotorSigns {
    /// The encoder advanced farther than the motor can turn.
    jumped: bool,
    /// Voltage, current and encoder contradict each other, for long enough.
    contradict: bool,
    /// The measured current does not follow the voltage, for long enough.
    unanswered: bool,
    /// The voltage should drive much current and hardly any is measured, for long enough.
    starved: bool,
    /// The current sensor showed a current while the bridge was last open.
    current_offset: bool,
}

impl MotorSigns {
    /// Whether nothing is wrong.
    #[inline]
    fn is_sound(self) -> bool {
        !(self.jumped | self.contradict | self.unanswered | self.starved | self.current_offset)
    }
}

/// Watches one motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorWatch {
    limits: MotorLimits,
    /// Least current that the voltage should drive for its absence to mean an open lead, A.
    open_from_a: f32,
    rad_s_per_v: f32,
    jump_counts: u32,
    last_count: Option<i32>,
    follower: Follower,
    open_ticks: u16,
    offset_a: LowPass,
    offset_found: bool,
    contradicted: Suspicion,
    silent: Silence,
    unanswered: Persistence,
    starved: Persistence,
    /// Rate of the output when it began to be starved, rad/s.
    fed_rad_s: f32,
    /// The current sensor has failed since the bridge was closed: what it shows is evidence of nothing else.
    sensor_failed: bool,
    /// The signs of the last tick that had any.
    signs: MotorSigns,
}

/// Largest armature voltage, V, that current and back-EMF may leave unexplained while the watch believes the encoder. Two
/// shares add to this bound: one of the resistance drop, because a warm armature's resistance is a third larger, and one
/// of the back-EMF, because the constant varies between motors and falls as the magnets warm.
const RESIDUAL_V: f32 = 0.35;
const RESIDUAL_SHARE: f32 = 0.5;
const BACK_EMF_SHARE: f32 = 0.25;
/// Error of the known back-EMF, V, in addition to a share of the resistance drop: the rest has surely turned the motor.
const SILENT_V: f32 = 0.1;
/// Largest current reading at an open bridge of a believable sensor, A: half a percent of a 60 A sensor's span.
pub const OFFSET_MAX_A: f32 = 0.5;
/// Ticks for which a bridge must have been open before its current must be 0, and the filter of that current.
const OPEN_BRIDGE_TICKS: u16 = 50;
const OFFSET_TIME_CONSTANT_S: f32 = 0.02;
/// Ticks without a response after which a current counts as dead.
const DEAD_TICKS: u16 = 150;
/// A lead may be open if the voltage should drive this share of the current limit but less than [`OPEN_CURRENT_SHARE`] of
/// that current flows.
const OPEN_SHARE: f32 = 0.4;
const OPEN_TICKS: u16 = 100;

impl MotorWatch {
    /// A watch for the motor with these parameters, whose encoder cannot move by more than `jump_counts` in a tick.
    pub fn new(motor: &MotorParameters<f32>, jump_counts: u32) -> Self {
        Self {
            limits: MotorLimits::new(motor),
            open_from_a: OPEN_SHARE * motor.current_limit_a,
            rad_s_per_v: 1.0 / (motor.back_emf_constant_v_s_per_rad * motor.gear_ratio),
            jump_counts,
            last_count: None,
            follower: Follower::new(motor),
            open_ticks: 0,
            offset_a: LowPass::new(TICK_S, OFFSET_TIME_CONSTANT_S),
            offset_found: false,
            contradicted: Suspicion::even(RESIDUAL_TICKS),
            silent: Silence::default(),
            unanswered: Persistence::new(DEAD_TICKS),
            starved: Persistence::new(OPEN_TICKS),
            fed_rad_s: 0.0,
            sensor_failed: false,
            signs: MotorSigns::default(),
        }
    }

    /// Updates the watch with one tick. Returns whether anything is wrong; [`healths`] tells what it is.
    // Inlined like `Supervisor::update_motor`, its only caller.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn update(&mut self, reading: &MotorReading) -> bool {
        let signs = self.signs(reading);
        if signs.is_sound() {
            // Nearly always: the signs need not be kept.
            return false;
        }
        self.signs = signs;
        true
    }

    /// The current sensor showed a current while the bridge was last open.
    pub fn has_current_offset(&self) -> bool {
        self.offset_found
    }

    /// The signs of one tick.
    // Inlined like `update`, its only caller.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    fn signs(&mut self, reading: &MotorReading) -> MotorSigns {
        let MotorReading {
            count,
            applied_v,
            applied_shares,
            current_a,
            rate_rad_s,
        } = *reading;
        let moved = self.last_count.map_or(0, |last| count.wrapping_sub(last));
        self.last_count = Some(count);
        let jumped = moved.unsigned_abs() > self.jump_counts;
        let current_offset = self.offset(applied_v.is_none(), current_a);
        // At an open bridge nothing is shown.
        let [mut contradicts, mut silent, mut dead, mut starved] = [false; 4];
        if let Some(voltage_v) = applied_v {
            let answer = self.follower.update(voltage_v, current_a);
            let voltage_v = self.likely_v(voltage_v, applied_shares, current_a, rate_rad_s);
            let follows = answer == CurrentResponse::Follows;
            // If the current does not respond, the encoder is not the cause.
            contradicts = answer != CurrentResponse::Dead && self.contradicts_encoder(voltage_v, current_a, rate_rad_s);
            let turned_v = self.certainly_turning_v(voltage_v, current_a);
            silent = self.silent.update(count) && turned_v > 0.0 && follows && {
                let turned_rad = turned_v * self.rad_s_per_v * TICK_S;
                self.silent
                    .turn(turned_rad.copysign(voltage_v - self.limits.drop_v(current_a)))
            };
            starved = !follows && self.lacks_current(voltage_v, current_a, rate_rad_s);
            if starved && !self.starved.lasts(1) {
                self.fed_rad_s = rate_rad_s;
            }
            dead = answer == CurrentResponse::Dead;
        } else {
            self.follower.reset();
            self.silent = Silence::default();
            self.sensor_failed = false;
        }
        MotorSigns {
            jumped,
            contradict: self.contradicted.update(contradicts) || silent,
            unanswered: self.unanswered.update(dead),
            starved: self.starved.update(starved),
            current_offset,
        }
    }

    /// The voltage applied since the last tick, V: `voltage_v`, or of the voltages that a supply below its minimum may have
    /// given the one that current and encoder explain best. Only what contradicts all of them is a finding.
    #[inline]
    fn likely_v(&self, voltage_v: f32, shares: Option<[f32; 2]>, current_a: f32, rate_rad_s: f32) -> f32 {
        if let Some([one, other]) = shares {
            self.likeliest_v([one * voltage_v, other * voltage_v], current_a, rate_rad_s)
        } else {
            voltage_v
        }
    }

    /// Of the voltages between two, the one that current and encoder explain best, V.
    // Out of line: a supply below its minimum is rare.
    #[cold]
    #[inline(never)]
    fn likeliest_v(&self, [one_v, other_v]: [f32; 2], current_a: f32, rate_rad_s: f32) -> f32 {
        let explained_v = self.limits.drop_v(current_a) + self.limits.back_emf_v(rate_rad_s);
        if one_v < other_v {
            explained_v.bounded(one_v, other_v)
        } else {
            explained_v.bounded(other_v, one_v)
        }
    }

    /// Whether the rate that the encoder shows contradicts voltage and current.
    #[inline]
    fn contradicts_encoder(&self, voltage_v: f32, current_a: f32, rate_rad_s: f32) -> bool {
        let residual_v = self.limits.residual_v(voltage_v, current_a, rate_rad_s).abs();
        if residual_v <= RESIDUAL_V {
            // This is nearly always the case; the other allowances only add to the limit.
            return false;
        }
        let drop_v = self.limits.drop_v(current_a);
        // The larger of the two back-EMFs: from the encoder, and from voltage and current.
        let back_emf_v = self.limits.back_emf_v(rate_rad_s).abs();
        let expected_v = (voltage_v - drop_v).abs();
        let back_emf_v = if expected_v > back_emf_v {
            expected_v
        } else {
            back_emf_v
        };
        residual_v > RESIDUAL_V + RESIDUAL_SHARE * drop_v.abs() + BACK_EMF_SHARE * back_emf_v
    }

    /// The back-EMF that the motor certainly has, either way, V; 0 or less if voltage and current do not show it.
    #[inline]
    fn certainly_turning_v(&self, voltage_v: f32, current_a: f32) -> f32 {
        let drop_v = self.limits.drop_v(current_a);
        (voltage_v - drop_v).abs() - SILENT_V - RESIDUAL_SHARE * drop_v.abs()
    }

    /// Whether the voltage should drive a large current but hardly any current flows.
    #[inline]
    fn lacks_current(&self, voltage_v: f32, current_a: f32, rate_rad_s: f32) -> bool {
        let driving_a = self.limits.current_a(voltage_v, rate_rad_s).abs();
        driving_a > self.open_from_a && current_a.abs() < OPEN_CURRENT_SHARE * driving_a
    }

    /// Whether the sensor showed a current while the bridge was last open for some time.
    fn offset(&mut self, bridge_open: bool, current_a: f32) -> bool {
        if !bridge_open {
            self.open_ticks = 0;
            return self.offset_found;
        }
        self.open_ticks = self.open_ticks.saturating_add(1);
        if self.open_ticks == OPEN_BRIDGE_TICKS {
            self.offset_a.reset(current_a);
        }
        self.offset_a.update(current_a);
        if self.open_ticks > OPEN_BRIDGE_TICKS {
            self.offset_found = self.offset_a.value().abs() > OFFSET_MAX_A;
        }
        self.offset_found
    }
}

#[cfg(test)]
mod tests;
