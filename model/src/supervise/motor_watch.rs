//! Checks one motor's encoder, current sensor and leads against each other and against the applied voltage.
//!
//! The armature equation `V = R i + k w` relates voltage, current and rate, so it shows that one of the three is wrong,
//! but not which. The response of the current to the voltage shows which. The laws change the voltage by some hundredths
//! of a volt in every tick, and a measured current follows within a fraction of a tick, whatever the motor's constants,
//! temperature and load. The reading of a dead or stuck sensor, or of a motor with an open lead, does not follow.

use super::plausibility::Suspicion;
use crate::bounded::Bounded;
use crate::control::motor::MotorLimits;
use crate::estimate::rate_filter::LowPass;
use crate::persistence::Persistence;
use crate::sample::TICK_S;
use crate::vehicle::MotorParameters;

/// The readings of a motor in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorReading {
    /// The encoder's count, which wraps.
    pub count: i32,
    /// Voltage applied since the last tick, V; `None` while the bridge is open.
    pub applied_v: Option<f32>,
    /// Least and largest share of `applied_v` that the bridge may have applied; `None` while the supply's reading is
    /// believed, so that the share is 1.
    pub applied_shares: Option<[f32; 2]>,
    /// The measured current, A, halfway between the last tick and this tick.
    pub current_a: f32,
    /// The filtered rate of the output, rad/s.
    pub rate_rad_s: f32,
}

/// The findings about a motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(clippy::struct_excessive_bools)] // Independent findings, not the states of one thing.
pub struct MotorHealth {
    /// The encoder jumped, or contradicts voltage and current.
    pub encoder: bool,
    /// The current sensor does not follow the current.
    pub current_sensor: bool,
    /// The current sensor showed a current while the bridge was last open.
    pub current_offset: bool,
    /// No current follows the voltage, however large it grows: a lead is open.
    pub open: bool,
}

impl MotorHealth {
    /// Whether there is no finding.
    #[inline]
    pub fn is_sound(self) -> bool {
        !(self.encoder | self.current_sensor | self.current_offset | self.open)
    }
}

/// The response of the measured current to the voltage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum CurrentResponse {
    /// The voltage changed too little to decide, or the response lies between the other two.
    Unknown,
    Follows,
    Dead,
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
    dead: Persistence,
    open: Persistence,
}

