//! Scenarios: the ground and the faults that the vehicle meets, the operator's actions, and the bounds of the
//! metrics.
//!
//! A scenario is a TOML file and a test at once: each of its metrics has a lower and an upper bound, so a
//! dead simulation fails, too. A scenario runs on any backend: the virtual board, or the release ELF on the
//! emulated board.

pub mod backend;
mod bound;
pub mod bounds_of;
pub mod error;
pub mod file;
mod glances;
pub mod judge;
pub mod judged;
pub mod metrics;
mod nearest;
mod observer;
pub mod outcome;
mod reading;
pub mod run;
pub mod sensor;
pub mod setup;
pub mod shipped;
pub mod step;
pub mod story;
mod tables;
pub mod trace;
pub mod wire;
pub mod world;

pub use backend::{Backend, Observation, VirtualBackend};
pub use bounds_of::BoundsOf;
pub use error::ScenarioError;
pub use file::{Scenario, ScenarioSource};
pub use judge::{Check, RunVerdict, evaluate, failures, judge, shown};
pub use judged::{JudgedRun, run_judged};
pub use metrics::{MetricValue, Metrics};
pub use outcome::{Counts, DriveOutcome, RunEnd};
pub use run::{RunError, run, run_into, run_watched};
pub use sensor::Sensor;
pub use step::{Action, Step};
pub use story::{EventKind, GAP_S, RunStory, Sight, Story, StoryEvent};
