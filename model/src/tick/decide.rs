//! Stage 3: the control laws, subject to supervision's result.

use crate::bounded::Bounded;
use crate::command::{Command, DriveCommand};
use crate::control::LawOutput;
use crate::control::ballast_plan::Pivot;
use crate::control::spar::{SparController, SparState, SparTerms};
use crate::control::speed::SpeedInput;
use crate::control::speed_controller::SpeedController;
use crate::control::steering::{STEERING_SHARE, SteeringController, SteeringInput};
use crate::control::turning_grip::{TurningGrip, TurningGround};
use crate::estimate::Estimate;
use crate::estimate::stall::Intent;
use crate::sample::MOTORS;
use crate::sample::TICK_S;
use crate::sensed::Sensed;
use crate::status::Terms;
use crate::supervise::arming::Mode;
use crate::supervise::codes::{BlockerSet, FaultSet, Limit, LimitSet};
use crate::supervise::supervisor::Findings;
use crate::vehicle::Vehicle;

use super::estimate::{Estimated, Sines};

/// Voltage that probes the drive motors' current sensors, V: positive for two ticks and negative for two. A current
/// sensor must follow the probe even while the laws hold the vehicle quietly. The probe changes the current by 60 mA
/// and does not move the vehicle.
const PROBE_V: f32 = 0.02;
/// Distance of the governed reference from the commanded speed, m/s, up to which the command counts as reached.
const REFERENCE_REACHED_M_S: f32 = 0.01;
/// The same for the yaw rate, rad/s.
const REFERENCE_REACHED_RAD_S: f32 = 0.01;

/// The decision of stage 3 in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// The mode from now on.
    pub mode: Mode,
    /// Latched faults.
    pub faults: FaultSet,
    /// Conditions that block arming.
    pub blockers: BlockerSet,
    /// Number of late ticks since boot.
    pub late_ticks: u32,
    /// Number of refused requests to arm since boot.
    pub refused_arms: u32,
    /// Limits that bound the response so far: those of the supply and of the governor.
    pub limits: LimitSet,
    /// Wanted voltage of each motor, V, including the probe of the current sensors; all 0 while disarmed.
    pub voltage_v: [f32; MOTORS],
    /// The ballast motor is switched off and gets no voltage, whatever its encoder shows.
    pub ballast_off: bool,
    /// Share of its current limit that each motor may use, 0 to 1.
    pub motor_shares: [f32; MOTORS],
    /// Terms of the laws, before any limit; all 0 while disarmed.
    pub terms: Terms,
    /// Governed speed reference, m/s.
    pub speed_reference_m_s: f32,
    /// Governed yaw-rate reference, rad/s.
    pub yaw_rate_reference_rad_s: f32,
}

/// The laws' output in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Wish {
    pub(super) limits: LimitSet,
    pub(super) voltage_v: [f32; MOTORS],
    pub(super) ballast_off: bool,
    pub(super) terms: Terms,
}

/// The control laws and their state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Laws {
    speed: SpeedController,
    steering: SteeringController,
    turning_grip: TurningGrip,
    spar: Option<SparController>,
    /// A spar fault has occurred since the vehicle was armed: the ballast motor gets no voltage.
    spar_off: bool,
    /// The speed that the law was to reach in the last tick, before the governor, m/s.
    target_m_s: f32,
    duty_max: f32,
    /// Tick within the probe's period of four.
    probe_ticks: u8,
    /// Whether the laws drove the motors in the last tick.
    armed: bool,
}

impl Laws {
    /// The laws for `vehicle` with bridges that give at most the share `duty_max` of the supply.
    pub(super) fn new(vehicle: &Vehicle<f32>, duty_max: f32) -> Self {
        Self {
            speed: SpeedController::new(vehicle, TICK_S),
            steering: SteeringController::new(vehicle, TICK_S),
            turning_grip: TurningGrip::new(vehicle),
            spar: SparController::new(vehicle, TICK_S),
            spar_off: false,
            target_m_s: 0.0,
            duty_max,
            probe_ticks: 0,
            armed: false,
        }
    }

