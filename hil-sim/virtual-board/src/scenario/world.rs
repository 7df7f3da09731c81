//! Steps of a scenario that act on the plant alone, and so work equally on every board.

use model::analog::Analog;
use plant::Plant;
use plant::analog::{AnalogFault, Following};
use plant::body::{Payload, Push, PushedBody};
use plant::imu::imperfection::Vibration;
use plant::wiring::{DeadHalf, Leads};
use serde::Deserialize;

use super::error::{ScenarioError, Within};

/// A side of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Left.
    Left,
    /// Right.
    Right,
}

/// A motor by its place in the firmware's arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MotorName {
    /// The left wheel's motor.
    Left,
    /// The right wheel's motor.
    Right,
    /// The ballast motor.
    Ballast,
}

/// An analogue sensor, by the number of its input in [`Analog`]. A file gives the input's name, with `-` for each `_`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct AnalogSensor(usize);

impl AnalogSensor {
    /// The names of the sensors, as in files.
    pub fn names() -> impl Iterator<Item = String> {
        Analog::<()>::NAMES.into_iter().map(|input| input.replace('_', "-"))
    }

    /// The name of its input.
    fn input(self) -> &'static str {
        Analog::<()>::NAMES.get(self.0).copied().unwrap_or_default()
    }
}

impl TryFrom<String> for AnalogSensor {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let number = Self::names().position(|known| known == name);
        number.map(Self).ok_or_else(|| {
            // As serde puts it, so that the reader adds the nearest of them.
            let names: Vec<String> = Self::names().map(|known| format!("`{known}`")).collect();
            format!("unknown variant `{name}`, expected one of {}", names.join(", "))
        })
    }
}

/// A step that acts on the plant.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum WorldStep {
    /// A wheel seizes against the arm, or is freed.
    Jam {
        /// The wheel.
        side: Side,
        /// Whether the wheel is seized.
        jammed: bool,
    },
    /// A payload on the arm, in place of the present payload.
    Payload {
        /// Mass, kg; 0 removes the payload.
        mass_kg: f64,
        /// Distance ahead of the arm's axis, m.
        #[serde(default)]
        ahead_m: f64,
        /// Distance below the axle, m.
        #[serde(default)]
        below_m: f64,
    },
    /// A push on the vehicle.
    Push {
        /// The body that is pushed.
        on: PushedBody,
        /// Force along the heading, N.
        #[serde(default)]
        forward_n: f64,
        /// Force to the left, N.
        #[serde(default)]
        left_n: f64,
        /// Force upward, N.
        #[serde(default)]
        up_n: f64,
        /// Duration, s.
        for_s: f64,
    },
    /// The axle is put on a stand, with the wheels off the ground, or back on the ground.
    Stand {
        /// Whether the axle is on the stand.
        raised: bool,
    },
    /// Both IMUs warm up or cool down.
    Temperature {
        /// Final temperature, C.
        to_c: f64,
        /// Duration of the change, s.
        #[serde(default)]
        over_s: f64,
    },
    /// A vibration shakes both IMUs from now on.
    Vibration {
        /// Amplitude of the acceleration, m/s^2.
        #[serde(default)]
        amplitude_m_s2: f64,
        /// Amplitude of the angular rate, rad/s.
        #[serde(default)]
        amplitude_rad_s: f64,
        /// Frequency, Hz.
        frequency_hz: f64,
    },
    /// An analogue sensor fails, or works again.
    AnalogFault {
        /// The sensor.
        sensor: AnalogSensor,
        /// Whether the reading follows the measured quantity.
        #[serde(default)]
        reads: Following,
        /// The sensor's gain.
        #[serde(default = "one")]
        gain: f64,
        /// The sensor's offset, A or V.
        #[serde(default)]
        offset: f64,
    },
    /// An encoder loses edges.
    EncoderLoss {
        /// The motor.
        motor: MotorName,
        /// Lost share of the edges.
        share: f64,
    },
    /// A motor's leads break, touch each other, or are repaired.
    MotorLeads {
        /// The motor.
        motor: MotorName,
        /// State of the leads.
        leads: Leads,
    },
    /// Half of a bridge fails, or is repaired.
    HalfBridge {
        /// The motor.
        motor: MotorName,
        /// The direction that the bridge no longer drives.
        dead: DeadHalf,
    },
    /// The battery's contact opens or closes.
    BatteryContact {
        /// Whether the contact is closed.
        connected: bool,
    },
}

