//! The landing law: a speed law near the physical limit.
//!
//! A fast servo brings the arm to the angle that gives the wanted acceleration, and home again. The law feeds back the
//! *landing speed* instead of the present speed: the speed that will be left once the servo has brought the arm home.
//! The landing speed has no swing in it, which makes the law simple. Derivations, guarantees and their assumptions:
//! docs/control.md.
//!
//! Nondimensional inside (forces over (M+m) g, torques over (M+m) g r, time sqrt(r/g)), SI at the edges.

mod attempts;
mod balance;
mod chatter;
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
pub(in crate::control) use limits::{GRIP_SHARE, STEADY_SHARE};
