//! The virtual board's hardware: implements the firmware's hardware traits on the plant.

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

use embassy_time::Instant;
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};
use firmware::drive_board::{DUTY_MAX_PERCENT, WATCHDOG_US};
use firmware::flight_record::{FlightRecord, Recorder};
use firmware::hardware::{
    AnalogInputs, Bridges, CycleCounter, EmergencyStop, EncoderCounters, Indicators, Place, Watchdog,
};
use model::analog::Analog;
use model::control::motor::DUTY_FULL_SCALE;
use model::sample::{Actuation, MOTORS};

use plant::icm42688p::Icm42688pModel;
use plant::{BridgeState, Plant};

/// State of the emergency stop's second contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SecondContact {
    /// The contact opens with the first contact and trips the bridges' break.
    Follows,
    /// The contact is welded shut and never opens.
    Welded,
    /// The contact's wire is broken, which trips the bridges' break.
    Open,
}

/// The plant, and everything on the board except the firmware.
#[derive(Debug)]
#[allow(clippy::struct_excessive_bools)] // Independent facts, not the states of one thing.
pub struct World {
    /// The physical vehicle.
    pub plant: Plant,
    /// States of the lamps: armed, faulted.
    pub lamps: (bool, bool),
    /// The records of the ticks since the last call that took them; `None` while no records are kept.
    pub records: Option<Vec<FlightRecord>>,
    /// Whether a host may read the stream of records or the records before an event.
    pub records_for_host: bool,
    /// Whether the emergency stop's first contact is open, which the firmware reads.
    emergency_stop: bool,
    second_contact: SecondContact,
    synced_us: u64,
    bridges: [BridgeState; MOTORS],
    break_tripped: bool,
    fed_us: u64,
    unpowered: bool,
}

impl World {
    /// The world at time 0.
    pub fn new(plant: Plant) -> Self {
        Self {
            plant,
            lamps: (false, false),
            records: None,
            records_for_host: true,
            emergency_stop: false,
            second_contact: SecondContact::Follows,
            synced_us: 0,
            bridges: [BridgeState::Open; MOTORS],
            break_tripped: false,
            fed_us: 0,
            unpowered: false,
        }
    }

    /// Advances the plant to the present time with the bridges' present states.
    #[inline]
    pub fn sync(&mut self, now_us: u64) {
        if now_us > self.synced_us {
            self.catch_up(now_us);
        }
    }

    /// Advances the plant. Not inlined: of the many calls within one instant only the first reaches this
    /// function.
    #[inline(never)]
    fn catch_up(&mut self, now_us: u64) {
        self.plant
            .advance((now_us - self.synced_us) as f64 * 1e-6, &self.bridges);
        self.synced_us = now_us;
        if !self.plant.powers_board() {
            // Without its controller a bridge is open.
            self.unpowered = true;
            self.bridges = [BridgeState::Open; MOTORS];
        }
        if self.plant.bridge_shut_down() {
            self.trip();
        }
    }

    /// Converts the present analogue inputs. The plant need not advance to the middle of the tick for that.
    #[inline]
    fn analog(&mut self, now_us: u64) -> Analog<u16> {
        let since_s = now_us.saturating_sub(self.synced_us) as f64 * 1e-6;
        if let Some(converted) = self.plant.analog_after(since_s, &self.bridges) {
            return converted;
        }
        self.sync(now_us);
        self.plant.analog()
    }

    /// Whether the supply has failed since the board last booted.
    pub fn unpowered(&self) -> bool {
        self.unpowered
    }

    /// Starts the board as after power-up, with its clock at 0, if the supply allows. Returns whether the board
    /// started.
    pub(super) fn power_up(&mut self) -> bool {
        if !self.plant.powers_board() {
            return false;
        }
        self.reset();
        true
    }

