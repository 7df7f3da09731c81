//! The landing law: a speed law near the physical limit.
//!
//! The arm is brought to the angle that gives the wanted acceleration, and home again, by a fast servo. What makes
//! that simple is the *landing speed*: the speed that will be left once the servo has brought the arm home. Fed back
//! instead of the present speed, it has no swing in it. Derivations, guarantees and their assumptions: docs/control.md.
//!
//! Nondimensional inside (forces over (M+m) g, torques over (M+m) g r, time sqrt(r/g)), SI at the edges.

mod balance;
mod command;
mod design;
mod governor;
mod law;
mod limits;
mod observer;
mod obstacle;
mod refusal;
mod standing;

pub use balance::{Affine, Balance, MotionByTorque};
pub use design::Design;
pub use governor::{Barrier, Interval, grip};
pub use law::{LandingLaw, MOTION_STATES, SUPPLY_RESERVE, SUPPLY_SHARE};
