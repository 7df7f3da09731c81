//! The steps without the bridges' supply.

use std::io::Write;

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use firmware::hardware::ClockSource;
use firmware::protocol::message::Order;
use model::command::Request;
use model::sample::{MOTORS, Motor};
use model::supervise::codes::{Blocker, BlockerSet};

use super::person::Person;
use super::procedure::{Procedure, StepEnd};
use super::verdict::Finding;
use crate::cli::link::who;
use crate::cli::link::wire::Wire;

/// Findings of the board's self-test.
const SELF_TEST: [Blocker; 6] = [
    Blocker::BreakPath,
    Blocker::BoardOptions,
    Blocker::PartRevision,
    Blocker::Image,
    Blocker::Unsealed,
    Blocker::Ram,
];
/// Duration of the clocks' comparison, us, and their largest difference. The board's internal oscillator is within 1 %,
/// and the host receives the board's messages within some milliseconds.
const CLOCK_US: u64 = 3_000_000;
const CLOCK_SHARE: f64 = 0.01;
/// Largest current at an open bridge, A: beyond it the supervisor reports a wrong sensor.
const ZERO_A: f64 = 0.5;
/// Largest supply that counts as off, V, and the largest difference between meter and board there.
const OFF_V: f64 = 1.0;
const OFF_DIFFERENCE_V: f64 = 0.5;
/// Smallest current that determines a gain, A, and the largest difference between meter and board, as a share.
const FED_MIN_A: f64 = 1.0;
const FED_SHARE: f64 = 0.1;
/// Largest error of a turn by hand, as a share, and largest movement of the other wheel meanwhile.
pub(super) const TURN_SHARE: f64 = 0.2;
const OTHER_SHARE: f64 = 0.05;

