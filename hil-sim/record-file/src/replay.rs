//! The records of a file through the same step again, boot by boot: each begins with a core that knows nothing.

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
    /// The vehicle that the firmware was given.
    pub vehicle: Vehicle<f32>,
    /// Its records in order.
    pub records: R,
}

/// Ticks that the records of a boot lack, the last one included: its replay ends before them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MissingTicks {
    /// Number of the boot in the file, from 1; none in a file of one boot.
    pub boot: Option<usize>,
    /// The first of them.
    pub from: u32,
    /// The last of them.
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

/// The first tick whose replay drives otherwise, in the actuation's first field that differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReplayDifference {
    /// Number of the boot in the file, from 1.
    pub boot: usize,
    /// The tick.
    pub tick: u32,
    /// When, us since that boot.
    pub time_us: u64,
    /// What differs.
    pub field: &'static str,
    /// Its value in the record.
    pub recorded: i32,
    /// Its value in the replay.
    pub replayed: i32,
}

/// One tick of a replay.
#[derive(Debug)]
pub struct ReplayedTick {
    /// Number of its boot in the file, from 1.
    pub boot: usize,
    /// What the vehicle reports.
    pub status: Status,
    /// Where it drives otherwise than the record.
    pub difference: Option<ReplayDifference>,
}

/// A replay under way.
pub struct Replay<R> {
    boots: Vec<BootToReplay<R>>,
    /// How many records of each boot are replayed.
    ticks: Vec<usize>,
    missing: Vec<MissingTicks>,
    /// The boot and the record in it that are next.
    boot: usize,
    next: usize,
    core: Option<VehicleCore>,
}

impl<R: AsRef<[FlightRecord]>> Replay<R> {
    /// A replay of these boots, each from its first tick up to the first tick that it lacks.
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

    /// What the boots lack, at most one gap each.
    pub fn missing(&self) -> &[MissingTicks] {
        &self.missing
    }

    /// How many ticks of each boot are replayed.
    pub fn ticks(&self) -> &[usize] {
        &self.ticks
    }

    /// The boot of the next tick, from 1; none at the end.
    pub fn next_boot(&self) -> Option<usize> {
        let done = |boot: usize| if boot == self.boot { self.next } else { 0 };
        let mut rest = (self.boot..self.ticks.len()).filter(|boot| self.ticks[*boot] > done(*boot));
        rest.next().map(|boot| boot + 1)
    }

    /// Drives the next tick; none at the end.
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

/// The first gap in the records of a boot: how many records stand before it, and the ticks that are missing.
fn gap(records: &[FlightRecord]) -> Option<(usize, u32, u32)> {
    let wrong = |(record, expected): &(&FlightRecord, u32)| record.tick != *expected;
    let whole = records.iter().zip(1..).position(|pair| wrong(&pair))?;
    Some((whole, whole as u32 + 1, records[whole].tick.saturating_sub(1)))
}
