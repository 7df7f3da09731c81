//! The laws' terms as curves, each group with its sum: errors of a sum become visible next to its terms.

use virtual_board::scenario::trace::Value;

/// Speed law, V at both drive motors.
pub(super) const SPEED_TERMS: &[(&str, Value)] = &[
    ("sum", |r| f64::from(r.status.terms.speed.sum_v())),
    ("feed-forward", |r| f64::from(r.status.terms.speed.feed_forward_v)),
    ("weight", |r| f64::from(r.status.terms.speed.weight_v)),
    ("speed feedback", |r| f64::from(r.status.terms.speed.speed_feedback_v)),
    ("swing rate", |r| f64::from(r.status.terms.speed.swing_rate_v)),
    ("swing damping", |r| f64::from(r.status.terms.speed.swing_damping_v)),
    ("friction", |r| f64::from(r.status.terms.speed.friction_v)),
    ("guard", |r| f64::from(r.status.terms.speed.guard_v)),
    ("trim", |r| f64::from(r.status.terms.speed.trim_v)),
    ("governed", |r| f64::from(r.status.terms.speed.governed_v)),
];

/// Steering law, V between the drive motors.
pub(super) const STEERING_TERMS: &[(&str, Value)] = &[
    ("sum", |r| f64::from(r.status.terms.steering.sum_v())),
    ("feed-forward", |r| f64::from(r.status.terms.steering.feed_forward_v)),
    ("proportional", |r| f64::from(r.status.terms.steering.proportional_v)),
    ("integral", |r| f64::from(r.status.terms.steering.integral_v)),
    ("hold", |r| f64::from(r.status.terms.steering.hold_v)),
];

/// Spar law, V at the ballast motor.
pub(super) const SPAR_TERMS: &[(&str, Value)] = &[
    ("sum", |r| f64::from(r.status.terms.spar.sum_v())),
    ("spar", |r| f64::from(r.status.terms.spar.spar_v)),
    ("ballast", |r| f64::from(r.status.terms.spar.ballast_v)),
    ("spar rate", |r| f64::from(r.status.terms.spar.spar_rate_v)),
    ("ballast rate", |r| f64::from(r.status.terms.spar.ballast_rate_v)),
    ("feed-forward", |r| f64::from(r.status.terms.spar.feed_forward_v)),
];
