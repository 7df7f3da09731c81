//! The stream of records into a file, and a file's records through the same step again.

use std::collections::VecDeque;

use firmware::drive_board::SCALES;
use firmware::protocol::frame::encode;
use firmware::protocol::message::{BoardMessage, Identity, PROTOCOL_VERSION};
use firmware::records::codec::{RecordBlock, Records};
use model::status::Status;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use serde::Serialize;
use virtual_board::records::{RecordFile, first_field};

/// Most bytes of a recording: half an hour's drive has about 50 MB.
const RECORDING_MAX: usize = 64 << 20;

/// A recording under way, as the file that `hil-sim replay` reads.
#[derive(Debug, Default)]
pub struct Recording {
    file: Vec<u8>,
    next: Option<u32>,
    /// What is recorded so far.
    pub counts: RecordingCounts,
}

/// What is recorded.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct RecordingCounts {
    /// Ticks recorded.
    pub ticks: u64,
    /// Blocks that the board made and that did not arrive.
    pub lost_blocks: u32,
    /// Bytes of the file.
    pub bytes: usize,
    /// There is no room for more.
    pub full: bool,
}

impl Recording {
    /// A recording of this board.
    pub fn begin(identity: &Identity) -> Self {
        let mut recording = Self::default();
        recording.write(&BoardMessage::Identity(*identity));
        recording
    }

    /// Takes the blocks that have come.
    pub fn take(&mut self, blocks: &mut VecDeque<RecordBlock>) {
        for block in blocks.drain(..) {
            if self.file.len() > RECORDING_MAX {
                self.counts.full = true;
                return;
            }
            self.counts.lost_blocks += self.next.map_or(0, |next| block.number.wrapping_sub(next));
            self.next = Some(block.number.wrapping_add(1));
            self.counts.ticks += Records::new(&block.bytes).flatten().count() as u64;
            self.write(&BoardMessage::Records(block));
        }
    }

    /// The file as far as it goes.
    pub fn into_file(self) -> Vec<u8> {
        self.file
    }

    fn write(&mut self, message: &BoardMessage) {
        // What came in a frame fits one.
        if let Ok(frame) = encode(message) {
            self.file.extend(&frame);
            self.counts.bytes = self.file.len();
        }
    }
}

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
    /// Opens a file's bytes; `vehicle` is the text of the vehicle file in force when it was recorded.
    ///
    /// # Errors
    /// What is wrong with the file or the vehicle.
    pub fn open(bytes: &[u8], vehicle: &str) -> Result<Self, String> {
        let file = RecordFile::parse(bytes);
        if let Some(identity) = file.identity.filter(|identity| identity.protocol != PROTOCOL_VERSION) {
            return Err(format!(
                "records of protocol {}, this console reads {PROTOCOL_VERSION}",
                identity.protocol
            ));
        }
        match file.records.first() {
            None => return Err("no records in it".to_owned()),
            Some(first) if first.tick > 1 => {
                return Err(format!(
                    "the records begin with tick {}: what the vehicle knew by then is not in them, and a replay begins \
                     with the board's boot. Start the recording within 2 s of the boot",
                    first.tick
                ));
            }
            Some(_) => {}
        }
        let vehicle = if vehicle.is_empty() {
            vehicle_file::reference()
        } else {
            vehicle_file::parse_vehicle_for("vehicle file", vehicle, &SCALES.sensor_ranges())
        };
        let vehicle = vehicle.map_err(|error| error.to_string())?;
        let vehicle = Vehicle::new(vehicle.parameters().cast::<f32>()).map_err(|error| error.to_string())?;
        Ok(Self {
            file,
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
