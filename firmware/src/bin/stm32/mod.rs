//! What every STM32 board shares: the hardware behind the application's traits, start-up, and what a part does when its
//! program dies.
//!
//! A board includes this folder as a module of its own and gives it, beside itself, `clocks` (the timers' clock, the
//! encoders' filter, whether the external clock stopped), `core_supply` (what the core's voltage needs before the RAM is
//! written), `flash` (the part's flash as `PartFlash`, with what cleans up and reads), `part` (what the self-test asks of the
//! part), `reset_cause`, its `AnalogSequence` with `SAMPLES_AFTER_TRIGGER_NS`, its watchdog as `BoardWatchdog`, and
//! `IMU_CLOCK`. What is missing does not compile. The port guide has the table.

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
