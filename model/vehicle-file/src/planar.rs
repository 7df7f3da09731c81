//! The fields of a file that describes the planar vehicle alone.

use model::vehicle::{Field, LeftOut};

/// The nondimensional planar vehicle.
pub(crate) const PLANAR_FIELDS: [Field; 6] = {
    const fn field(name: &'static str, meaning: &'static str, [min, max]: [f64; 2], left_out: LeftOut) -> Field {
        Field {
            name,
            meaning,
            min,
            max,
            left_out,
            whole: false,
            choices: &[],
        }
    }
    [
        field("l", "l / r", [0.001, 100.0], LeftOut::Refused),
        field("alpha", "m / (M + m)", [0.000_001, 0.999_999], LeftOut::Refused),
        field("zeta", "total damping", [0.0, 1000.0], LeftOut::Refused),
        field("mu", "wheel inertia", [0.0, 100.0], LeftOut::Refused),
        field("nu", "reflected rotor inertia", [0.0, 100.0], LeftOut::Value(0.0)),
        field("beta", "slope, rad", [-1.5, 1.5], LeftOut::Value(0.0)),
    ]
};
