//! The vehicle's parameters: SI as measured, checked once into [`Vehicle`], and the nondimensional
//! numbers that the laws use (3.10, 3.11, corrected).

use core::fmt;

use crate::real::Real;

pub mod fields;
mod models;
mod parameters;
mod renamed;
mod scales;

pub use fields::{Field, OutOfRange};
pub use parameters::{
    BatteryParameters, BodyParameters, CameraMotorParameters, CameraParameters, ControlParameters,
    DriveMotorParameters, EstimatorParameters, ImuParameters, SafetyParameters,
};
pub use renamed::RENAMED;
pub use scales::{CameraScales, Scales};

/// Acceleration of gravity, m/s^2.
pub const GRAVITY_M_S2: f64 = 9.81;

/// All parameters as read, not yet checked. [`Vehicle::new`] checks them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleParameters<T> {
    /// Geometry and masses.
    pub body: BodyParameters<T>,
    /// Each of the two drive motors.
    pub drive_motor: DriveMotorParameters<T>,
    /// The camera spar and its motor, where there is one.
    pub camera: Option<(CameraParameters<T>, CameraMotorParameters<T>)>,
    /// IMU positions.
    pub imu: ImuParameters<T>,
    /// Supply.
    pub battery: BatteryParameters<T>,
    /// Gains and limits.
    pub control: ControlParameters<T>,
    /// Estimator time constants.
    pub estimator: EstimatorParameters<T>,
    /// Fault limits.
    pub safety: SafetyParameters<T>,
}

impl<T: Real> VehicleParameters<T> {
    /// The same values in another number type.
    pub fn cast<V: Real>(&self) -> VehicleParameters<V> {
        VehicleParameters {
            body: self.body.cast(),
            drive_motor: self.drive_motor.cast(),
            camera: self.camera.map(|(c, m)| (c.cast(), m.cast())),
            imu: self.imu.cast(),
            battery: self.battery.cast(),
            control: self.control.cast(),
            estimator: self.estimator.cast(),
            safety: self.safety.cast(),
        }
    }

    /// Calls `visit` with each group's table name, field and value, in order.
    pub fn for_each(&self, mut visit: impl FnMut(&'static str, &'static Field, T)) {
        self.body.for_each(|f, v| visit(BodyParameters::<T>::TABLE, f, v));
        self.drive_motor
            .for_each(|f, v| visit(DriveMotorParameters::<T>::TABLE, f, v));
        if let Some((camera, motor)) = &self.camera {
            camera.for_each(|f, v| visit(CameraParameters::<T>::TABLE, f, v));
            motor.for_each(|f, v| visit(CameraMotorParameters::<T>::TABLE, f, v));
        }
        self.imu.for_each(|f, v| visit(ImuParameters::<T>::TABLE, f, v));
        self.battery.for_each(|f, v| visit(BatteryParameters::<T>::TABLE, f, v));
        self.control.for_each(|f, v| visit(ControlParameters::<T>::TABLE, f, v));
        self.estimator
            .for_each(|f, v| visit(EstimatorParameters::<T>::TABLE, f, v));
        self.safety.for_each(|f, v| visit(SafetyParameters::<T>::TABLE, f, v));
    }

    /// A mutable reference to the field `name` of the group `table`.
    pub fn field_mut(&mut self, table: &str, name: &str) -> Option<&mut T> {
        match table {
            "body" => self.body.field_mut(name),
            "drive_motor" => self.drive_motor.field_mut(name),
            "camera" => self.camera.as_mut().and_then(|(c, _)| c.field_mut(name)),
            "camera_motor" => self.camera.as_mut().and_then(|(_, m)| m.field_mut(name)),
            "imu" => self.imu.field_mut(name),
            "battery" => self.battery.field_mut(name),
            "control" => self.control.field_mut(name),
            "estimator" => self.estimator.field_mut(name),
            "safety" => self.safety.field_mut(name),
            _ => None,
        }
    }
}