const fn one() -> f64 {
    1.0
}

impl WorldStep {
    /// The names of the steps, as in files.
    pub const NAMES: [&'static str; 11] = [
        "jam",
        "payload",
        "push",
        "stand",
        "temperature",
        "vibration",
        "analog-fault",
        "encoder-loss",
        "motor-leads",
        "half-bridge",
        "battery-contact",
    ];

    /// Checks every number.
    ///
    /// # Errors
    /// The error of `within` for the first number out of its range.
    pub fn check(&self, within: Within<'_>) -> Result<(), ScenarioError> {
        match *self {
            Self::Payload {
                mass_kg,
                ahead_m,
                below_m,
            } => {
                within("mass_kg", mass_kg, 0.0, 2000.0)?;
                within("ahead_m", ahead_m, -2.0, 2.0)?;
                within("below_m", below_m, -2.0, 2.0)
            }
            Self::Push {
                forward_n,
                left_n,
                up_n,
                for_s,
                ..
            } => {
                within("forward_n", forward_n, -1e4, 1e4)?;
                within("left_n", left_n, -1e4, 1e4)?;
                within("up_n", up_n, -1e4, 1e4)?;
                within("for_s", for_s, 0.001, 3600.0)
            }
            Self::Temperature { to_c, over_s } => {
                within("to_c", to_c, -40.0, 85.0)?;
                within("over_s", over_s, 0.0, 3600.0)
            }
            Self::Vibration {
                amplitude_m_s2,
                amplitude_rad_s,
                frequency_hz,
            } => {
                within("amplitude_m_s2", amplitude_m_s2, 0.0, 500.0)?;
                within("amplitude_rad_s", amplitude_rad_s, 0.0, 50.0)?;
                within("frequency_hz", frequency_hz, 0.1, 1e4)
            }
            Self::AnalogFault { gain, offset, .. } => {
                within("gain", gain, -10.0, 10.0)?;
                within("offset", offset, -200.0, 200.0)
            }
            Self::EncoderLoss { share, .. } => within("share", share, 0.0, 1.0),
            Self::Jam { .. }
            | Self::Stand { .. }
            | Self::MotorLeads { .. }
            | Self::HalfBridge { .. }
            | Self::BatteryContact { .. } => Ok(()),
        }
    }

    /// Applies the step to the plant.
    pub fn act(&self, plant: &mut Plant) {
        match *self {
            Self::Jam { side, jammed } => plant.set_jammed(side as usize, jammed),
            Self::Payload {
                mass_kg,
                ahead_m,
                below_m,
            } => plant.set_payload(Payload {
                mass_kg,
                ahead_m,
                below_m,
            }),
            Self::Push {
                on,
                forward_n,
                left_n,
                up_n,
                for_s,
            } => plant.push(
                Push {
                    on,
                    forward_n,
                    left_n,
                    up_n,
                },
                for_s,
            ),
            Self::Stand { raised } => plant.set_on_stand(raised),
            Self::Temperature { to_c, over_s } => plant.heat(to_c, over_s),
            Self::Vibration {
                amplitude_m_s2,
                amplitude_rad_s,
                frequency_hz,
            } => plant.shake(&Vibration {
                amplitude_m_s2,
                amplitude_rad_s,
                frequency_hz,
            }),
            Self::AnalogFault {
                sensor,
                reads,
                gain,
                offset,
            } => plant.set_analog_fault(
                sensor.input(),
                AnalogFault {
                    following: reads,
                    gain,
                    offset,
                },
            ),
            Self::EncoderLoss { motor, share } => plant.set_edge_loss(motor as usize, share),
            Self::MotorLeads { motor, leads } => plant.set_leads(motor as usize, leads),
            Self::HalfBridge { motor, dead } => plant.set_dead_half(motor as usize, dead),
            Self::BatteryContact { connected } => plant.set_battery_connected(connected),
        }
    }
}
