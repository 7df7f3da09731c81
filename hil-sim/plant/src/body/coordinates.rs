//! The speeds of the bodies, by their indices.

use model::sample::MOTORS;

// The order is that of elimination: speeds with few couplings come first (see `ldl`). Of the wheels, which do not couple to
// each other, the right one is eliminated and summed first.
/// Index of the left wheel.
pub const LEFT: usize = 0;
/// Index of the right wheel.
pub const RIGHT: usize = 1;
/// Index of the ballast (absolute).
pub const BALLAST: usize = 2;
/// Index of the spar.
pub const SPAR: usize = 3;
/// Index of y (position) and of the speed to the left.
pub const SIDE: usize = 4;
/// Index of x (position) and of the forward speed.
pub const FORWARD: usize = 5;
/// Index of the height and of the speed off the plane.
pub const LIFT: usize = 6;
/// Index of heading and yaw rate.
pub const YAW: usize = 7;
/// Index of the arm.
pub const PHI: usize = 8;
/// The angles: positions whose rates are the speeds themselves.
pub(super) const ANGLES: [usize; 6] = [LEFT, RIGHT, BALLAST, SPAR, YAW, PHI];

/// Rows of the joints over the speeds, in the order of [`model::sample::Motor`].
pub(super) const JOINTS: [[(usize, f64); 2]; MOTORS] = [
    [(LEFT, 1.0), (PHI, 1.0)],
    [(RIGHT, 1.0), (PHI, 1.0)],
    [(BALLAST, 1.0), (SPAR, -1.0)],
];
