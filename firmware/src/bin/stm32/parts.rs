//! The parts that every board passes to the application.

use firmware::hardware::{ClockSource, ResetCause};
use model::supervise::codes::BlockerSet;

use super::bridges::MotorBridges;
use super::crash::LastWords;
use super::cycle_counter::CoreCycles;
use super::encoders::QuadratureCounters;
use super::flight_record::FlightRecorder;
use super::imu::ImuDevice;
use super::lamps::Lamps;
use super::link::{LinkReceiver, LinkSender};
use super::storage::Regions;
use super::switches::{StopContact, UserButton};
use super::watchdog::WatchdogAtRest;
use crate::board::AnalogSequence;

/// All hardware that the application needs.
pub struct Board {
    /// Why the part started.
    pub reset_cause: ResetCause,
    /// The source of the part's clocks.
    pub clock: ClockSource,
    /// A number that differs from boot to boot.
    pub boot_number: u32,
    /// The message of the last run, if a panic or a fault ended it.
    pub last_words: Option<LastWords>,
    /// Motor bridges, open.
    pub bridges: MotorBridges,
    /// Motor encoders.
    pub encoders: QuadratureCounters,
    /// IMU on the arm.
    pub arm_imu: ImuDevice,
    /// IMU on the spar.
    pub spar_imu: ImuDevice,
    /// Battery and currents.
    pub analog: AnalogSequence,
    /// Emergency stop.
    pub emergency_stop: StopContact,
    /// Watchdog, not yet started; the task that feeds it starts it.
    pub watchdog: WatchdogAtRest,
    /// Cycle counter, running.
    pub cycles: CoreCycles,
    /// Armed and faulted lamps.
    pub lamps: Lamps,
    /// Keeper of the last tick's record.
    pub flight_recorder: FlightRecorder,
    /// The board's button.
    pub user_button: UserButton,
    /// Host link, out.
    pub link_sender: LinkSender,
    /// Host link, in.
    pub link_receiver: LinkReceiver,
    /// The stores in the flash.
    pub regions: Regions,
    /// Findings of the self-test.
    pub blockers: BlockerSet,
    /// Checksum of the running image, from its seal.
    pub image_checksum: u32,
}
