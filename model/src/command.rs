//! What the operator wants.

use crate::vehicle::ControlParameters;

/// Makes [`Request`] out of the list of requests.
macro_rules! requests {
    ($( $(#[doc = $doc:literal])+ $name:ident = $number:literal, )+) => {
        /// What the operator asks of the arming state machine. Each request acts once. Numbers are stable and
        /// without gaps.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[repr(u8)]
        pub enum Request {
            /// Nothing.
            #[default]
            None = 0,
            $( $(#[doc = $doc])+ $name = $number, )+
        }

        impl Request {
            /// `None` and every request, in the order of their numbers.
            pub const ALL: &'static [Self] = &[Self::None, $(Self::$name),+];

            /// The request's name.
            pub fn name(self) -> &'static str {
                match self {
                    Self::None => "None",
                    $(Self::$name => stringify!($name)),+
                }
            }

            /// The request of this number.
            pub fn from_number(number: u8) -> Option<Self> {
                Self::ALL.iter().copied().find(|request| *request as u8 == number)
            }
        }
    };
}

requests! {
    /// Arm, if nothing blocks it.
    Arm = 1,
    /// Open the bridges at once.
    Disarm = 2,
    /// Clear latched faults (while disarmed).
    ClearFaults = 3,
}

/// Makes [`DriveCommand`] out of the list of its quantities.
macro_rules! drive_command {
    ($( $(#[doc = $doc:literal])+ $name:ident, )+) => {
        /// How the vehicle is to drive; the operator repeats the command continuously. The host's message, the
        /// record of a tick and the laws carry the command unchanged. 0 is the neutral value of every quantity.
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[repr(C)]
        pub struct DriveCommand {
            $( $(#[doc = $doc])+ pub $name: f32, )+
        }

        impl DriveCommand {
            /// Number of quantities.
            pub const QUANTITIES: usize = [$(stringify!($name)),+].len();
            /// No motion.
            pub const NEUTRAL: Self = Self { $($name: 0.0),+ };

            /// The quantities, in order.
            pub fn values(&self) -> [f32; Self::QUANTITIES] {
                [$(self.$name),+]
            }

            /// The command of these quantities, in order.
            pub fn from_values(values: [f32; Self::QUANTITIES]) -> Self {
                let [$($name),+] = values;
                Self { $($name),+ }
            }
        }
    };
}

drive_command! {
    /// Speed of the axle, m/s, forward positive.
    speed_m_s,
    /// Yaw rate, rad/s, anticlockwise (to the left) positive; exactly 0 holds the heading.
    yaw_rate_rad_s,
}

impl DriveCommand {
    /// The largest speed, m/s, and yaw rate, rad/s, that any vehicle can be commanded: the ends of the ranges of
    /// `speed_max_m_s` and `yaw_rate_max_rad_s`.
    pub fn largest() -> Self {
        let end = |name| {
            let mut fields = ControlParameters::<f32>::FIELDS.iter();
            fields
                .find(|field| field.name == name)
                .map_or(0.0, |field| field.max as f32)
        };
        Self::driving(end("speed_max_m_s"), end("yaw_rate_max_rad_s"))
    }

    /// A command to drive at this speed, m/s, and this yaw rate, rad/s. Every other quantity is neutral.
    pub const fn driving(speed_m_s: f32, yaw_rate_rad_s: f32) -> Self {
        let mut command = Self::NEUTRAL;
        command.speed_m_s = speed_m_s;
        command.yaw_rate_rad_s = yaw_rate_rad_s;
        command
    }

    /// Whether every quantity is finite. The vehicle ignores a command that is not.
    pub fn is_finite(&self) -> bool {
        self.values().iter().all(|value| value.is_finite())
    }

    /// Whether the command asks for no motion.
    pub fn is_neutral(&self) -> bool {
        *self == Self::NEUTRAL
    }
}

/// What the operator wants, as the vehicle knows it when the tick begins.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Command {
    /// How to drive.
    pub drive: DriveCommand,
    /// Age of the drive command, us; `u32::MAX` until the first command arrives.
    pub age_us: u32,
    /// A request to the arming state machine, present in one tick only.
    pub request: Request,
    /// Parameters are being changed: arming is blocked.
    pub parameters_pending: bool,
}

impl Command {
    /// No command yet.
    pub const NONE: Self = Self {
        drive: DriveCommand::NEUTRAL,
        age_us: u32::MAX,
        request: Request::None,
        parameters_pending: false,
    };
}
