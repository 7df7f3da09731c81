//! The analogue inputs of a board, in one list: what is read, scaled, recorded and simulated follows the list.

/// What an input's raw counts stand for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnalogScale {
    /// SI units per count, > 0.
    pub per_count: f32,
    /// Count at zero.
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

/// How a board wires an input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnalogInput {
    /// Channel of the board's converter.
    pub channel: u8,
    /// What a count stands for.
    pub scale: AnalogScale,
}

/// Makes [`Analog`] out of the list of inputs.
macro_rules! analog_inputs {
    ($( $(#[doc = $doc:literal])+ $name:ident, )+) => {
        /// Number of analogue inputs.
        pub const ANALOG_INPUTS: usize = [$(stringify!($name)),+].len();

        /// One thing for each analogue input: raw counts, values in SI units, scales, channels.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        #[repr(C)]
        pub struct Analog<T> {
            $( $(#[doc = $doc])+ pub $name: T, )+
        }

        impl<T> Analog<T> {
            /// The inputs' names, in order.
            pub const NAMES: [&'static str; ANALOG_INPUTS] = [$(stringify!($name)),+];

            /// What the input of this name has.
            pub fn get_mut(&mut self, name: &str) -> Option<&mut T> {
                match name {
                    $( stringify!($name) => Some(&mut self.$name), )+
                    _ => None,
                }
            }
        }

        impl<T: Copy> Analog<T> {
            /// The same for every input.
            pub const fn all(value: T) -> Self {
                Self { $($name: value),+ }
            }

            /// What the inputs have, in order.
            pub const fn values(&self) -> [T; ANALOG_INPUTS] {
                [$(self.$name),+]
            }

            /// What the inputs have, given in order.
            pub fn from_values(values: [T; ANALOG_INPUTS]) -> Self {
                let [$($name),+] = values;
                Self { $($name),+ }
            }

            /// Something made for each input, in order.
            pub fn map<U>(&self, mut of: impl FnMut(T) -> U) -> Analog<U> {
                Analog { $($name: of(self.$name)),+ }
            }

            /// Something made for each input out of what two have for it, in order.
            pub fn with<U: Copy, V>(&self, other: &Analog<U>, mut of: impl FnMut(T, U) -> V) -> Analog<V> {
                Analog { $($name: of(self.$name, other.$name)),+ }
            }
        }

        impl Analog<AnalogInput> {
            /// The inputs' scales.
            pub const fn scales(&self) -> Analog<AnalogScale> {
                Analog { $($name: self.$name.scale),+ }
            }

            /// The inputs' channels, in order.
            pub const fn channels(&self) -> [u8; ANALOG_INPUTS] {
                [$(self.$name.channel),+]
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
    /// What the motors' currents have, left, right, ballast: in the order of `Motor`.
    pub const fn currents(&self) -> [T; 3] {
        [self.left_current, self.right_current, self.ballast_current]
    }
}
