//! Observers of quantities that the sensors do not show: an unmodelled torque at the joint, the wheel's rate without the
//! filter's lag, and the change of the slope in each tick.

use super::balance::MotionByTorque;
use super::design::Design;
use super::obstacle::PushState;
use crate::bounded::Bounded;

/// Largest torque that the torque observer accepts.
const OBSERVED_TORQUE_MAX: f32 = 2.0;
/// Sine of the steepest slope that the rate observer accepts.
const SIN_SLOPE_MAX: f32 = 0.66;
/// Error of the joint rate above which the slope estimate changes no faster, as when a wheel hits a kerb.
const JOLT: f32 = 0.1;
/// Share of that error while the vehicle is commanded to move slowly and moves at less than half of the commanded speed.
/// The obstruction is then more likely a kerb that the vehicle creeps up than a hill, whose foot is seldom as sharp.
const CREEPING_SHARE: f32 = 0.2;
/// Error of the joint rate below which the vehicle moves as modelled, and the rate at which the calm slope then follows
/// the slope.
const CALM: f32 = 0.03;
const CALM_RATE: f32 = 0.1;

/// Torque observer on phi'. The observer explains the arm's unmodelled motion by a torque at the joint, which absorbs
/// errors of damping, motor constant, resistance and friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TorqueObserver {
    tick: f32,
    pole: f32,
    phi_rate: f32,
    torque: f32,
}

impl TorqueObserver {
    pub(super) fn new(design: &Design, tick: f32) -> Self {
        Self {
            tick,
            pole: design.torque_observer,
            phi_rate: 0.0,
            torque: 0.0,
        }
    }

    pub(super) fn reset(&mut self, phi_rate: f32) {
        self.phi_rate = phi_rate;
        self.torque = 0.0;
    }

    /// Predicts with the torque `applied` in the last tick and corrects with the sensed phi', using the share `pace` of
    /// the poles.
    pub(super) fn update(&mut self, motion: &MotionByTorque<f32>, applied: f32, phi_rate: f32, pace: f32) {
        let pole = pace * self.pole;
        self.phi_rate += self.tick * motion.arm.at(applied + self.torque);
        let error = self.tick * (phi_rate - self.phi_rate);
        self.phi_rate += 2.0 * pole * error;
        self.torque += pole * pole / motion.arm.per_torque * error;
        self.torque = self.torque.bounded(-OBSERVED_TORQUE_MAX, OBSERVED_TORQUE_MAX);
    }

    /// The observer's states.
    pub(super) fn states(&mut self) -> [&mut f32; 2] {
        [&mut self.phi_rate, &mut self.torque]
    }

    /// The observed torque, to be added to the applied torque.
    pub(super) fn torque(&self) -> f32 {
        self.torque
    }
}

/// Joint-rate observer: the model predicts theta' + phi' and passes it through the same filter as the sensed joint
/// rate, so the filter's lag costs nothing. The observer explains the wheel's unmodelled motion by a slope. The estimator
/// owns the slope; the observer returns only the slope's change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RateObserver {
    tick: f32,
    pole: f32,
    filter_gain: f32,
    wheel_rate: f32,
    unforeseen: f32,
    slope_lesson: f32,
    calm_sin_slope: f32,
    /// The predicted joint rate now, and behind the filter's first and second stage.
    joint_rate: f32,
    stages: [f32; 2],
}

impl RateObserver {
    /// `filter_gain` is the gain of each of the two stages of the filter of the sensed joint rate
    /// ([`RateFilter`](crate::estimate::rate_filter::RateFilter)).
    pub(super) fn new(design: &Design, tick: f32, filter_gain: f32) -> Self {
        Self {
            tick,
            pole: design.rate_observer,
            filter_gain,
            wheel_rate: 0.0,
            unforeseen: 0.0,
            slope_lesson: 0.0,
            calm_sin_slope: 0.0,
            joint_rate: 0.0,
            stages: [0.0; 2],
        }
    }

    pub(super) fn reset(&mut self, wheel_rate: f32, phi_rate: f32, sin_slope: f32) {
        self.wheel_rate = wheel_rate;
        self.joint_rate = wheel_rate + phi_rate;
        self.stages = [self.joint_rate; 2];
        self.unforeseen = 0.0;
        self.slope_lesson = 0.0;
        self.calm_sin_slope = sin_slope;
    }

    /// Predicts with the whole torque of the last tick and corrects with the sensed joint rate, on a slope of the sine
    /// `sin_slope`. A stuck vehicle learns nothing about its slope: the observer returns to the slope from before the
    /// push. The observer does the same after an obstacle held up the wheels, because the change learnt since then was no
    /// slope.
    #[allow(clippy::too_many_arguments)] // Each is another quantity of the one tick.
    pub(super) fn update(
        &mut self,
        motion: &MotionByTorque<f32>,
        torque: f32,
        phi_rate: f32,
        sensed: f32,
        sin_slope: f32,
        push: PushState,
        haste: f32,
    ) {
        let pole = haste * self.pole;
        let predicted = self.wheel_rate + self.tick * motion.wheel.at(torque);
        // The encoder's filter receives the mean rate of the tick.
        let mean = 0.5 * (predicted + phi_rate + self.joint_rate);
        let [first, second] = &mut self.stages;
        *first += self.filter_gain * (mean - *first);
        *second += self.filter_gain * (*first - *second);
        let error = sensed - *second;
        self.unforeseen = error;
        self.wheel_rate = predicted + 2.0 * pole * self.tick * error;
        self.joint_rate = self.wheel_rate + phi_rate;
        if matches!(push, PushState::Stuck | PushState::Freed) {
            self.slope_lesson = self.calm_sin_slope - sin_slope;
            return;
        }
        // A jolt is no slope, so one tick can change the slope by a bounded amount only.
        let share = if push == PushState::Creeps && haste <= 1.0 {
            CREEPING_SHARE
        } else {
            1.0
        };
        let jolt = share * haste * JOLT;
        let learnt = error.bounded(-jolt, jolt);
        let change = pole * pole * self.tick / motion.wheel_per_sin_slope * learnt;
        self.slope_lesson = (sin_slope + change).bounded(-SIN_SLOPE_MAX, SIN_SLOPE_MAX) - sin_slope;
        if error.abs() < CALM && push == PushState::None {
            self.calm_sin_slope += CALM_RATE * self.tick * (sin_slope - self.calm_sin_slope);
        }
    }

    /// The states that the observer corrects in every tick.
    pub(super) fn states(&mut self) -> [&mut f32; 4] {
        let [first, second] = &mut self.stages;
        [&mut self.wheel_rate, &mut self.joint_rate, first, second]
    }

    /// theta' without the filter's lag.
    pub(super) fn wheel_rate(&self) -> f32 {
        self.wheel_rate
    }

    /// The sensed joint rate less the model's prediction for the last tick.
    pub(super) fn unforeseen(&self) -> f32 {
        self.unforeseen
    }

    /// Change of the slope's sine that the last tick showed.
    pub(super) fn slope_lesson(&self) -> f32 {
        self.slope_lesson
    }
}