    /// Resets the board's part, with its clock at 0: the bridges open, and no latch is set whose input is
    /// inactive.
    pub(super) fn reset(&mut self) {
        self.unpowered = false;
        self.break_tripped = self.break_input();
        self.bridges = [BridgeState::Open; MOTORS];
        self.lamps = (false, false);
        self.synced_us = 0;
        self.fed_us = 0;
    }

    /// Presses or releases the emergency stop. As on the board, the stop also trips the bridges' break.
    pub fn press_stop(&mut self, pressed: bool) {
        self.set_stop(pressed, self.second_contact);
    }

    /// Puts both contacts of the emergency stop: the first is open where the stop is `pressed`. The break trips as soon as its
    /// wire is high, and stays tripped as long as it is.
    pub fn set_stop(&mut self, pressed: bool, second_contact: SecondContact) {
        (self.emergency_stop, self.second_contact) = (pressed, second_contact);
        if self.break_input() {
            self.trip();
        }
    }

    /// Trips the hardware break, which opens the bridges without the firmware.
    pub fn trip(&mut self) {
        self.break_tripped = true;
        self.bridges = [BridgeState::Open; MOTORS];
    }

    /// Whether the break's wire is high, because the stop's second contact is open or a bridge asserts its fault
    /// output.
    fn break_input(&self) -> bool {
        if self.plant.bridge_shut_down() {
            return true;
        }
        match self.second_contact {
            SecondContact::Follows => self.emergency_stop,
            SecondContact::Welded => false,
            SecondContact::Open => true,
        }
    }

    /// Whether any bridge is on.
    pub fn bridges_on(&self) -> bool {
        self.bridges.iter().any(|bridge| *bridge != BridgeState::Open)
    }

    /// Whether the watchdog has expired at `now_us`.
    pub fn watchdog_expired(&self, now_us: u64) -> bool {
        now_us.saturating_sub(self.fed_us) > u64::from(WATCHDOG_US)
    }
}

/// A handle on the world for one part of the board's hardware.
#[derive(Debug, Clone)]
pub struct Hardware(pub Rc<RefCell<World>>);

impl Hardware {
    /// Calls `act` with the world at the present time.
    pub fn now<R>(&self, act: impl FnOnce(&mut World) -> R) -> R {
        let mut world = self.0.borrow_mut();
        world.sync(Instant::now().as_micros());
        act(&mut world)
    }
}

impl EncoderCounters for Hardware {
    fn counts(&mut self) -> [u16; MOTORS] {
        self.now(|world| world.plant.counters())
    }
}

impl AnalogInputs for Hardware {
    type Error = Infallible;

    async fn read(&mut self) -> Result<Analog<u16>, Infallible> {
        Ok(self.0.borrow_mut().analog(Instant::now().as_micros()))
    }
}

impl EmergencyStop for Hardware {
    fn is_pressed(&mut self) -> bool {
        self.now(|world| world.emergency_stop)
    }
}

/// The bridge state of a duty, which the board's shortest pulses limit.
fn bridge(duty: i16) -> BridgeState {
    let duty_max = f64::from(DUTY_MAX_PERCENT) / 100.0;
    BridgeState::Duty((f64::from(duty) / f64::from(DUTY_FULL_SCALE)).clamp(-duty_max, duty_max))
}

impl Bridges for Hardware {
    fn apply(&mut self, actuation: &Actuation) {
        self.now(|world| {
            world.bridges = if actuation.enable && !world.break_tripped && !world.unpowered {
                actuation.duty.map(bridge)
            } else {
                [BridgeState::Open; MOTORS]
            };
        });
    }

    fn break_tripped(&mut self) -> bool {
        self.now(|world| world.break_tripped)
    }

    fn break_input_active(&mut self) -> bool {
        self.now(|world| world.break_input())
    }

    fn clear_break(&mut self) {
        self.now(|world| world.break_tripped = world.break_input());
    }
}

impl Watchdog for Hardware {
    fn feed(&mut self) {
        self.now(|world| world.fed_us = Instant::now().as_micros());
    }
}

