//! The steps with the bridges' supply on. Each step arms for some seconds and disarms before it asks a question.

use std::io::Write;

use firmware::drive_board::nucleo_h743zi;
use firmware::protocol::message::{BoardStatus, Order, STATUS_RATE_HZ};
use model::command::{DriveCommand, Request};
use model::sample::{MOTORS, Motor, TICK_US};
use model::supervise::arming::Mode;
use model::supervise::codes::{Blocker, BlockerSet, Fault};
use report::error::CommandError;
use virtual_board::link_client::LinkClient;

use super::person::Person;
use super::procedure::{Procedure, StepEnd, each_tick};
use super::turns::Turns;
use super::verdict::Finding;
use crate::cli::link::drive::DriveJob;
use crate::cli::link::wire::Wire;

/// Largest difference of the supply between meter and board, as a share: tolerance of the divider's resistors and of
/// the reference.
const SUPPLY_ERROR_SHARE: f64 = 0.03;
/// Largest current while the motors need no torque, A.
const FREE_RUNNING_A: f64 = 2.0;
/// Statuses of the 0.2 s over which a mean is taken.
const MEAN_STATUSES: usize = STATUS_RATE_HZ as usize / 5;
/// Time for which the vehicle is armed, s: for the tool, and for a person with an oscilloscope.
const ARMED_S: f64 = 10.0;
pub(super) const LOOK_S: f64 = 20.0;
/// What the tool asks a person for when the arm of a vehicle with its wheels in the air swings for longer than the tool waits.
pub(super) const STEADY_THE_ARM: &str = "Stop the wheels, let go of them, and steady the arm until it hangs still";
/// Commanded speed, m/s: the governor reaches this speed within the time, and the arm hangs far from its largest angle.
const FORWARD_M_S: f32 = 0.5;
const FORWARD_S: f64 = 3.0;
/// Turn on the spot, rad/s, and its duration, s. The turn is short: in the air the wheels do not turn the vehicle, and
/// their speeds diverge as long as the turn is commanded.
const TURN_RAD_S: f32 = 0.2;
const TURN_S: f64 = 0.5;
/// Budget of a tick, cycles of the core: a tenth of the tick's time. Nine tenths remain for the link, the log and the
/// stores. A voltage that comes a tenth of a tick late costs half a degree of phase at the law's fastest pole, the
/// torque observer's at 94 rad/s.
const TICK_CYCLES: u32 = (nucleo_h743zi::CORE_CLOCK_HZ as u64 * TICK_US as u64 / 1_000_000 / 10) as u32;
/// Longest time in which the vehicle must come to rest before it is armed, us, and time for which it must stay at rest:
/// a swinging arm is slow at each end.
const READY_US: u64 = 30_000_000;
/// Time after which the person is asked to steady the arm, us.
const SWINGS_US: u64 = 10_000_000;
const REST_US: u64 = 1_500_000;