/// Largest armature voltage, V, that current and back-EMF may leave unexplained while the watch believes the encoder. Two
/// shares add to this bound: one of the resistance drop, because a warm armature's resistance is a third larger, and one
/// of the back-EMF, because the constant varies between motors and falls as the magnets warm.
const RESIDUAL_V: f32 = 0.35;
const RESIDUAL_SHARE: f32 = 0.5;
const BACK_EMF_SHARE: f32 = 0.25;
/// Ticks for which the encoder must contradict: longer than the watch takes to detect a dead current sensor.
/// Contradictions add up, because a loop that is closed through a dead encoder may swing to and fro.
const RESIDUAL_TICKS: u16 = 250;
/// Error of the known back-EMF, V, in addition to a share of the resistance drop; and the angle, rad at the output, by
/// which the remaining back-EMF must have turned the motor while its encoder stays within this many edges, as with one
/// dead line of two. A thousand edges are then missing.
const SILENT_V: f32 = 0.1;
const SILENT_RAD: f32 = 0.1;
const SILENT_COUNTS: u32 = 4;
/// Largest current reading at an open bridge of a believable sensor, A: half a percent of a 60 A sensor's span.
pub const OFFSET_MAX_A: f32 = 0.5;
/// Ticks for which a bridge must have been open before its current must be 0, and the filter of that current.
const OPEN_BRIDGE_TICKS: u16 = 50;
const OFFSET_TIME_CONSTANT_S: f32 = 0.02;
/// Ticks without a response after which a current counts as dead.
const DEAD_TICKS: u16 = 150;
/// A lead is open if the voltage should drive this share of the current limit but less than a tenth of that current
/// flows.
const OPEN_SHARE: f32 = 0.4;
const OPEN_CURRENT_SHARE: f32 = 0.1;
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
            dead: Persistence::new(DEAD_TICKS),
            open: Persistence::new(OPEN_TICKS),
        }
    }

    /// Updates the watch with one tick.
    // Inlined like `Supervisor::motor_health`, its only caller.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn update(&mut self, reading: &MotorReading) -> MotorHealth {
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
        let Some(voltage_v) = applied_v else {
            self.follower.reset();
            self.silent = Silence::default();
            return MotorHealth {
                encoder: self.contradicted.update(false) || jumped,
                current_sensor: self.dead.update(false),
                current_offset,
                open: self.open.update(false),
            };
        };
        let answer = self.follower.update(voltage_v, current_a);
        let voltage_v = applied_shares.map_or(voltage_v, |shares| {
            self.likeliest_v(shares.map(|share| share * voltage_v), current_a, rate_rad_s)
        });
        // If the current does not respond, the encoder is not the cause.
        let contradicts = answer != CurrentResponse::Dead && self.contradicts_encoder(voltage_v, current_a, rate_rad_s);
        let turned_rad = self.certainly_turned_rad(voltage_v, current_a);
        let silent = self.silent.update(count, turned_rad, answer);
        let open = answer != CurrentResponse::Follows && self.lacks_current(voltage_v, current_a, rate_rad_s);
        MotorHealth {
            encoder: self.contradicted.update(contradicts) || silent || jumped,
            current_sensor: self.dead.update(answer == CurrentResponse::Dead),
            current_offset,
            open: self.open.update(open),
        }
    }

    /// Of the voltages that may have been applied, the one that current and encoder explain best, V: only what contradicts
    /// all of them is a finding.
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

    /// The angle by which the motor certainly turned in one tick, according to voltage and current, rad at the output; 0 or
    /// less if they do not show it.
    #[inline]
    fn certainly_turned_rad(&self, voltage_v: f32, current_a: f32) -> f32 {
        let drop_v = self.limits.drop_v(current_a);
        let certain_v = (voltage_v - drop_v).abs() - SILENT_V - RESIDUAL_SHARE * drop_v.abs();
        certain_v * self.rad_s_per_v * TICK_S
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

/// Angle by which the motor has certainly turned since its encoder last advanced, in either direction, because a loop
/// that is closed through a dead encoder swings.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Silence {
    count: i32,
    ticks: u16,
    turned_rad: f32,
}

impl Silence {
    /// Updates the angle with one tick in which the motor certainly turned by `turned_rad`, if that is positive. Returns
    /// whether the encoder is dead. Voltage and current show the rate only while the current responds.
    fn update(&mut self, count: i32, turned_rad: f32, answer: CurrentResponse) -> bool {
        if count.wrapping_sub(self.count).unsigned_abs() > SILENT_COUNTS {
            *self = Self {
                count,
                ..Self::default()
            };
            return false;
        }
        self.ticks = self.ticks.saturating_add(1);
        if turned_rad > 0.0 && answer == CurrentResponse::Follows {
            self.turned_rad += turned_rad;
        }
        self.ticks >= RESIDUAL_TICKS && self.turned_rad > SILENT_RAD
    }
}

/// Compares the changes of current and voltage by sums of products of their second differences, which exclude steady
/// loads, ramps and offsets.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Follower {
    ampere_per_volt: f32,
    /// Share of a change of current that is left after a tick.
    rest: f32,
    /// Ticks processed, up to [`DIFFERENCE_TICKS`].
    ticks: u8,
    /// Current that the voltage alone would drive, at the end of the tick. A run of ticks starts with the steady current,
    /// because the back-EMF is not known here.
    model_a: f32,
    model: SecondDifference,
    measured: SecondDifference,
    power: f32,
    common: f32,
    measured_power: f32,
}