/// Why a set of parameters is no vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParameterError {
    /// One value is out of its range.
    OutOfRange(OutOfRange),
    /// Two values contradict each other.
    Inconsistent {
        /// The group (table of the vehicle file).
        group: &'static str,
        /// The field to change.
        field: &'static str,
        /// Its value.
        value: f64,
        /// What must hold.
        rule: &'static str,
        /// The bound that the rule gives here.
        bound: f64,
    },
    /// Gains under which what they control does not settle.
    Unstable {
        /// The group (table of the vehicle file).
        group: &'static str,
        /// The first of the gains.
        field: &'static str,
        /// Its value.
        value: f64,
        /// What must hold, and what to do.
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

impl core::error::Error for ParameterError {}

impl From<OutOfRange> for ParameterError {
    fn from(error: OutOfRange) -> Self {
        Self::OutOfRange(error)
    }
}

/// A vehicle whose parameters have been checked: every value in range, and consistent.
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
    /// `overcurrent_a`, `kp` less than the total damping, and the spar stable under its gains, where there
    /// are any.
    pub fn new(parameters: VehicleParameters<T>) -> Result<Self, ParameterError> {
        let p = &parameters;
        p.body.check()?;
        p.drive_motor.check()?;
        if let Some((camera, motor)) = &p.camera {
            camera.check()?;
            motor.check()?;
        }
        p.imu.check()?;
        p.battery.check()?;
        p.control.check()?;
        p.estimator.check()?;
        p.safety.check()?;
        let less = |group, field, value: T, bound: T, rule| {
            if value < bound {
                Ok(())
            } else {
                Err(ParameterError::Inconsistent {
                    group,
                    field,
                    value: value.to_f64(),
                    rule,
                    bound: bound.to_f64(),
                })
            }
        };
        less(
            "body",
            "arm_mass_kg",
            p.body.arm_mass_kg,
            p.body.total_mass_kg,
            "must be less than total_mass_kg, so that alpha = arm_mass_kg / total_mass_kg is between 0 and 1",
        )?;
        less(
            "battery",
            "minimum_v",
            p.battery.minimum_v,
            p.battery.nominal_v,
            "must be less than nominal_v",
        )?;
        less(
            "battery",
            "nominal_v",
            p.battery.nominal_v,
            p.battery.maximum_v,
            "must be less than maximum_v",
        )?;
        less(
            "drive_motor",
            "current_limit_a",
            p.drive_motor.current_limit_a,
            p.safety.overcurrent_a,
            "must be less than safety.overcurrent_a",
        )?;
        if let Some((_, motor)) = &p.camera {
            less(
                "camera_motor",
                "current_limit_a",
                motor.current_limit_a,
                p.safety.overcurrent_a,
                "must be less than safety.overcurrent_a",
            )?;
        }
        // Eq. 3.25 with kp at or above the total damping is unstable (erratum E5): refuse it here.
        let vehicle = Self { parameters };
        let zeta = vehicle.planar(T::ZERO).zeta;
        less(
            "control",
            "kp",
            p.control.kp,
            zeta,
            "must be less than the total damping zeta, or the speed loop is unstable",
        )?;
        if let (Some(camera), Some(gains)) = (vehicle.camera(), vehicle.camera_gains())
            && !camera.is_stable_under(&gains)
        {
            return Err(ParameterError::Unstable {
                group: "camera",
                field: "spar_gain",
                value: gains[0].to_f64(),
                rule: "with the other three gains it must hold this spar; put 0 into all four, and \
                       `hil-sim lqr --vehicle` tells gains that do",
            });
        }
        Ok(vehicle)
    }

    /// Gains of the camera spar's feedback (Eq. 7.19) in the units of ch. 7, in the order of
    /// [`CameraLaw::gains`](crate::control::camera_law::CameraLaw::gains); `None` without a spar, or when it
    /// is not levelled.
    pub fn camera_gains(&self) -> Option<[T; 4]> {
        let (c, _) = self.parameters.camera.as_ref()?;
        let gains = [c.spar_gain, c.ballast_gain, c.spar_rate_gain, c.ballast_rate_gain];
        gains.iter().any(|gain| *gain != T::ZERO).then_some(gains)
    }

    /// The checked parameters.
    pub fn parameters(&self) -> &VehicleParameters<T> {
        &self.parameters
    }

    /// The scales between SI and the nondimensional numbers.
    pub fn scales(&self) -> Scales<T> {
        Scales::new(&self.parameters.body, &self.parameters.drive_motor)
    }

    /// The scales of the camera platform, where there is one.
    pub fn camera_scales(&self) -> Option<CameraScales<T>> {
        self.parameters.camera.as_ref().map(|(c, m)| CameraScales::new(c, m))
    }

    /// Mass of the camera spar over M + m: S of (8.8), corrected (erratum E35); 0 without a spar.
    pub fn spar_mass_ratio(&self) -> T {
        self.parameters.camera.as_ref().map_or(T::ZERO, |(c, _)| {
            (c.camera_mass_kg + c.motor_mass_kg + c.ballast_mass_kg) / self.parameters.body.total_mass_kg
        })
    }
}
