//! The steps of the ballast: turned by hand, and levelling the spar.

use std::io::Write;

use firmware::flight_record::FlightRecord;
use model::sample::Motor;
use model::supervise::codes::FaultSet;
use model::vehicle::{MotorParameters, Vehicle};

use super::joint_turn::{JointMotor, JointTurn};
use super::person::Person;
use super::procedure::{Procedure, StepEnd, each_tick};
use super::unpowered::TURN_SHARE;
use super::verdict::Finding;
use crate::cli::link::drive::DriveJob;
use crate::cli::link::wire::Wire;

/// Turn of the ballast by hand, turns: with a quarter turn the ballast is level, which the eye judges well.
const HAND_TURN: f64 = 0.25;
/// Time for which the vehicle is armed while a hand tilts the spar, s.
const LEVELLING_S: f64 = 8.0;
/// Turn of the ballast at which the comparison is made, rad. A spar tilted by 10 degrees, which is short of the angle at
/// which it is caught, asks for more than a radian.
const SWING_RAD: f64 = 0.35;
/// Largest difference between that turn and the turn from the motor's voltage, as a share. The ballast's weight takes up
/// to half an ampere, and a winding 60 K warmer then drops 0.7 V more, a quarter of the back-EMF; the gearbox's play adds
/// some degrees. Exchanged leads are off by 2.
const SWING_SHARE: f64 = 0.5;

impl<W: Wire, P: Person, O: Write> Procedure<'_, W, P, O> {
    pub(super) fn ballast_by_hand(&mut self) -> Result<Finding, StepEnd> {
        let Some(motor) = self.link.parameters()?.ballast_motor().copied() else {
            return Ok(Finding::not_needed("no ballast"));
        };
        let counts_per_turn = f64::from(motor.encoder_counts_per_rev) * f64::from(motor.gear_ratio);
        let counts = |tick: &FlightRecord| tick.sample.encoder_counts[Motor::Ballast as usize];
        self.ask_to("Let the ballast hang still, and hold the spar upright")?;
        let before = counts(&self.last_tick()?);
        self.ask_to("Turn the ballast's lower end forward by a quarter turn, and hold it there")?;
        let after = counts(&self.last_tick()?);
        let turns = after.wrapping_sub(before) as f64 / counts_per_turn;
        Ok(Finding::of(
            (turns - HAND_TURN).abs() < TURN_SHARE * HAND_TURN,
            format!("{turns:+.3} turns"),
        ))
    }

    pub(super) fn levelling(&mut self) -> Result<Finding, StepEnd> {
        let parameters = self.link.parameters()?;
        let levelled = Vehicle::new(parameters).is_ok_and(|vehicle| vehicle.spar_gains().is_some());
        let Some(motor) = parameters.ballast_motor().filter(|_| levelled) else {
            return Ok(Finding::not_needed(
                "every gain of the spar's law is 0: the spar is not levelled",
            ));
        };
        let zero_a = self.currents_a()?[Motor::Ballast as usize];
        let mut swing = BallastSwing::new(motor, zero_a);
        self.settle()?;
        self.ask_to(&format!(
            "Hold the spar upright by the camera, away from the ballast. Armed for {LEVELLING_S} s after Enter: then tilt its \
             lower end forward by 10 degrees, and hold it"
        ))?;
        self.ready()?;
        self.start_records()?;
        let job = DriveJob::new(0.0, 0.0, LEVELLING_S)?;
        let driven = self.link.drive_watching(&job, |client| {
            each_tick(client, |tick| swing.add(tick));
        });
        self.stop_records();
        let faults = driven?.vehicle.faults;
        let seen = format!("{}; faults: {faults}", swing.text());
        Ok(Finding::of(swing.is_right() && !faults.has_any(FaultSet::SPAR), seen))
    }
}

/// The ballast's first swing under its motor's voltage.
struct BallastSwing {
    motor: JointMotor,
    before: Option<FlightRecord>,
    turn: JointTurn,
}

impl BallastSwing {
    /// No swing yet, of a ballast with this motor, whose current sensor shows `zero_a` at an open bridge.
    fn new(motor: &MotorParameters<f32>, zero_a: f64) -> Self {
        Self {
            motor: JointMotor::new(motor, zero_a),
            before: None,
            turn: JointTurn::default(),
        }
    }

    /// Adds the time from the previous tick to this tick, up to the end of the first swing.
    fn add(&mut self, tick: &FlightRecord) {
        let Some(before) = self.before.replace(*tick) else {
            return;
        };
        let armed = before.actuation.enable && tick.actuation.enable;
        if armed && tick.tick == before.tick.wrapping_add(1) && self.turn.counted.abs() < SWING_RAD {
            self.motor.add(&mut self.turn, Motor::Ballast, &before, tick);
        }
    }

    fn is_right(&self) -> bool {
        let JointTurn { counted, by_voltage } = self.turn;
        counted >= SWING_RAD && (counted - by_voltage).abs() < SWING_SHARE * counted
    }

    fn text(&self) -> String {
        let JointTurn { counted, by_voltage } = self.turn;
        format!("the ballast turned by {counted:+.2} rad, by its voltage {by_voltage:+.2}")
    }
}