    /// One tick: returns the laws' output; all 0 while disarmed.
    pub(super) fn step(
        &mut self,
        verdict: Findings,
        sensed: &Sensed,
        Estimated { estimate, sines }: &Estimated,
        command: &Command,
    ) -> Wish {
        self.armed = verdict.mode != Mode::Disarmed;
        if !self.armed {
            self.target_m_s = 0.0;
            return Wish::default();
        }
        if verdict.newly_armed {
            self.speed.reset(estimate.speed_m_s);
            self.steering.reset();
            self.spar_off = false;
            if let Some(spar) = &mut self.spar {
                spar.reset(&spar_state(estimate));
            }
        }
        self.spar_off |= verdict.faults.has_any(FaultSet::SPAR);

        let wanted = if verdict.mode == Mode::Armed {
            command.drive
        } else {
            DriveCommand::NEUTRAL
        };
        self.target_m_s = wanted.speed_m_s;
        let supply_v = self.duty_max * sensed.supply_v;
        let (speed_m_s, reference_m_s) = (estimate.speed_m_s.abs(), self.speed.reference_m_s().abs());
        let ground = TurningGround {
            sin_slope: sines.slope.0,
            sin_roll: sines.roll,
            speed_m_s: speed_m_s.bounded(reference_m_s, f32::MAX),
        };
        let turn = self.steering.step(&SteeringInput {
            target_rad_s: self.turning_grip.yaw_rate_rad_s(wanted.yaw_rate_rad_s, &ground),
            yaw_rate_rad_s: estimate.yaw_rate_rad_s,
            heading_rad: estimate.heading_rad,
            voltage_max_v: STEERING_SHARE * supply_v,
            blocked: self.speed.is_stuck(),
        });
        let drive_max_v = supply_v - turn.voltage_v.abs();
        let input = SpeedInput {
            target_m_s: wanted.speed_m_s,
            phi_rad: estimate.phi_rad,
            phi_sin_cos: sines.phi,
            theta_rate_rad_s: estimate.theta_rate_rad_s,
            phi_rate_rad_s: estimate.phi_rate_rad_s,
            slope_sin_cos: sines.slope,
            slope_turn_per_s: sines.slope_turn_per_s,
            turns: self.steering.reference_rad_s() != 0.0,
            distance_m: estimate.distance_m,
            sliding_over_m_s: estimate.sliding.then_some(estimate.speed_m_s),
            voltage_max_v: drive_max_v,
        };
        let drive = self.speed.step(&input);
        let level = self.level(estimate, sines, supply_v);
        let probe_v = self.probe_v();
        let mut limits = LimitSet::EMPTY;
        limits.insert_if(Limit::Voltage, drive.voltage_v.abs() >= drive_max_v);
        let behind_m_s = (self.speed.reference_m_s() - wanted.speed_m_s).abs();
        limits.insert_if(Limit::SlopeLimit, self.speed.slope_limited());
        let behind_rad_s = (self.steering.reference_rad_s() - wanted.yaw_rate_rad_s).abs();
        let behind = behind_m_s > REFERENCE_REACHED_M_S || behind_rad_s > REFERENCE_REACHED_RAD_S;
        limits.insert_if(Limit::Reference, behind);
        limits.insert_if(Limit::Stall, estimate.stalled);
        limits.insert_if(Limit::Slip, estimate.sliding);
        limits.insert_if(Limit::Freed, self.speed.is_just_free());
        Wish {
            limits,
            voltage_v: [
                drive.voltage_v - turn.voltage_v + probe_v,
                drive.voltage_v + turn.voltage_v + probe_v,
                level.voltage_v,
            ],
            ballast_off: self.spar.is_none() || self.spar_off,
            terms: Terms {
                speed: drive.terms,
                steering: turn.terms,
                spar: level.terms,
            },
        }
    }

    /// The probe of the current sensors in this tick, V.
    fn probe_v(&mut self) -> f32 {
        self.probe_ticks = (self.probe_ticks + 1) & 3;
        if self.probe_ticks < 2 { PROBE_V } else { -PROBE_V }
    }

    /// What the spar law asks for; nothing without a spar or after a spar fault.
    fn level(&mut self, estimate: &Estimate, sines: &Sines, supply_v: f32) -> LawOutput<SparTerms> {
        // Under a law that does not know what the axle does, the spar rests in itself.
        let pivot = self
            .speed
            .acceleration_g()
            .map_or_else(Pivot::default, |acceleration_g| Pivot {
                acceleration_g,
                sin_slope: sines.slope.0,
                cos_slope: sines.slope.1,
                arm_rate_rad_s: estimate.phi_rate_rad_s,
                yaw_rate_rad_s: estimate.yaw_rate_rad_s,
                yaw_rad_s2: self.steering.reference_rad_s2(),
                sin_roll: sines.roll,
            });
        match &mut self.spar {
            Some(spar) if !self.spar_off => spar.step(&spar_state(estimate), &pivot, supply_v),
            _ => LawOutput::default(),
        }
    }

    /// The command to the speed law in the last tick, and the law's findings.
    pub(super) fn intent(&self) -> Intent {
        Intent {
            target_m_s: self.target_m_s,
            reference_m_s: self.speed.reference_m_s(),
            stuck: self.speed.is_stuck(),
            slope_lesson: if self.armed { self.speed.slope_lesson() } else { None },
        }
    }

    /// Whether the vehicle was armed on a slope on which it cannot stand.
    pub(super) fn refuses_slope(&self) -> bool {
        self.armed && self.speed.refuses_slope()
    }

    /// The governed speed reference, m/s.
    pub(super) fn speed_reference_m_s(&self) -> f32 {
        self.speed.reference_m_s()
    }

    /// The governed yaw-rate reference, rad/s.
    pub(super) fn yaw_rate_reference_rad_s(&self) -> f32 {
        self.steering.reference_rad_s()
    }
}

/// The estimated state of the spar.
fn spar_state(estimate: &Estimate) -> SparState {
    SparState {
        spar_rad: estimate.spar_rad,
        ballast_rad: estimate.ballast_rad,
        spar_rate_rad_s: estimate.spar_rate_rad_s,
        ballast_rate_rad_s: estimate.ballast_rate_rad_s,
    }
}
