//! Numbered, stable codes and sets of them.

/// Defines an enum of stable codes and the set type that holds them as bits.
macro_rules! codes {
    (
        $(#[doc = $doc:literal])* $code:ident;
        $(#[doc = $set_doc:literal])* $set:ident;
        $( $(#[doc = $meaning:literal])+ $name:ident = $number:literal, )+
    ) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum $code {
            $( $(#[doc = $meaning])+ $name = $number, )+
        }

        impl $code {
            /// Every code, in order of its number.
            pub const ALL: &'static [Self] = &[$(Self::$name),+];

            /// The code's name.
            pub fn name(self) -> &'static str {
                match self { $(Self::$name => stringify!($name)),+ }
            }

            /// What the code means.
            pub fn meaning(self) -> &'static str {
                match self { $(Self::$name => concat!($($meaning),+)),+ }
            }

            const fn bit(self) -> u32 {
                1 << (self as u8)
            }
        }

        $(#[doc = $set_doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(from = "u32", into = "u32"))]
        #[repr(transparent)]
        pub struct $set(u32);

        impl From<u32> for $set {
            fn from(bits: u32) -> Self {
                Self::from_bits(bits)
            }
        }

        impl From<$set> for u32 {
            fn from(set: $set) -> Self {
                set.bits()
            }
        }

        impl $set {
            /// No code.
            pub const EMPTY: Self = Self(0);
            /// Every code.
            pub const FULL: Self = Self($($code::$name.bit())|+);

            /// The set as bits: bit n is code n. Bits of unknown codes are dropped.
            pub const fn from_bits(bits: u32) -> Self {
                Self(bits & Self::FULL.0)
            }

            /// Bit n is code n.
            pub const fn bits(self) -> u32 {
                self.0
            }

            /// Adds a code.
            pub fn insert(&mut self, code: $code) {
                self.0 |= code.bit();
            }

            /// Adds a code if `present`, else removes it.
            pub fn set(&mut self, code: $code, present: bool) {
                if present { self.0 |= code.bit() } else { self.0 &= !code.bit() }
            }

            /// Whether the code is in the set.
            pub const fn contains(self, code: $code) -> bool {
                self.0 & code.bit() != 0
            }

            /// Whether there is no code.
            pub const fn is_empty(self) -> bool {
                self.0 == 0
            }

            /// The codes of either set.
            pub const fn union(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }

            /// The codes of both sets.
            pub const fn intersection(self, other: Self) -> Self {
                Self(self.0 & other.0)
            }

            /// The codes in the set, in order.
            pub fn iter(self) -> impl Iterator<Item = $code> {
                $code::ALL.iter().copied().filter(move |code| self.contains(*code))
            }
        }

        /// The codes' names in order, commas between them; `none` for the empty set.
        impl core::fmt::Display for $set {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                if self.is_empty() {
                    return f.write_str("none");
                }
                for (n, code) in self.iter().enumerate() {
                    f.write_str(if n == 0 { "" } else { ", " })?;
                    f.write_str(code.name())?;
                }
                Ok(())
            }
        }
    };
}

codes! {
    /// Why the vehicle stopped. A fault is latched when it occurs while armed, until it is cleared. Numbers are stable.
    Fault;
    /// A set of faults.
    FaultSet;
    /// The emergency stop was pressed.
    EmergencyStop = 0,
    /// The bridges' hardware break tripped.
    BridgeBreak = 1,
    /// The arm IMU gave no sample in time.
    ImuStale = 2,
    /// The arm IMU repeats one reading, or its readings cannot be true.
    ImuImplausible = 3,
    /// The encoders gave no sample in time.
    EncoderStale = 4,
    /// A wheel's encoder contradicts its motor's voltage and current, or jumped.
    EncoderImplausible = 5,
    /// A drive motor's current exceeded the largest allowed.
    Overcurrent = 6,
    /// The battery is below its lowest voltage.
    BatteryLow = 7,
    /// The battery is above its highest voltage.
    BatteryHigh = 8,
    /// The analogue inputs gave no reading in time.
    AnalogStale = 9,
    /// The arm swung beyond its largest angle: the vehicle is about to whirl.
    ArmAngle = 10,
    /// No drive command came in time.
    CommandTimeout = 11,
    /// A controlled stop did not come to rest in time.
    StopTimeout = 12,
    /// A computed value was not a number.
    NotFinite = 13,
    /// A tick came far too late.
    DeadlineMissed = 14,
    /// The spar tilted beyond its largest angle: the ballast motor is off.
    SparAngle = 15,
    /// The spar IMU gave no believable sample: the ballast motor is off.
    SparImu = 16,
    /// The ballast's encoder contradicts its motor's voltage and current, or jumped: the ballast motor is off.
    BallastEncoder = 17,
    /// The ballast motor's current exceeded the largest allowed: the ballast motor is off.
    BallastOvercurrent = 18,
    /// No current follows the ballast motor's voltage: a lead is open, and the ballast motor is off.
    BallastMotorOpen = 19,
    /// The ballast motor's current sensor does not follow the current, or showed one at an open bridge: the ballast motor is off.
    BallastCurrentSensor = 20,
    /// No current follows the left motor's voltage: a lead is open.
    LeftMotorOpen = 21,
    /// No current follows the right motor's voltage: a lead is open.
    RightMotorOpen = 22,
    /// A drive motor's current sensor does not follow the current.
    CurrentSensor = 23,
}

codes! {
    /// Why the vehicle may not be armed. All are present at boot.
    Blocker;
    /// A set of blockers; full at boot.
    BlockerSet;
    /// The gyros are not calibrated yet: keep the vehicle at rest.
    NotCalibrated = 0,
    /// A latched fault has not been cleared.
    FaultLatched = 1,
    /// The emergency stop is pressed.
    EmergencyStop = 2,
    /// The bridges' hardware break has tripped.
    BridgeBreak = 3,
    /// The arm IMU gives no believable samples.
    Imu = 4,
    /// The encoders give no samples.
    Encoder = 5,
    /// The analogue inputs give no readings.
    Analog = 6,
    /// The battery is outside its range.
    Battery = 7,
    /// The vehicle moves.
    NotAtRest = 8,
    /// The arm hangs beyond half its largest angle.
    ArmAngle = 9,
    /// No fresh drive command.
    NoCommand = 10,
    /// The drive command asks for motion.
    CommandNotNeutral = 11,
    /// Stored parameters are not in force: a change is being stored, or the stored set cannot be believed.
    Parameters = 12,
    /// A drive motor's current sensor shows a current though every bridge is open.
    CurrentSensor = 13,
}

codes! {
    /// What bounds the vehicle's response in this tick. A limit is no fault.
    Limit;
    /// A set of limits.
    LimitSet;
    /// The supply voltage bounds the drive.
    Voltage = 0,
    /// The left motor's current limit.
    LeftCurrent = 1,
    /// The right motor's current limit.
    RightCurrent = 2,
    /// The ballast motor's current limit.
    BallastCurrent = 3,
    /// The reference governor is still on its way to the command.
    Reference = 4,
    /// Something blocks the vehicle: it is told to drive, and its wheels do not turn.
    Stall = 5,
    /// The wheels slide.
    Slip = 6,
}

impl FaultSet {
    /// Faults that open the bridges at once.
    pub const OPENING: Self = Self(Self::FULL.0 & !Self::STOPPING.0 & !Self::SPAR.0);
    /// Faults that bring the vehicle, which can still be controlled, to a controlled stop.
    pub const STOPPING: Self = Self(
        Fault::CommandTimeout.bit() | Fault::BatteryLow.bit() | Fault::AnalogStale.bit() | Fault::CurrentSensor.bit(),
    );
    /// Faults that only switch the ballast motor off.
    pub const SPAR: Self = Self(
        Fault::SparAngle.bit()
            | Fault::SparImu.bit()
            | Fault::BallastEncoder.bit()
            | Fault::BallastOvercurrent.bit()
            | Fault::BallastMotorOpen.bit()
            | Fault::BallastCurrentSensor.bit(),
    );
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::string::ToString;

    use super::*;

    #[test]
    fn a_set_shows_the_names_of_its_codes() {
        let mut faults = FaultSet::EMPTY;
        assert_eq!(faults.to_string(), "none");
        faults.insert(Fault::SparImu);
        assert_eq!(faults.to_string(), "SparImu");
        faults.insert(Fault::ImuStale);
        assert_eq!(faults.to_string(), "ImuStale, SparImu");
    }
}
