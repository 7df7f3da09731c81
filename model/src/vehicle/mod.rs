//! The vehicle's parameters: measured SI values, checked once into [`Vehicle`], and the nondimensional numbers that the
//! laws use (3.10, 3.11, corrected).

use core::fmt;

use crate::board::SensorRanges;
use crate::real::Real;

pub mod fields;
mod gravity;
mod groups;
mod models;
mod parameters;
mod relations;
mod renamed;
mod rules;
mod scales;
#[cfg(test)]
pub(crate) mod test_vehicle;

pub use fields::{Field, LeftOut, NotSet, OutOfRange, Rule};
pub(crate) use gravity::G;
pub use gravity::GRAVITY_M_S2;
pub use groups::{Table, VehicleParameters};
pub use parameters::{
    BatteryParameters, BodyParameters, ControlParameters, EstimatorParameters, ImuParameters, MotorParameters,
    SafetyParameters, SparParameters,
};
pub use relations::{RELATIONS, Relation};
pub use renamed::RENAMED;
pub use rules::{BRIDGE_SHARE, TurningDrive};
pub use scales::{Scales, SparScales};

/// The speed laws that a vehicle file can name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpeedLawChoice {
    /// Eq. 3.25 with its additions, `eq-3.25`.
    SwingDamped,
    /// The landing law, `landing`.
    Landing,
}

/// Why a set of parameters does not describe a vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParameterError {
    /// A value is out of its range.
    OutOfRange(OutOfRange),
    /// Two values contradict each other.
    Inconsistent {
        /// The group (table of the vehicle file).
        group: &'static str,
        /// The field to change.
        field: &'static str,
        /// The value.
        value: f64,
        /// The violated condition.
        rule: &'static str,
        /// The bound that the rule gives for this vehicle.
        bound: f64,
    },
    /// Gains that do not stabilise the controlled motion.
    Unstable {
        /// The group (table of the vehicle file).
        group: &'static str,
        /// The first of the gains.
        field: &'static str,
        /// The value.
        value: f64,
        /// The violated condition and its remedy.
        rule: &'static str,
    },
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange(error) => error.fmt(f),
            Self::Inconsistent {
                group,
                field,
                value,
                rule,
                bound,
            } => {
                write!(f, "{group}.{field} = {value}: {rule} ({bound} here)")
            }
            Self::Unstable {
                group,
                field,
                value,
                rule,
            } => write!(f, "{group}.{field} = {value}: {rule}"),
        }
    }
}

impl Relation {
    /// The error for a value that breaks the rule with the bound `bound`.
    fn broken(&self, value: f64, bound: f64) -> ParameterError {
        ParameterError::Inconsistent {
            group: self.group,
            field: self.field,
            value,
            rule: self.rule,
            bound,
        }
    }
}

impl ParameterError {
    /// The group (table of the vehicle file) and the field that the error is about.
    pub fn place(&self) -> (&'static str, &'static str) {
        match *self {
            Self::OutOfRange(OutOfRange { group, field, .. }) => (group, field.name),
            Self::Inconsistent { group, field, .. } | Self::Unstable { group, field, .. } => (group, field),
        }
    }
}

impl core::error::Error for ParameterError {}

impl From<OutOfRange> for ParameterError {
    fn from(error: OutOfRange) -> Self {
        Self::OutOfRange(error)
    }
}

/// A vehicle with checked parameters: every value is in range, and the values are consistent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vehicle<T> {
    parameters: VehicleParameters<T>,
}

impl<T: Real> Vehicle<T> {
    /// Checks the parameters.
    ///
    /// # Errors
    /// The first value out of range, or the first contradiction: `arm_mass_kg` must be less than
    /// `total_mass_kg` (alpha < 1), the battery's voltages in order, the current limits less than
    /// `overcurrent_a`, `kp` less than the total damping where Eq. 3.25 is the speed law, and the spar stable under its
    /// gains, if it has gains.
    pub fn new(parameters: VehicleParameters<T>) -> Result<Self, ParameterError> {
        let p = &parameters;
        p.check()?;
        let less = |relation: &Relation, value: T, bound: T| {
            if value < bound {
                Ok(())
            } else {
                Err(relation.broken(value.to_f64(), bound.to_f64()))
            }
        };
        less(&relations::ARM_MASS, p.body.arm_mass_kg, p.body.total_mass_kg)?;
        less(&relations::MINIMUM_VOLTAGE, p.battery.minimum_v, p.battery.nominal_v)?;
        less(&relations::MAXIMUM_VOLTAGE, p.battery.nominal_v, p.battery.maximum_v)?;
        let overcurrent_a = p.safety.overcurrent_a;
        less(&relations::DRIVE_CURRENT, p.drive_motor.current_limit_a, overcurrent_a)?;
        if let Some(motor) = p.ballast_motor() {
            less(&relations::BALLAST_CURRENT, motor.current_limit_a, overcurrent_a)?;
        }
        let vehicle = Self { parameters };
        if vehicle.speed_law() == SpeedLawChoice::SwingDamped {
            // Eq. 3.25 with kp at or above the total damping is unstable (erratum E2): refuse it here. The landing law
            // does not use kp.
            less(&relations::SPEED_GAIN, p.control.kp, vehicle.planar(T::ZERO).zeta)?;
        }
        if let (Some(camera), Some(gains)) = (vehicle.camera(), vehicle.spar_gains())
            && !camera.is_stable_under(&gains)
        {
            let Relation { group, field, rule, .. } = relations::SPAR_GAINS;
            return Err(ParameterError::Unstable {
                group,
                field,
                value: gains[0].to_f64(),
                rule,
            });
        }
        Ok(vehicle)
    }

