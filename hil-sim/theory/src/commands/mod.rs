//! The commands of the theory: one module per subcommand, and the flags they share.

pub mod body_arguments;
pub mod camera;
pub mod camera_arguments;
pub mod coupled;
pub mod critical;
pub mod envelope;
pub mod equilibrium;
pub mod figures;
pub mod kernel;
pub mod lqr;
pub mod planar_arguments;
pub mod si;
pub mod simulate;
pub mod slip_limit;
pub mod span;
pub mod spatial;
pub mod taken;
pub mod values;
pub mod vehicle_argument;
