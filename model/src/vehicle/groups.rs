//! The list of parameter groups, and access to every parameter by number and by name.

use super::fields::{Field, Group, NotSet, OutOfRange};
use super::parameters::{
    BatteryParameters, BodyParameters, ControlParameters, EstimatorParameters, ImuParameters, MotorParameters,
    SafetyParameters, SparParameters,
};
use crate::real::Real;
use crate::sample::MOTORS;

/// One table of the vehicle file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Table {
    /// Its name.
    pub name: &'static str,
    /// Its fields, in order.
    pub fields: &'static [Field],
    /// A vehicle without a spar has no such table.
    pub of_spar: bool,
}

/// Makes [`VehicleParameters`] out of the list of its groups, in the order of their numbers. The two
/// groups in brackets exist together or not at all.
macro_rules! vehicle_parameters {
    (
        $( $(#[doc = $before_doc:literal])+ $before:ident: $before_type:ident, )+
        [$(#[doc = $pair_doc:literal])+ $first:ident: $first_type:ident, $second:ident: $second_type:ident],
        $( $(#[doc = $after_doc:literal])+ $after:ident: $after_type:ident, )+
    ) => {
        /// All parameters as read, not yet checked; [`Vehicle::new`](super::Vehicle::new) checks them.
        ///
        /// Every parameter has a number: its place in the sequence of all groups' fields. A vehicle without a spar has
        /// fewer parameters.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct VehicleParameters<T> {
            $( $(#[doc = $before_doc])+ pub $before: $before_type<T>, )+
            $(#[doc = $pair_doc])+
            pub $first: Option<($first_type<T>, $second_type<T>)>,
            $( $(#[doc = $after_doc])+ pub $after: $after_type<T>, )+
        }

        /// Number of groups.
        const GROUPS: usize = [$(stringify!($before),)+ stringify!($first), stringify!($second), $(stringify!($after)),+].len();

        impl<T: Real> VehicleParameters<T> {
            /// The tables of the vehicle file, in order.
            pub const TABLES: &'static [Table] = &[
                $( Table { name: stringify!($before), fields: $before_type::<T>::FIELDS, of_spar: false }, )+
                Table { name: stringify!($first), fields: $first_type::<T>::FIELDS, of_spar: true },
                Table { name: stringify!($second), fields: $second_type::<T>::FIELDS, of_spar: true },
                $( Table { name: stringify!($after), fields: $after_type::<T>::FIELDS, of_spar: false }, )+
            ];

            /// Builds the parameters of a vehicle with or without a spar from a source that knows the value
            /// of each field of each table.
            ///
            /// # Errors
            /// The source's first error.
            pub fn try_from_source<E>(
                with_spar: bool,
                mut source: impl FnMut(&'static str, &'static Field) -> Result<T, E>,
            ) -> Result<Self, E> {
                Ok(Self {
                    $( $before: $before_type::try_from_fields(|field| source(stringify!($before), field))?, )+
                    $first: if with_spar {
                        Some((
                            $first_type::try_from_fields(|field| source(stringify!($first), field))?,
                            $second_type::try_from_fields(|field| source(stringify!($second), field))?,
                        ))
                    } else {
                        None
                    },
                    $( $after: $after_type::try_from_fields(|field| source(stringify!($after), field))?, )+
                })
            }

            /// The same values in another number type (rounded to the nearest).
            pub fn cast<V: Real>(&self) -> VehicleParameters<V> {
                VehicleParameters {
                    $( $before: self.$before.cast(), )+
                    $first: self.$first.map(|(first, second)| (first.cast(), second.cast())),
                    $( $after: self.$after.cast(), )+
                }
            }

            /// The groups with their tables' names, in order.
            fn groups(&self) -> [(&'static str, Option<&dyn Group<T>>); GROUPS] {
                [
                    $( (stringify!($before), Some(&self.$before as &dyn Group<T>)), )+
                    (stringify!($first), self.$first.as_ref().map(|(first, _)| first as &dyn Group<T>)),
                    (stringify!($second), self.$first.as_ref().map(|(_, second)| second as &dyn Group<T>)),
                    $( (stringify!($after), Some(&self.$after as &dyn Group<T>)), )+
                ]
            }

            /// The groups, mutable, in order.
            fn groups_mut(&mut self) -> [Option<&mut dyn Group<T>>; GROUPS] {
                let (first, second) = match &mut self.$first {
                    Some((first, second)) => (Some(first as &mut dyn Group<T>), Some(second as &mut dyn Group<T>)),
                    None => (None, None),
                };
                [
                    $( Some(&mut self.$before as &mut dyn Group<T>), )+
                    first,
                    second,
                    $( Some(&mut self.$after as &mut dyn Group<T>), )+
                ]
            }
        }
    };
}

vehicle_parameters! {
    /// Geometry and masses.
    body: BodyParameters,
    /// Each of the two drive motors.
    drive_motor: MotorParameters,
    [
        /// The spar and the motor that turns the ballast against it; `None` on a vehicle without a spar.
        spar: SparParameters,
        ballast_motor: MotorParameters
    ],
    /// Positions of the IMUs.
    imu: ImuParameters,
    /// Supply.
    battery: BatteryParameters,
    /// Gains and limits.
    control: ControlParameters,
    /// Estimator time constants.
    estimator: EstimatorParameters,
    /// Fault limits.
    safety: SafetyParameters,
}

impl<T: Real> VehicleParameters<T> {
    /// The motors, in the order of [`Motor`](crate::sample::Motor). Without a spar the third bridge has no motor, and the
    /// third entry repeats the drive motors' parameters.
    pub fn motors(&self) -> [&MotorParameters<T>; MOTORS] {
        let ballast_motor = self.ballast_motor().unwrap_or(&self.drive_motor);
        [&self.drive_motor, &self.drive_motor, ballast_motor]
    }

    /// The ballast motor; `None` without a spar.
    pub fn ballast_motor(&self) -> Option<&MotorParameters<T>> {
        self.spar.as_ref().map(|(_, motor)| motor)
    }

    /// Number of parameters of this vehicle.
    pub fn count(&self) -> u16 {
        let fields = |group: &(_, Option<&dyn Group<T>>)| group.1.map_or(0, |group| group.fields().len());
        self.groups().iter().map(fields).sum::<usize>() as u16
    }

    /// Table and field of the parameter with this number; `None` for an unknown number.
    pub fn field(&self, number: u16) -> Option<(&'static str, &'static Field)> {
        let mut place = usize::from(number);
        for (table, group) in self.groups() {
            let fields = group.map_or(&[][..], Group::fields);
            if let Some(field) = fields.get(place) {
                return Some((table, field));
            }
            place -= fields.len();
        }
        None
    }

    /// Value of the parameter with this number; `None` for an unknown number.
    pub fn value(&self, number: u16) -> Option<T> {
        let mut place = usize::from(number);
        for group in self.groups().into_iter().filter_map(|(_, group)| group) {
            if let Some(value) = group.value(place) {
                return Some(value);
            }
            place -= group.fields().len();
        }
        None
    }

    /// Number of the field `name` of the table `table`; `None` if this vehicle has no such field.
    pub fn number_of(&self, table: &str, name: &str) -> Option<u16> {
        (0..self.count()).find(|number| {
            self.field(*number)
                .is_some_and(|(group, field)| group == table && field.name == name)
        })
    }

    /// Changes one parameter.
    ///
    /// # Errors
    /// [`NotSet`]; the parameters are unchanged.
    pub fn set(&mut self, number: u16, value: T) -> Result<(), NotSet> {
        let (group, field) = self.field(number).ok_or(NotSet::NoSuchNumber)?;
        check(group, field, value).map_err(NotSet::OutOfRange)?;
        let mut place = usize::from(number);
        for group in self.groups_mut().into_iter().flatten() {
            let fields = group.fields().len();
            if let Some(slot) = group.value_mut(place) {
                *slot = value;
                return Ok(());
            }
            place -= fields;
        }
        Err(NotSet::NoSuchNumber)
    }

    /// Checks every parameter against its field's range.
    ///
    /// # Errors
    /// The first parameter that is out of range or NaN.
    pub fn check(&self) -> Result<(), OutOfRange> {
        for number in 0..self.count() {
            if let (Some((group, field)), Some(value)) = (self.field(number), self.value(number)) {
                check(group, field, value)?;
            }
        }
        Ok(())
    }
}

/// Checks a value against its field's range.
fn check<T: Real>(group: &'static str, field: &'static Field, value: T) -> Result<(), OutOfRange> {
    let value = value.to_f64();
    if field.allows(value) {
        Ok(())
    } else {
        Err(OutOfRange { group, field, value })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    /// A vehicle whose every value is its number.
    fn numbered(with_spar: bool) -> VehicleParameters<f64> {
        let mut number = -1.0;
        VehicleParameters::try_from_source(with_spar, |_, _| {
            number += 1.0;
            Ok::<_, ()>(number)
        })
        .expect("the source knows every value")
    }

    #[test]
    fn number_name_and_value_agree_with_and_without_a_spar() {
        for with_spar in [true, false] {
            let mut parameters = numbered(with_spar);
            let tables = VehicleParameters::<f64>::TABLES.iter();
            let fields: usize = tables
                .filter(|table| with_spar || !table.of_spar)
                .map(|table| table.fields.len())
                .sum();
            assert_eq!(usize::from(parameters.count()), fields);
            for number in 0..parameters.count() {
                let (table, field) = parameters.field(number).expect("a field");
                assert_eq!(parameters.value(number), Some(f64::from(number)));
                assert_eq!(parameters.number_of(table, field.name), Some(number));
                let before = parameters;
                assert_eq!(parameters.set(number, field.max), Ok(()));
                assert_eq!(parameters.value(number), Some(field.max));
                assert!(matches!(
                    parameters.set(number, 2.0 * field.max + 1.0),
                    Err(NotSet::OutOfRange(out)) if *out.field == *field && out.group == table
                ));
                for other in (0..parameters.count()).filter(|other| *other != number) {
                    assert_eq!(parameters.value(other), before.value(other));
                }
                parameters = before;
            }
            let end = parameters.count();
            assert_eq!((parameters.field(end), parameters.value(end)), (None, None));
            assert_eq!(parameters.set(end, 1.0), Err(NotSet::NoSuchNumber));
        }
        assert_eq!(numbered(false).number_of("spar", "spar_length_m"), None);
    }

    #[test]
    fn every_bound_is_allowed_as_printed_in_either_precision_and_nothing_beyond() {
        for (table, field) in VehicleParameters::<f64>::TABLES
            .iter()
            .flat_map(|table| table.fields.iter().map(move |field| (table.name, field)))
        {
            for (bound, outward) in [(field.min, -1.0), (field.max, 1.0)] {
                let name = field.name;
                let printed = std::format!("{bound}");
                let double: f64 = printed.parse().expect("a number");
                let single: f32 = printed.parse().expect("a number");
                assert!(field.allows(double), "{table}.{name} = {printed}");
                assert!(
                    field.allows(f64::from(single)),
                    "{table}.{name} = {printed} in single precision"
                );
                // The next number outward, in either precision.
                let next = |up: bool| if up { single.next_up() } else { single.next_down() };
                assert!(!field.allows(f64::from(next(outward > 0.0))), "{table}.{name}");
                let step = if outward > 0.0 {
                    double.next_up()
                } else {
                    double.next_down()
                };
                assert!(f64::from(step as f32) == step || !field.allows(step), "{table}.{name}");
                assert!(!field.allows(f64::NAN));
            }
        }
    }

    #[test]
    fn the_first_value_out_of_range_is_named() {
        let mut parameters = numbered(true).cast::<f32>();
        for number in 0..parameters.count() {
            let (_, field) = parameters.field(number).expect("a field");
            let middle = 0.5 * (field.min + field.max);
            let middle = if field.choices.is_empty() { middle } else { field.max };
            parameters.set(number, middle as f32).expect("within the range");
        }
        assert_eq!(parameters.check(), Ok(()));
        parameters.battery.nominal_v = f32::NAN;
        parameters.safety.phi_max_rad = 10.0;
        let error = parameters.check().expect_err("out of range");
        assert_eq!((error.group, error.field.name), ("battery", "nominal_v"));
    }
}