impl Indicators for Hardware {
    fn show(&mut self, armed: bool, faulted: bool) {
        self.now(|world| world.lamps = (armed, faulted));
    }
}

impl Recorder for Hardware {
    fn record(&mut self, record: &FlightRecord) {
        if let Some(records) = &mut self.0.borrow_mut().records {
            records.push(*record);
        }
    }

    fn for_host(&self) -> bool {
        self.0.borrow().records_for_host
    }
}

/// A cycle counter that does not count, because a tick's cost on the host does not show the cost on the board.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoCycles;

impl CycleCounter for NoCycles {
    fn cycles(&self) -> u32 {
        0
    }
}

/// The SPI device of one IMU.
#[derive(Debug, Clone)]
pub struct VirtualImu {
    hardware: Hardware,
    place: Place,
}

impl VirtualImu {
    /// The IMU at `place`.
    pub fn new(hardware: Hardware, place: Place) -> Self {
        Self { hardware, place }
    }
}

impl ErrorType for VirtualImu {
    type Error = Infallible;
}

/// Number of frames of the firmware's burst.
const BURST_FRAMES: usize = 8;

/// Exchanges frames with the part. A bus without a part floats high.
fn exchange_frames(chip: Option<&mut Icm42688pModel>, frames: &mut [u16]) {
    let Some(chip) = chip else {
        frames.fill(u16::MAX);
        return;
    };
    let (bursts, rest) = frames.as_chunks_mut::<BURST_FRAMES>();
    for burst in bursts {
        chip.exchange_frames(burst);
    }
    for frame in rest {
        chip.exchange_frames(std::array::from_mut(frame));
    }
}

/// Performs any operations while the part is selected.
#[cold]
fn operate(mut chip: Option<&mut Icm42688pModel>, operations: &mut [Operation<'_, u16>]) {
    let mut exchange = |frames: &mut [u16]| exchange_frames(chip.as_deref_mut(), frames);
    for operation in operations {
        match operation {
            Operation::Read(frames) => {
                frames.fill(0);
                exchange(frames);
            }
            Operation::Write(frames) => frames.iter().for_each(|frame| exchange(&mut [*frame])),
            Operation::Transfer(read, write) => {
                for i in 0..read.len().max(write.len()) {
                    let mut frame = [write.get(i).copied().unwrap_or(0)];
                    exchange(&mut frame);
                    if let Some(slot) = read.get_mut(i) {
                        [*slot] = frame;
                    }
                }
            }
            Operation::TransferInPlace(frames) => exchange(frames),
            Operation::DelayNs(_) => {}
        }
    }
}

impl SpiDevice<u16> for VirtualImu {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u16>]) -> Result<(), Infallible> {
        self.hardware.now(|world| {
            let mut chip = match self.place {
                Place::Arm => Some(world.plant.arm_imu()),
                Place::Spar => world.plant.spar_imu(),
            };
            if let Some(chip) = &mut chip {
                chip.select();
            }
            match (&mut chip, operations) {
                // The burst with which every tick reads the data.
                (Some(chip), [Operation::TransferInPlace(frames)]) if frames.len() == BURST_FRAMES => {
                    if let Some(burst) = frames.first_chunk_mut::<BURST_FRAMES>() {
                        chip.exchange_frames(burst);
                    }
                }
                (chip, operations) => operate(chip.as_deref_mut(), operations),
            }
            if let Some(chip) = chip {
                chip.deselect();
            }
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_duty_goes_beyond_the_bridges_largest() {
        let most = f64::from(DUTY_MAX_PERCENT) / 100.0;
        assert_eq!(bridge(i16::MAX), BridgeState::Duty(most));
        assert_eq!(bridge(i16::MIN), BridgeState::Duty(-most));
        assert_eq!(bridge(0), BridgeState::Duty(0.0));
        assert_eq!(bridge(16384), BridgeState::Duty(16384.0 / 32767.0));
    }
}
