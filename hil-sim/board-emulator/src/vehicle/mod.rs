//! The vehicle around the board, and the parameters with which the firmware describes it.

mod bench;
mod closed_plant;
mod plant;
pub mod stored;

pub use bench::BenchVehicle;
pub use closed_plant::ClosedPlant;
pub use plant::VehicleAtPins;
