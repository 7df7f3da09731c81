//! Replays a file's records through the same step.

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use model::status::Status;
use model::vehicle::Vehicle;
use record_file::replay::{BootToReplay, Replay};
use record_file::{ReadBoot, parse};
use serde::Serialize;

/// A replay of a file's records, with a new core for each boot.
pub struct PageReplay {
    replay: Replay<Vec<FlightRecord>>,
    done: usize,
    /// Ticks of the present boot.
    done_of_boot: usize,
    boot: usize,
    differs: Option<String>,
    lost_blocks: u32,
    unreadable: u32,
}

/// Consecutive ticks of a replay, all of one boot.
#[derive(Debug, Serialize)]
pub struct Replayed {
    /// Every tenth status.
    statuses: Vec<Status>,
    /// Number of the boot in the file, from 1, and the number of boots.
    boot: [usize; 2],
    /// Replayed ticks, and ticks of the file.
    ticks: [usize; 2],
    /// Where the replay differs from the record, or ends before it, as text.
    differs: Option<String>,
    lost_blocks: u32,
    unreadable: u32,
}

impl PageReplay {
    /// Opens the bytes of a file of frames or of an MCAP file; `vehicle` is the text of the
    /// vehicle file in force during the recording, for a file that does not contain it.
    ///
    /// # Errors
    /// The error in the file or the vehicle.
    pub fn open(bytes: &[u8], vehicle: &str) -> Result<Self, String> {
        let read = parse(bytes).map_err(|error| error.to_string())?;
        let first = read.records().next().map_or(0, |first| first.tick);
        let (lost_blocks, unreadable) = (read.lost_blocks, read.unreadable);
        let boots = read.boots.into_iter().filter(|boot| !boot.records.is_empty());
        let boots: Result<_, String> = boots.map(|boot| boot_to_replay(boot, vehicle)).collect();
        let replay = Replay::new(boots?);
        if replay.next_boot().is_none() {
            return Err(format!(
                "the records begin with tick {first}: what the vehicle knew by then is not in them, and a replay begins \
                 with the board's boot. Start the recording within 2 s of the boot"
            ));
        }
        Ok(Self {
            replay,
            done: 0,
            done_of_boot: 0,
            boot: 0,
            differs: None,
            lost_blocks,
            unreadable,
        })
    }

    /// Replays up to `ticks` further ticks, at most to the end of the boot.
    pub fn step(&mut self, ticks: usize) -> Replayed {
        let mut statuses = Vec::new();
        let boots = self.replay.ticks().len();
        for n in 0..ticks {
            if n > 0 && self.replay.next_boot() != Some(self.boot) {
                break;
            }
            let Some(tick) = self.replay.step() else { break };
            if tick.boot != self.boot {
                (self.boot, self.done_of_boot) = (tick.boot, 0);
            }
            if self.differs.is_none()
                && let Some(found) = tick.difference
            {
                let of_boot = if boots > 1 {
                    format!(" of boot {}", found.boot)
                } else {
                    String::new()
                };
                self.differs = Some(format!(
                    "differs first in tick {}{of_boot} ({:.3} s): {} is {}, the record has {}",
                    found.tick,
                    found.time_us as f64 * 1e-6,
                    found.field,
                    found.replayed,
                    found.recorded
                ));
            }
            if self.done_of_boot.is_multiple_of(10) {
                statuses.push(tick.status);
            }
            self.done_of_boot += 1;
            self.done += 1;
        }
        if self.replay.next_boot().is_none()
            && let Some(missing) = self.replay.missing().first()
        {
            self.differs.get_or_insert(missing.to_string());
        }
        Replayed {
            statuses,
            boot: [self.boot, boots],
            ticks: [self.done, self.replay.ticks().iter().sum()],
            differs: self.differs.clone(),
            lost_blocks: self.lost_blocks,
            unreadable: self.unreadable,
        }
    }
}

/// A boot with the vehicle of the file, else the vehicle of the text, else the reference vehicle.
fn boot_to_replay(boot: ReadBoot, vehicle: &str) -> Result<BootToReplay<Vec<FlightRecord>>, String> {
    let vehicle = match boot.vehicle {
        Some(vehicle) => Ok(vehicle),
        None if vehicle.is_empty() => vehicle_file::reference(),
        None => vehicle_file::parse_vehicle_for("vehicle file", vehicle, &SCALES.sensor_ranges()),
    };
    let vehicle = vehicle.map_err(|error| error.to_string())?;
    Ok(BootToReplay {
        vehicle: Vehicle::new(vehicle.parameters().cast::<f32>()).map_err(|error| error.to_string())?,
        records: boot.records,
    })
}