/// Time constant of the sums, in ticks: 60 ms.
const SUM_TICKS: f32 = 60.0;
const SUM_KEPT: f32 = 1.0 - 1.0 / SUM_TICKS;
/// Largest change that counts, A, so that one jump, as of a dying sensor, does not outweigh a hundred ticks.
const CHANGE_MAX_A: f32 = 0.5;
/// Least sum of the squared modelled second differences that is evidence, A^2: that of 20 mA in every tick. The
/// converter's noise, 4 mA per reading, contributes a quarter of this sum.
const POWER_MIN_A2: f32 = SUM_TICKS * 0.02 * 0.02;
/// Share of the modelled change that a working sensor shows at least, and a dead sensor at most.
const FOLLOWS_SHARE: f32 = 0.5;
const DEAD_SHARE: f32 = 0.25;
/// Share of the modelled mean square that a dead sensor shows at most. A working sensor may also show the effect of the
/// back-EMF.
const DEAD_POWER_SHARE: f32 = 0.5;

impl Follower {
    fn new(motor: &MotorParameters<f32>) -> Self {
        let ticks = TICK_S * motor.resistance_ohm / motor.inductance_h;
        // Without inductance the quotient is infinite, and the remaining share is 0.
        Self {
            ampere_per_volt: 1.0 / motor.resistance_ohm,
            rest: libm::expf(-ticks),
            ticks: 0,
            model_a: 0.0,
            model: SecondDifference::default(),
            measured: SecondDifference::default(),
            power: 0.0,
            common: 0.0,
            measured_power: 0.0,
        }
    }

    fn reset(&mut self) {
        self.ticks = 0;
        self.power = 0.0;
        self.common = 0.0;
        self.measured_power = 0.0;
    }

    // Inlined like `MotorWatch::update`, its only caller.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn update(&mut self, voltage_v: f32, current_a: f32) -> CurrentResponse {
        let steady_a = voltage_v * self.ampere_per_volt;
        let before_a = if self.ticks == 0 { steady_a } else { self.model_a };
        let after_a = steady_a + self.rest * (before_a - steady_a);
        self.model_a = after_a;
        // The mean over the tick suits a current that is measured at any time within the tick or averaged over it.
        let mean_a = 0.5 * (before_a + after_a);
        let changes = [self.model.update(mean_a), self.measured.update(current_a)];
        if self.ticks < DIFFERENCE_TICKS {
            self.ticks += 1;
        } else {
            let [model, measured] = if changes.iter().all(|change| change.abs() <= CHANGE_MAX_A) {
                // This is nearly always the case.
                changes
            } else {
                changes.map(|change| change.bounded(-CHANGE_MAX_A, CHANGE_MAX_A))
            };
            self.power = SUM_KEPT * self.power + model * model;
            self.common = SUM_KEPT * self.common + model * measured;
            self.measured_power = SUM_KEPT * self.measured_power + measured * measured;
        }
        if self.power < POWER_MIN_A2 {
            CurrentResponse::Unknown
        } else if self.common > FOLLOWS_SHARE * self.power {
            CurrentResponse::Follows
        } else if self.common < DEAD_SHARE * self.power && self.measured_power < DEAD_POWER_SHARE * self.power {
            CurrentResponse::Dead
        } else {
            CurrentResponse::Unknown
        }
    }
}

/// Number of values that must precede the first known second difference.
const DIFFERENCE_TICKS: u8 = 2;

/// The second difference of a sequence, valid after [`DIFFERENCE_TICKS`] values.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct SecondDifference {
    last: f32,
    last_step: f32,
}

impl SecondDifference {
    fn update(&mut self, value: f32) -> f32 {
        let step = value - self.last;
        let second = step - self.last_step;
        self.last = value;
        self.last_step = step;
        second
    }
}

#[cfg(test)]
mod tests;
