//! A file's records through the same step again.

use firmware::drive_board::SCALES;
use model::status::Status;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use record_file::parse;
use serde::Serialize;
use virtual_board::records::{RecordFile, first_field};

/// The records of a file, driven again by a vehicle that starts anew.
pub struct PageReplay {
    file: RecordFile,
    core: VehicleCore,
    next: usize,
    differs: Option<String>,
}

/// Some ticks of a replay.
#[derive(Debug, Serialize)]
pub struct Replayed {
    /// Every tenth status.
    statuses: Vec<Status>,
    /// Ticks done and ticks of the file.
    ticks: [usize; 2],
    /// Where the replay drives otherwise than the record, in words.
    differs: Option<String>,
    lost_blocks: u32,
    unreadable: u32,
}

impl PageReplay {
    /// Opens the bytes of a file of frames or of an MCAP file; `vehicle` is the text of the vehicle file in force when it was
    /// recorded, for a file that does not tell it itself.
    ///
    /// # Errors
    /// What is wrong with the file or the vehicle.
    pub fn open(bytes: &[u8], vehicle: &str) -> Result<Self, String> {
        let read = parse(bytes).map_err(|error| error.to_string())?;
        if let Some(first) = read.file.records.first().filter(|first| first.tick > 1) {
            return Err(format!(
                "the records begin with tick {}: what the vehicle knew by then is not in them, and a replay begins \
                 with the board's boot. Start the recording within 2 s of the boot",
                first.tick
            ));
        }
        let vehicle = match read.vehicle {
            Some(vehicle) => Ok(vehicle),
            None if vehicle.is_empty() => vehicle_file::reference(),
            None => vehicle_file::parse_vehicle_for("vehicle file", vehicle, &SCALES.sensor_ranges()),
        };
        let vehicle = vehicle.map_err(|error| error.to_string())?;
        let vehicle = Vehicle::new(vehicle.parameters().cast::<f32>()).map_err(|error| error.to_string())?;
        Ok(Self {
            file: read.file,
            core: VehicleCore::new(&vehicle, &SCALES),
            next: 0,
            differs: None,
        })
    }

    /// Drives up to `ticks` further ticks. A gap in the records ends the replay.
    pub fn step(&mut self, ticks: usize) -> Replayed {
        let mut statuses = Vec::new();
        let until = self.next.saturating_add(ticks).min(self.file.records.len());
        while self.next < until {
            let record = &self.file.records[self.next];
            if self.next > 0 && record.tick != self.file.records[self.next - 1].tick.wrapping_add(1) {
                let told = format!("ticks before tick {} are missing: the replay ends here", record.tick);
                self.differs.get_or_insert(told);
                self.file.records.truncate(self.next);
                break;
            }
            let output = self.core.step(&record.sample, &record.command);
            if self.differs.is_none()
                && let Some((field, recorded, replayed)) = first_field(record.actuation, output.actuation)
            {
                self.differs = Some(format!(
                    "differs first in tick {} ({:.3} s): {field} is {replayed}, the record has {recorded}",
                    record.tick,
                    record.sample.time_us as f64 * 1e-6
                ));
            }
            if self.next.is_multiple_of(10) {
                statuses.push(output.status);
            }
            self.next += 1;
        }
        Replayed {
            statuses,
            ticks: [self.next, self.file.records.len()],
            differs: self.differs.clone(),
            lost_blocks: self.file.lost_blocks,
            unreadable: self.file.unreadable,
        }
    }
}