impl<W: Wire, P: Person, O: Write> Procedure<'_, W, P, O> {
    pub(super) fn supply_on(&mut self) -> Result<Finding, StepEnd> {
        let battery = self.link.parameters()?.battery;
        let question = "Wheels off the ground, the arm hanging still, supply on, limited to 2 A: measure it, V";
        let meter_v = self.ask_number(question)?;
        let reads_v = self.supply_v()?;
        let range = f64::from(battery.minimum_v)..=f64::from(battery.maximum_v);
        let seen = format!("meter {meter_v:.2} V, board {reads_v:.2} V");
        Ok(Finding::of(
            range.contains(&meter_v) && (reads_v - meter_v).abs() < SUPPLY_ERROR_SHARE * meter_v,
            seen,
        ))
    }

    /// As [`Self::ready`]. An arm that swings on is steadied by the person: with the wheels in the air hardly anything
    /// brakes it.
    pub(super) fn settle(&mut self) -> Result<(), StepEnd> {
        match self.blocked_for(SWINGS_US)? {
            None => Ok(()),
            Some(blockers) if blockers.contains(Blocker::NotAtRest) => {
                self.ask_to(STEADY_THE_ARM)?;
                self.ready()
            }
            Some(_) => self.ready(),
        }
    }

    /// Clears the faults and waits until only the missing command keeps the vehicle from arming.
    pub(super) fn ready(&mut self) -> Result<(), StepEnd> {
        match self.blocked_for(READY_US)? {
            None => Ok(()),
            Some(blockers) => Err(StepEnd::Found(Finding::failed(format!("does not arm: {blockers}")))),
        }
    }

    /// Clears the faults and waits; what has kept the vehicle from arming for so long, if anything. A swinging arm is slow
    /// at each end, so the blockers come and go.
    fn blocked_for(&mut self, patience_us: u64) -> Result<Option<BlockerSet>, StepEnd> {
        self.link.order(Order::Request(Request::ClearFaults))?;
        let from_us = self.link.wire.now_us();
        let mut allowed = BlockerSet::EMPTY;
        allowed.insert(Blocker::NoCommand);
        allowed.insert(Blocker::CommandNotNeutral);
        let mut since_us = from_us;
        let mut seen = BlockerSet::EMPTY;
        loop {
            let blockers = self.link.fresh_status()?.vehicle.blockers;
            let now_us = self.link.wire.now_us();
            if blockers.bits() & !allowed.bits() != 0 {
                since_us = now_us;
                blockers.iter().for_each(|blocker| seen.insert(blocker));
            } else if now_us - since_us > REST_US {
                return Ok(None);
            }
            if self.link.interrupts() > 0 || now_us - from_us > patience_us {
                return Ok(Some(seen));
            }
        }
    }

    /// Arms and drives with this command for some seconds.
    fn drive(
        &mut self,
        speed_m_s: f32,
        seconds: f64,
        watch: impl FnMut(&mut LinkClient),
    ) -> Result<Result<BoardStatus, CommandError>, StepEnd> {
        self.ready()?;
        let job = DriveJob::new(speed_m_s, 0.0, seconds)?;
        Ok(self.link.drive_watching(&job, watch))
    }

    pub(super) fn armed(&mut self) -> Result<Finding, StepEnd> {
        let mut current = Currents::default();
        self.settle()?;
        // Friction holds a vehicle that nobody touches, even one that its motors drive away from rest.
        self.ask_to(&format!(
            "Armed for {ARMED_S} s after Enter: then give the arm a small push"
        ))?;
        let driven = self.drive(0.0, ARMED_S, |client| {
            if let Some(status) = &client.status {
                current.add(status);
            }
        })?;
        let faults = driven?.vehicle.faults;
        let [left, right] = [Motor::Left, Motor::Right].map(|motor| current.largest_a(motor));
        Ok(Finding::of(
            left < FREE_RUNNING_A && right < FREE_RUNNING_A && faults.is_empty(),
            format!("armed for {ARMED_S} s, left up to {left:.2} A, right up to {right:.2} A, faults: {faults}"),
        ))
    }

    pub(super) fn stopped_by_the_stop(&mut self) -> Result<bool, StepEnd> {
        let faults = self.link.fresh_status()?.vehicle.faults;
        Ok(faults.contains(Fault::EmergencyStop) && faults.contains(Fault::BridgeBreak))
    }

    pub(super) fn stop_armed(&mut self) -> Result<Finding, StepEnd> {
        self.settle()?;
        self.ask_to(&format!(
            "Armed after Enter: then press the emergency stop, within {LOOK_S} s"
        ))?;
        if self.drive(0.0, LOOK_S, |_| {})?.is_ok() {
            return Ok(Finding::failed(format!("still armed after {LOOK_S} s")));
        }
        let both = self.stopped_by_the_stop()?;
        let faults = self.link.fresh_status()?.vehicle.faults;
        self.ask_to("Release the emergency stop")?;
        self.settle()?;
        Ok(Finding::of(both, format!("disarmed by {faults}")))
    }

    pub(super) fn button_armed(&mut self) -> Result<Finding, StepEnd> {
        self.settle()?;
        self.ask_to(&format!(
            "Armed after Enter: then press the board's blue button, within {LOOK_S} s"
        ))?;
        if self.drive(0.0, LOOK_S, |_| {})?.is_ok() {
            return Ok(Finding::failed(format!("still armed after {LOOK_S} s")));
        }
        let vehicle = self.link.fresh_status()?.vehicle;
        let seen = format!("{}, faults: {}", vehicle.mode.name(), vehicle.faults);
        Ok(Finding::of(
            vehicle.mode == Mode::Disarmed && vehicle.faults.is_empty(),
            seen,
        ))
    }

    pub(super) fn forward(&mut self) -> Result<Finding, StepEnd> {
        let turns = self.turns((FORWARD_M_S, 0.0), FORWARD_S, [1.0; 2])?;
        if !turns.are_right() {
            return Ok(Finding::failed(turns.text()));
        }
        self.ask_to("Did both wheels turn forward?")?;
        Ok(Finding::passed(turns.text()))
    }

    pub(super) fn turn(&mut self) -> Result<Finding, StepEnd> {
        let turns = self.turns((0.0, TURN_RAD_S), TURN_S, [-1.0, 1.0])?;
        Ok(Finding::of(turns.are_right(), turns.text()))
    }

    /// Checks the wheels at a speed and a yaw rate.
    fn turns(
        &mut self,
        (speed_m_s, yaw_rate_rad_s): (f32, f32),
        seconds: f64,
        directions: [f64; 2],
    ) -> Result<Turns, StepEnd> {
        let command = DriveCommand::driving(speed_m_s, yaw_rate_rad_s);
        let mut turns = Turns::new(&self.link.parameters()?.drive_motor, command, directions);
        self.settle()?;
        self.start_records()?;
        let job = DriveJob::new(speed_m_s, yaw_rate_rad_s, seconds)?;
        let driven = self.link.drive_watching(&job, |client| {
            each_tick(client, |tick| turns.add(tick));
        });
        self.stop_records();
        driven?;
        Ok(turns)
    }

    pub(super) fn tick_cost(&mut self) -> Result<Finding, StepEnd> {
        let status = self.link.fresh_status()?;
        Ok(ticks_within_budget(status.cycles.worst, status.vehicle.late_ticks))
    }
}

