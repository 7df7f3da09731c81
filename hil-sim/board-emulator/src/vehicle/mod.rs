//! What moves around the board, and the parameters by which the firmware knows it.

mod bench;
mod closed_plant;
mod plant;
pub mod stored;

pub use bench::BenchVehicle;
pub use closed_plant::ClosedPlant;
pub use plant::VehicleAtPins;
