//! Tables of named numbers with ranges. This one description is the basis for reading, checking and writing files,
//! stored parameters and documentation.

use core::fmt;

/// The value of a field that a vehicle file leaves out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LeftOut {
    /// Only a measurement of the vehicle can give the value: the file must have the field.
    Refused,
    /// This value, which suits every vehicle.
    Value(f64),
    /// The value that follows from the file's other values.
    Rule(Rule),
    /// The field belongs to a part that a vehicle without a spar does not have. Such a vehicle has this value, which
    /// nothing reads. The file of a vehicle with a spar must give the field.
    OfSpar(f64),
}

/// The rules by which a field follows from others
/// ([`VehicleParameters::follow_rules`](crate::vehicle::VehicleParameters::follow_rules)).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// The gain at which the yaw loop's crossover is [`TurningDrive::crossover_rad_s`](crate::vehicle::TurningDrive).
    YawGain,
    /// The integral gain that suits the yaw gain.
    YawIntegral,
    /// The gain of the heading hold about the yaw loop.
    HeadingGain,
    /// The largest voltage that a bridge gives from a full battery.
    BridgeVoltage,
}

/// One number of a parameter group: its name (with its unit), meaning and allowed range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// The name in code, vehicle file and link alike, unit suffix included.
    pub name: &'static str,
    /// The field's meaning.
    pub meaning: &'static str,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// The value if a vehicle file leaves the field out.
    pub left_out: LeftOut,
    /// Whether the field is a count, so that only whole numbers are allowed.
    pub whole: bool,
    /// Names of the values 0, 1, ... of a choice, in order; empty for a number. Vehicle files write the name.
    pub choices: &'static [&'static str],
}

/// A value outside its field's range, or not a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutOfRange {
    /// The group (table of the vehicle file).
    pub group: &'static str,
    /// The field.
    pub field: &'static Field,
    /// The refused value.
    pub value: f64,
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Field {
            name,
            min,
            max,
            choices,
            whole,
            ..
        } = *self.field;
        write!(f, "{}.{name} = {}: allowed is {min} to {max}", self.group, self.value)?;
        if whole {
            f.write_str(", a whole number")?;
        }
        for (value, choice) in choices.iter().enumerate() {
            write!(f, "{} {value} ({choice})", if value == 0 { ":" } else { "," })?;
        }
        Ok(())
    }
}

impl core::error::Error for OutOfRange {}

impl Field {
    /// Whether `value` is a number within the range. The bounds themselves are allowed, in single precision too, where
    /// the number nearest to a bound may lie slightly outside the range.
    pub fn allows(&self, value: f64) -> bool {
        let single = value as f32;
        let is_single = f64::from(single) == value;
        let is_bound = is_single && (single == self.min as f32 || single == self.max as f32);
        // Written so that NaN is refused.
        let within = (value >= self.min && value <= self.max) || is_bound;
        let counts = !self.whole || libm::trunc(value) == value;
        within && counts && (self.choices.is_empty() || self.choice(value).is_some())
    }

    /// Whether the file of a vehicle with or without a spar may leave the field out.
    pub fn is_optional(&self, with_spar: bool) -> bool {
        match self.left_out {
            LeftOut::Refused => false,
            LeftOut::OfSpar(_) => !with_spar,
            LeftOut::Value(_) | LeftOut::Rule(_) => true,
        }
    }

    /// The name of the choice with this value; `None` if the field is a number, and for a value that is not a choice.
    pub fn choice(&self, value: f64) -> Option<&'static str> {
        let place = value as usize;
        let name = self.choices.get(place).copied()?;
        (place as f64 == value).then_some(name)
    }

    /// The value of the choice with this name; `None` for a name that is not a choice.
    pub fn value_of(&self, name: &str) -> Option<f64> {
        let place = self.choices.iter().position(|choice| *choice == name)?;
        Some(place as f64)
    }
}

/// Why a parameter was not changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NotSet {
    /// The vehicle has no parameter with this number.
    NoSuchNumber,
    /// The value is outside the field's range, or not a number.
    OutOfRange(OutOfRange),
}

/// Access to the values of one group by their places in the group's table of fields.
pub(crate) trait Group<T> {
    /// The table of fields.
    fn fields(&self) -> &'static [Field];
    /// The value at `place` of the table.
    fn value(&self, place: usize) -> Option<T>;
    /// The value at `place` of the table, mutable.
    fn value_mut(&mut self, place: usize) -> Option<&mut T>;
}

/// Defines a group of parameters: a plain struct over the number type, and the table of its fields. A field that a
/// vehicle file may leave out states its value after `or`, or its rule after `by`. A field that only a spar uses
/// states after `bare` its value for a vehicle without a spar. A count is marked `in counts`.
macro_rules! parameter_group {
    (@left_out) => { $crate::vehicle::fields::LeftOut::Refused };
    (@left_out or $value:literal) => { $crate::vehicle::fields::LeftOut::Value($value as f64) };
    (@left_out bare $value:literal) => { $crate::vehicle::fields::LeftOut::OfSpar($value as f64) };
    (@whole) => { false };
    (@whole $whole:ident) => { true };
    (@left_out by $rule:ident) => { $crate::vehicle::fields::LeftOut::Rule($crate::vehicle::fields::Rule::$rule) };
    (
        $(#[doc = $doc:literal])*
        $name:ident {
            $( $(#[doc = $meaning:literal])+ $field:ident: $min:literal to $max:literal $(in $whole:ident)? $(or $value:literal)? $(bare $bare:literal)? $(by $rule:ident)? $(: $($choice:literal),+)?, )+
        }
    ) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $name<T> {
            $( $(#[doc = $meaning])+ #[doc = concat!("\n\nAllowed: ", stringify!($min), " to ", stringify!($max), ".")] pub $field: T, )+
        }

        impl<T: $crate::real::Real> $name<T> {
            /// The fields, in order.
            pub const FIELDS: &'static [$crate::vehicle::fields::Field] = &[
                $( $crate::vehicle::fields::Field {
                    name: stringify!($field),
                    meaning: concat!($($meaning),+),
                    min: $min as f64,
                    max: $max as f64,
                    left_out: parameter_group!(@left_out $(or $value)? $(bare $bare)? $(by $rule)?),
                    whole: parameter_group!(@whole $($whole)?),
                    choices: &[$($($choice),+)?],
                }, )+
            ];

            /// Builds the group from a source that knows the value of each field.
            ///
            /// # Errors
            /// The source's first error.
            pub fn try_from_fields<E>(
                mut source: impl FnMut(&'static $crate::vehicle::fields::Field) -> Result<T, E>,
            ) -> Result<Self, E> {
                let mut fields = Self::FIELDS.iter();
                // The table has one row for each field, so the fallback row is never used.
                $( let $field = source(fields.next().unwrap_or(&Self::FIELDS[0]))?; )+
                Ok(Self { $($field),+ })
            }

            /// The same values in another number type (rounded to the nearest).
            pub fn cast<V: $crate::real::Real>(&self) -> $name<V> {
                $name { $( $field: V::from_f64(self.$field.to_f64()) ),+ }
            }
        }

        impl<T: $crate::real::Real> $crate::vehicle::fields::Group<T> for $name<T> {
            fn fields(&self) -> &'static [$crate::vehicle::fields::Field] {
                Self::FIELDS
            }

            fn value(&self, place: usize) -> Option<T> {
                [$(self.$field),+].get(place).copied()
            }

            fn value_mut(&mut self, place: usize) -> Option<&mut T> {
                [$(&mut self.$field),+].into_iter().nth(place)
            }
        }
    };
}
pub(crate) use parameter_group;
