//! Runs a file's records through the same step again, boot by boot. Each boot begins with a new core.

use std::fmt;

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use model::status::Status;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use virtual_board::records::first_field;

/// The records of one boot, and the vehicle in force.
#[derive(Debug)]
pub struct BootToReplay<R> {
    /// The firmware's vehicle.
    pub vehicle: Vehicle<f32>,
    /// The records in order.
    pub records: R,
}

/// A range of ticks, ends included, without records in a boot. The boot's replay ends before this range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissingTicks {
    /// Number of the boot in the file, from 1; `None` in a file of one boot.
    pub boot: Option<usize>,
    /// The first missing tick.
    pub from: u32,
    /// The last missing tick.
    pub to: u32,
}

impl fmt::Display for MissingTicks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { boot, from, to } = self;
        match boot {
            Some(boot) => write!(
                f,
                "boot {boot}: ticks {from} to {to} are missing: the replay of this boot ends before them"
            ),
            None => write!(f, "ticks {from} to {to} are missing: the replay ends before them"),
        }
    }
}

/// The first tick whose replayed actuation differs from the recorded one, and the first field that differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReplayDifference {
    /// Number of the boot in the file, from 1.
    pub boot: usize,
    /// The tick.
    pub tick: u32,
    /// Time of the tick, us since that boot.
    pub time_us: u64,
    /// The field that differs.
    pub field: &'static str,
    /// Its value in the record.
    pub recorded: i32,
    /// Its value in the replay.
    pub replayed: i32,
}

/// One tick of a replay.
#[derive(Debug)]
pub struct ReplayedTick {
    /// Number of the boot in the file, from 1.
    pub boot: usize,
    /// The vehicle's status.
    pub status: Status,
    /// Where the replayed actuation differs from the recorded one.
    pub difference: Option<ReplayDifference>,
}

/// A replay in progress.
pub struct Replay<R> {
    boots: Vec<BootToReplay<R>>,
    /// Number of records of each boot to replay.
    ticks: Vec<usize>,
    missing: Vec<MissingTicks>,
    /// The next boot, and the next record in it.
    boot: usize,
    next: usize,
    core: Option<VehicleCore>,
}

impl<R: AsRef<[FlightRecord]>> Replay<R> {
    /// A replay of these boots, each from its first tick to its first missing tick.
    pub fn new(boots: Vec<BootToReplay<R>>) -> Self {
        let is_one = boots.len() == 1;
        let (mut ticks, mut missing) = (Vec::new(), Vec::new());
        for (boot, number) in boots.iter().zip(1..) {
            let records = boot.records.as_ref();
            let gap = gap(records);
            ticks.push(gap.map_or(records.len(), |(whole, ..)| whole));
            missing.extend(gap.map(|(_, from, to)| MissingTicks {
                boot: (!is_one).then_some(number),
                from,
                to,
            }));
        }
        Self {
            boots,
            ticks,
            missing,
            boot: 0,
            next: 0,
            core: None,
        }
    }

    /// Missing ticks of the boots, at most one range per boot.
    pub fn missing(&self) -> &[MissingTicks] {
        &self.missing
    }

    /// Number of ticks of each boot to replay.
    pub fn ticks(&self) -> &[usize] {
        &self.ticks
    }

    /// The boot of the next tick, from 1; `None` at the end.
    pub fn next_boot(&self) -> Option<usize> {
        let done = |boot: usize| if boot == self.boot { self.next } else { 0 };
        let mut rest = (self.boot..self.ticks.len()).filter(|boot| self.ticks[*boot] > done(*boot));
        rest.next().map(|boot| boot + 1)
    }

    /// Replays the next tick; `None` at the end.
    pub fn step(&mut self) -> Option<ReplayedTick> {
        let number = self.next_boot()?;
        if number - 1 != self.boot {
            (self.boot, self.next, self.core) = (number - 1, 0, None);
        }
        let boot = self.boots.get(self.boot)?;
        let record = boot.records.as_ref().get(self.next)?;
        self.next += 1;
        let core = self
            .core
            .get_or_insert_with(|| VehicleCore::new(&boot.vehicle, &SCALES));
        let output = core.step(&record.sample, &record.command);
        let difference = first_field(record.actuation, output.actuation);
        Some(ReplayedTick {
            boot: number,
            status: output.status,
            difference: difference.map(|(field, recorded, replayed)| ReplayDifference {
                boot: number,
                tick: record.tick,
                time_us: record.sample.time_us,
                field,
                recorded,
                replayed,
            }),
        })
    }
}

/// The first gap in the records of a boot: the number of records before the gap, and the missing ticks.
fn gap(records: &[FlightRecord]) -> Option<(usize, u32, u32)> {
    let wrong = |(record, expected): &(&FlightRecord, u32)| record.tick != *expected;
    let whole = records.iter().zip(1..).position(|pair| wrong(&pair))?;
    Some((whole, whole as u32 + 1, records[whole].tick.saturating_sub(1)))
}
