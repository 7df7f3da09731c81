//! Conditions between the values of a vehicle's parameters, in addition to each parameter's range: the
//! rules that [`Vehicle::new`](super::Vehicle::new) and
//! [`Vehicle::check_on`](super::Vehicle::check_on) apply, in the order of their check.

/// A rule between values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Relation {
    /// The group (table of the vehicle file) of the field to change.
    pub group: &'static str,
    /// The field to change.
    pub field: &'static str,
    /// The condition.
    pub rule: &'static str,
    /// The reason for the condition.
    pub why: &'static str,
}

/// alpha is below 1.
pub const ARM_MASS: Relation = Relation {
    group: "body",
    field: "arm_mass_kg",
    rule: "must be less than total_mass_kg, so that alpha = arm_mass_kg / total_mass_kg is between 0 and 1",
    why: "the wheels have mass",
};
/// The minimum voltage is below the nominal voltage.
pub const MINIMUM_VOLTAGE: Relation = Relation {
    group: "battery",
    field: "minimum_v",
    rule: "must be less than nominal_v",
    why: "a full battery arms",
};
/// The vehicle may drive with a full battery.
pub const MAXIMUM_VOLTAGE: Relation = Relation {
    group: "battery",
    field: "nominal_v",
    rule: "must be less than maximum_v",
    why: "a full battery arms",
};
/// The drive motors' current limit is below the fault limit.
pub const DRIVE_CURRENT: Relation = Relation {
    group: "drive_motor",
    field: "current_limit_a",
    rule: "must be less than safety.overcurrent_a",
    why: "a motor at its current limit must not cause the fault",
};
/// The ballast motor's current limit is below the fault limit.
pub const BALLAST_CURRENT: Relation = Relation {
    group: "ballast_motor",
    ..DRIVE_CURRENT
};
/// Eq. 3.25 is stable (erratum E2).
pub const SPEED_GAIN: Relation = Relation {
    group: "control",
    field: "kp",
    rule: "must be less than the total damping zeta, or Eq. 3.25 is unstable",
    why: "where law = \"eq-3.25\" (erratum E2); the landing law reads no kp",
};
/// The spar is stable (erratum E28).
pub const SPAR_GAINS: Relation = Relation {
    group: "spar",
    field: "spar_gain",
    rule: "with the other three gains it must hold this spar; set all four to 0 and ask `hil-sim lqr --vehicle FILE` for gains \
           that do",
    why: "others drop it: (7.21) as printed does (erratum E28)",
};
/// The sensors can measure the voltage limit.
pub const MEASURED_VOLTAGE: Relation = Relation {
    group: "battery",
    field: "maximum_v",
    rule: "must be at most what the board's voltage sensor measures",
    why: "the fault would never be seen",
};
/// The sensors can measure the current limit.
pub const MEASURED_CURRENT: Relation = Relation {
    group: "safety",
    field: "overcurrent_a",
    rule: "must be at most what the board's current sensors measure",
    why: "the fault would never be seen",
};

/// Every rule.
pub const RELATIONS: [Relation; 9] = [
    ARM_MASS,
    MINIMUM_VOLTAGE,
    MAXIMUM_VOLTAGE,
    DRIVE_CURRENT,
    BALLAST_CURRENT,
    SPEED_GAIN,
    SPAR_GAINS,
    MEASURED_VOLTAGE,
    MEASURED_CURRENT,
];
