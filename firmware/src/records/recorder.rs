//! The recorder of the control task: it records every tick in a block, and a fault freezes the
//! look-back.

use embassy_sync::blocking_mutex::raw::RawMutex;
use model::status::Status;
use model::supervise::arming::Mode;
use model::supervise::codes::FaultSet;

use super::codec::BlockEncoder;
use super::ring::RecordRings;
use crate::flight_record::FlightRecord;

/// Number of ticks that the look-back still records after a fault, because it should contain the
/// fault's effect.
const AFTER_FAULT_TICKS: u32 = 200;

/// Records every tick.
#[derive(Debug)]
pub struct TickRecorder {
    encoder: BlockEncoder,
    mode: Mode,
    faults: FaultSet,
    /// Ticks until the look-back freezes after a fault.
    freezes_in: Option<u32>,
}

impl TickRecorder {
    /// Nothing recorded.
    pub fn new() -> Self {
        Self {
            encoder: BlockEncoder::new(),
            mode: Mode::Disarmed,
            faults: FaultSet::EMPTY,
            freezes_in: None,
        }
    }

    /// Records a tick and its status.
    pub fn record<M: RawMutex>(&mut self, rings: &RecordRings<M>, record: &FlightRecord, status: &Status) {
        if status.mode == Mode::Armed && self.mode == Mode::Disarmed {
            // A new drive.
            rings.restart();
            self.freezes_in = None;
        }
        self.encoder.push(record, |block| rings.push(block));
        let new = status.faults.bits() & !self.faults.bits() != 0;
        if new && self.freezes_in.is_none() {
            self.freezes_in = Some(AFTER_FAULT_TICKS);
        }
        match self.freezes_in {
            Some(0) => {
                self.encoder.flush(|block| rings.push(block));
                rings.freeze();
                self.freezes_in = None;
            }
            Some(ticks) => self.freezes_in = Some(ticks - 1),
            None => {}
        }
        self.mode = status.mode;
        self.faults = status.faults;
    }
}

impl Default for TickRecorder {
    fn default() -> Self {
        Self::new()
    }
}