    /// Checks that a board with these sensors can measure every limit whose crossing is a fault. The vehicle would never
    /// detect the crossing of a limit beyond the sensors' ranges. The current limits lie below `overcurrent_a`, the
    /// other voltages below `maximum_v`, so two checks suffice.
    ///
    /// # Errors
    /// The first limit outside the sensors' ranges.
    pub fn check_on(&self, ranges: &SensorRanges) -> Result<(), ParameterError> {
        let p = &self.parameters;
        for (relation, value, bound) in [
            (relations::MEASURED_VOLTAGE, p.battery.maximum_v, ranges.battery_max_v),
            (
                relations::MEASURED_CURRENT,
                p.safety.overcurrent_a,
                ranges.current_max_a,
            ),
        ] {
            let (value, bound) = (value.to_f64(), f64::from(bound));
            // Written so that NaN is refused.
            let measured = value <= bound;
            if !measured {
                return Err(relation.broken(value, bound));
            }
        }
        Ok(())
    }

    /// Gains of the spar's feedback (Eq. 7.19) in the units of ch. 7, in the order of
    /// [`SparLaw::gains`](crate::control::spar_law::SparLaw::gains); `None` without a spar, or when all gains are 0 and
    /// the spar is not levelled.
    pub fn spar_gains(&self) -> Option<[T; 4]> {
        let (spar, _) = self.parameters.spar.as_ref()?;
        let gains = [
            spar.spar_gain,
            spar.ballast_gain,
            spar.spar_rate_gain,
            spar.ballast_rate_gain,
        ];
        gains.iter().any(|gain| *gain != T::ZERO).then_some(gains)
    }

    /// The speed law that the file names.
    pub fn speed_law(&self) -> SpeedLawChoice {
        if self.parameters.control.law == T::ZERO {
            SpeedLawChoice::SwingDamped
        } else {
            SpeedLawChoice::Landing
        }
    }

    /// The checked parameters.
    pub fn parameters(&self) -> &VehicleParameters<T> {
        &self.parameters
    }

    /// The scales between SI and the nondimensional numbers.
    pub fn scales(&self) -> Scales<T> {
        Scales::new(&self.parameters.body, &self.parameters.drive_motor)
    }

    /// The scales of the spar; `None` without a spar.
    pub fn spar_scales(&self) -> Option<SparScales<T>> {
        self.parameters
            .spar
            .as_ref()
            .map(|(spar, motor)| SparScales::new(spar, motor))
    }

    /// Mass of the spar over M + m: S of (8.8), corrected (erratum E35); 0 without a spar.
    pub fn spar_mass_ratio(&self) -> T {
        self.parameters.spar.as_ref().map_or(T::ZERO, |(spar, _)| {
            (spar.camera_mass_kg + spar.motor_mass_kg + spar.ballast_mass_kg) / self.parameters.body.total_mass_kg
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::BoardScales;

    #[test]
    fn a_limit_that_the_sensors_cannot_measure_is_refused_by_name() {
        type Change = fn(&mut VehicleParameters<f32>);
        let ranges = BoardScales::EXAMPLE.sensor_ranges();
        let reference = test_vehicle::reference();
        assert_eq!(reference.check_on(&ranges), Ok(()));
        let refused: [(&str, Change); 6] = [
            ("maximum_v", |p| p.battery.maximum_v = 64.3),
            ("maximum_v", |p| p.battery.maximum_v = 75.0),
            ("maximum_v", |p| p.battery.maximum_v = 80.0),
            ("overcurrent_a", |p| p.safety.overcurrent_a = 62.8),
            ("overcurrent_a", |p| p.safety.overcurrent_a = 200.0),
            ("overcurrent_a", |p| p.safety.overcurrent_a = 1000.0),
        ];
        for (name, change) in refused {
            let mut parameters = *reference.parameters();
            change(&mut parameters);
            let vehicle = Vehicle::new(parameters).expect("valid on a board that measures more");
            let error = vehicle.check_on(&ranges).expect_err("beyond the sensors");
            assert!(
                matches!(error, ParameterError::Inconsistent { field, .. } if field == name),
                "{error:?}"
            );
        }
        let mut parameters = *reference.parameters();
        parameters.battery.maximum_v = 64.2;
        parameters.safety.overcurrent_a = 62.7;
        let vehicle = Vehicle::new(parameters).expect("valid");
        assert_eq!(vehicle.check_on(&ranges), Ok(()));
    }
}
