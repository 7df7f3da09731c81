//! Code that all STM32 boards share: the hardware behind the application's traits, start-up, and the reaction to a
//! crash.
//!
//! A board includes this folder as one of its modules and provides `clocks` (the timers' clock, the encoders' filter,
//! whether the external clock stopped), `core_supply` (the wait for the core's voltage before the RAM is written),
//! `flash` (the part's flash as `PartFlash`, with its functions for reading and cleaning up), `part` (the self-test's
//! checks of the part), `reset_cause`, its `AnalogSequence` with `SAMPLES_AFTER_TRIGGER_NS`, its watchdog as
//! `BoardWatchdog`, and `IMU_CLOCK`. A board that lacks one of these does not compile. The port guide has the table.

pub mod boot_number;
mod bridges;
mod control_executor;
pub mod crash;
mod cycle_counter;
pub mod encoders;
mod flight_record;
mod image;
pub mod imu;
mod lamps;
pub mod link;
mod parts;
mod ram;
mod restart;
pub mod self_test;
pub mod storage;
pub mod supply;
mod switches;
mod watchdog;

pub use bridges::{BridgePins, MotorBridges};
pub use control_executor::start as start_control_executor;
pub use cycle_counter::CoreCycles;
pub use encoders::QuadratureCounters;
pub use flight_record::FlightRecorder;
pub use imu::ImuDevice;
pub use lamps::Lamps;
pub use parts::Board;
pub use restart::SystemReset;
pub use storage::Region;
pub use switches::{StopContact, UserButton};
pub use watchdog::{RunningWatchdog, WatchdogAtRest};
