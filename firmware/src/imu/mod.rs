//! The two IMUs, on the arm and on the spar: the part's driver, and the task that serves one of them.

pub mod driver;
pub mod task;

pub use task::run;
