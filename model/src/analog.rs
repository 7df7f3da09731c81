//! The one list of a board's analogue inputs. Sampling, scaling, recording and simulation follow this list.

/// The conversion of an input's raw counts to SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnalogScale {
    /// SI units per count, > 0.
    pub per_count: f32,
    /// Raw count at the value zero.
    pub zero_count: u16,
}

impl AnalogScale {
    /// The value of a raw count, in SI units.
    pub fn value(self, raw: u16) -> f32 {
        (i32::from(raw) - i32::from(self.zero_count)) as f32 * self.per_count
    }

    /// The raw count of a value, neither rounded nor bounded.
    pub fn counts(self, value: f64) -> f64 {
        f64::from(self.zero_count) + value / f64::from(self.per_count)
    }
}

/// How a board wires an input, on boards whose converter has the pins `P`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnalogInput<P> {
    /// Pin of the converter.
    pub pin: P,
    /// Conversion of its raw counts.
    pub scale: AnalogScale,
}

/// Makes [`Analog`] out of the list of inputs.
macro_rules! analog_inputs {
    ($( $(#[doc = $doc:literal])+ $name:ident, )+) => {
        /// Number of analogue inputs.
        pub const ANALOG_INPUTS: usize = [$(stringify!($name)),+].len();

        /// One value of type `T` per analogue input: raw counts, values in SI units, or scales.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        #[repr(C)]
        pub struct Analog<T> {
            $( $(#[doc = $doc])+ pub $name: T, )+
        }

        impl<T> Analog<T> {
            /// The inputs' names, in order.
            pub const NAMES: [&'static str; ANALOG_INPUTS] = [$(stringify!($name)),+];

            /// The value of the input named `name`; `None` for an unknown name.
            pub fn get_mut(&mut self, name: &str) -> Option<&mut T> {
                match name {
                    $( stringify!($name) => Some(&mut self.$name), )+
                    _ => None,
                }
            }
        }

        impl<T: Copy> Analog<T> {
            /// The same value for every input.
            pub const fn all(value: T) -> Self {
                Self { $($name: value),+ }
            }

            /// The values of the inputs, in order.
            pub const fn values(&self) -> [T; ANALOG_INPUTS] {
                [$(self.$name),+]
            }

            /// Builds the set from the inputs' values, in order.
            pub fn from_values(values: [T; ANALOG_INPUTS]) -> Self {
                let [$($name),+] = values;
                Self { $($name),+ }
            }

            /// Applies `of` to the value of each input, in order.
            pub fn map<U>(&self, mut of: impl FnMut(T) -> U) -> Analog<U> {
                Analog { $($name: of(self.$name)),+ }
            }

            /// Applies `of` to each input's pair of values from `self` and `other`, in order.
            pub fn with<U: Copy, V>(&self, other: &Analog<U>, mut of: impl FnMut(T, U) -> V) -> Analog<V> {
                Analog { $($name: of(self.$name, other.$name)),+ }
            }
        }

        impl<P: Copy> Analog<AnalogInput<P>> {
            /// The inputs' scales.
            pub const fn scales(&self) -> Analog<AnalogScale> {
                Analog { $($name: self.$name.scale),+ }
            }

            /// The inputs' pins, in order.
            pub const fn pins(&self) -> [P; ANALOG_INPUTS] {
                [$(self.$name.pin),+]
            }
        }
    };
}

analog_inputs! {
    /// Battery voltage, V.
    battery_voltage,
    /// Current of the left motor, A.
    left_current,
    /// Current of the right motor, A.
    right_current,
    /// Current of the ballast motor, A.
    ballast_current,
}

impl<T: Copy> Analog<T> {
    /// The values of the motor currents in the order of `Motor`: left, right, ballast.
    pub const fn currents(&self) -> [T; 3] {
        [self.left_current, self.right_current, self.ballast_current]
    }
}