impl<W: Wire, P: Person, O: Write> Procedure<'_, W, P, O> {
    pub(super) fn identity(&mut self) -> Result<Finding, StepEnd> {
        let identity = self.link.identify()?;
        let blockers = self.link.fresh_status()?.vehicle.blockers;
        let found: BlockerSet = self_test_of(blockers);
        Ok(if found.is_empty() {
            Finding::passed(who(&identity))
        } else {
            Finding::failed(format!("{}; the self-test found {found}", who(&identity)))
        })
    }

    pub(super) fn clock(&mut self) -> Result<Finding, StepEnd> {
        let first = self.link.fresh_status()?;
        let from_us = self.link.wire.now_us();
        while self.link.wire.now_us() - from_us < CLOCK_US {
            self.link.listen()?;
        }
        let last = self.link.fresh_status()?;
        let host_us = (self.link.wire.now_us() - from_us) as f64;
        let board_us = last.vehicle.time_us.saturating_sub(first.vehicle.time_us) as f64;
        let off = board_us / host_us - 1.0;
        let seen = format!("{}, {:+.2} % of this computer's clock", last.clock.name(), 100.0 * off);
        Ok(Finding::of(
            last.clock == ClockSource::External && off.abs() <= CLOCK_SHARE,
            seen,
        ))
    }

    pub(super) fn contacts(&mut self) -> Result<Finding, StepEnd> {
        for (what, first, second) in [
            ("Release the emergency stop, both contacts closed", false, false),
            ("Press the emergency stop and hold it", true, true),
            ("Release the emergency stop", false, false),
            ("Open the first contact alone (PG2)", true, false),
            (
                "Close it, and open the second contact alone (PE15 and PA8)",
                false,
                true,
            ),
            ("Close both contacts", false, false),
        ] {
            self.ask_to(what)?;
            let last = self.last_tick()?.sample;
            let name = |open: bool| if open { "open" } else { "closed" };
            for (input, is, expected) in [
                ("first contact (PG2)", last.emergency_stop, first),
                ("second contact (PE15 and PA8)", last.break_input, second),
            ] {
                if is != expected {
                    let seen = format!("{what}: the {input} reads {}, not {}", name(is), name(expected));
                    return Ok(Finding::failed(seen));
                }
            }
            if second && !last.bridge_break {
                return Ok(Finding::failed(format!("{what}: the break did not trip")));
            }
        }
        self.link.order(Order::Request(Request::ClearFaults))?;
        let status = self.link.fresh_status()?;
        let left = status.vehicle.blockers.contains(Blocker::BridgeBreak);
        Ok(Finding::of(
            !left,
            if left {
                "the break's flag does not clear"
            } else {
                "each input follows its own contact"
            },
        ))
    }

    pub(super) fn supply_off(&mut self) -> Result<Finding, StepEnd> {
        let meter_v = self.ask_number("Measure the bridges' supply, V, which is off")?;
        let reads_v = self.supply_v()?;
        let seen = format!("meter {meter_v:.2} V, board {reads_v:.2} V");
        Ok(Finding::of(
            meter_v.abs() < OFF_V && (reads_v - meter_v).abs() < OFF_DIFFERENCE_V,
            seen,
        ))
    }

    pub(super) fn current_zeros(&mut self) -> Result<Finding, StepEnd> {
        let motors = if self.link.has_spar()? { MOTORS } else { 2 };
        let mean_a = self.currents_a()?;
        let mut seen = Vec::new();
        let mut good = true;
        for (name, mean_a) in ["left", "right", "ballast"].iter().zip(mean_a).take(motors) {
            good &= mean_a.abs() < ZERO_A;
            seen.push(format!("{name} {mean_a:+.2} A"));
        }
        Ok(Finding::of(good, seen.join(", ")))
    }

    pub(super) fn current_gain(&mut self) -> Result<Finding, StepEnd> {
        let mut seen = Vec::new();
        let motors = if self.link.has_spar()? { MOTORS } else { 2 };
        let named = [
            ("left", Motor::Left),
            ("right", Motor::Right),
            ("ballast", Motor::Ballast),
        ];
        for (name, motor) in named.into_iter().take(motors) {
            let question = format!("Feed 2 to 5 A forward through the {name} motor's current sensor: how much, A?");
            let fed_a = self.ask_number(&question)?;
            let reads_a = self.currents_a()?[motor as usize];
            seen.push(format!("{name}: fed {fed_a:+.2} A, board {reads_a:+.2} A"));
            if fed_a < FED_MIN_A || (reads_a - fed_a).abs() > FED_SHARE * fed_a {
                return Ok(Finding::failed(seen.join("; ")));
            }
        }
        self.ask_to("Take the current away, and put the motors' leads back")?;
        Ok(Finding::passed(seen.join("; ")))
    }

    pub(super) fn wheels(&mut self) -> Result<Finding, StepEnd> {
        let parameters = self.link.parameters()?;
        let motor = &parameters.drive_motor;
        let turn = f64::from(motor.encoder_counts_per_rev) * f64::from(motor.gear_ratio);
        let mut seen = Vec::new();
        for (name, this, other) in [
            ("left", Motor::Left, Motor::Right),
            ("right", Motor::Right, Motor::Left),
        ] {
            let before = self.last_tick()?.sample.encoder_counts;
            self.ask_to(&format!("Turn the {name} wheel forward by hand, one turn, arm held"))?;
            let after = self.last_tick()?.sample.encoder_counts;
            let turns = |motor: Motor| after[motor as usize].wrapping_sub(before[motor as usize]) as f64 / turn;
            seen.push(format!(
                "{name} wheel turned: {:+.2} turns, the other {:+.2}",
                turns(this),
                turns(other)
            ));
            if (turns(this) - 1.0).abs() > TURN_SHARE || turns(other).abs() > OTHER_SHARE {
                return Ok(Finding::failed(seen.join("; ")));
            }
        }
        Ok(Finding::passed(seen.join("; ")))
    }

    pub(super) fn last_tick(&mut self) -> Result<FlightRecord, StepEnd> {
        let ticks = self.ticks()?;
        ticks
            .last()
            .copied()
            .ok_or_else(|| StepEnd::Found(Finding::failed("no tick")))
    }

    /// The mean currents that the board reads, A.
    pub(super) fn currents_a(&mut self) -> Result<[f64; MOTORS], StepEnd> {
        let ticks = self.ticks()?;
        let of = |motor: usize| {
            mean(ticks.iter().map(|tick| {
                let analog = tick.sample.analog.with(&SCALES.analog, |raw, scale| scale.value(raw));
                f64::from(analog.currents()[motor])
            }))
        };
        Ok(core::array::from_fn(of))
    }

    /// The supply that the board reads, V.
    pub(super) fn supply_v(&mut self) -> Result<f64, StepEnd> {
        Ok(mean(self.ticks()?.iter().map(|tick| {
            f64::from(SCALES.analog.battery_voltage.value(tick.sample.analog.battery_voltage))
        })))
    }
}

/// The self-test's findings among the blockers.
fn self_test_of(blockers: BlockerSet) -> BlockerSet {
    let mut found = BlockerSet::EMPTY;
    for blocker in SELF_TEST {
        if blockers.contains(blocker) {
            found.insert(blocker);
        }
    }
    found
}

/// The mean of some values.
pub(super) fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}