/// Whether ticks of at most `worst` cycles, with `late` late ticks, leave the core the time that it needs.
fn ticks_within_budget(worst: u32, late: u32) -> Finding {
    if worst == 0 {
        return Finding::not_shown("this board counts no cycles");
    }
    Finding::of(
        worst < TICK_CYCLES && late == 0,
        format!("worst {worst} cycles, {late} late ticks"),
    )
}

/// The measured currents while the vehicle was armed.
#[derive(Debug, Default)]
struct Currents {
    seen: Vec<[f32; MOTORS]>,
    last: Option<u32>,
}

impl Currents {
    fn add(&mut self, status: &BoardStatus) {
        if self.last != Some(status.sequence) {
            self.last = Some(status.sequence);
            self.seen.push(status.vehicle.current_a);
        }
    }

    /// The largest magnitude of a mean over 0.2 s, A.
    fn largest_a(&self, motor: Motor) -> f64 {
        let mean = |window: &[[f32; MOTORS]]| {
            let sum: f64 = window.iter().map(|currents| f64::from(currents[motor as usize])).sum();
            sum / window.len() as f64
        };
        self.seen
            .windows(MEAN_STATUSES)
            .map(|window| mean(window).abs())
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::super::step::StepKind;
    use super::super::steps::STEPS;
    use super::super::verdict::StepVerdict;
    use super::*;

    #[test]
    fn a_tick_has_a_tenth_of_its_time() {
        assert_eq!(ticks_within_budget(39_999, 0).verdict, StepVerdict::Passed);
        assert_eq!(ticks_within_budget(40_000, 0).verdict, StepVerdict::Failed);
        assert_eq!(ticks_within_budget(6_000, 1).verdict, StepVerdict::Failed);
        assert_eq!(ticks_within_budget(0, 0).verdict, StepVerdict::NotShown);
    }

    #[test]
    fn the_step_says_the_budget() {
        let step = STEPS.iter().find(|step| step.kind == StepKind::TickCost).unwrap();
        assert!(step.passes.contains("40,000"), "{}", step.passes);
        assert_eq!(TICK_CYCLES, 40_000);
    }
}
