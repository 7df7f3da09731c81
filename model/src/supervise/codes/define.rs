//! Macros that define codes and sets of them.

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

            /// The set with these bits: bit n is code n. Bits of unknown codes are dropped.
            pub const fn from_bits(bits: u32) -> Self {
                Self(bits & Self::FULL.0)
            }

            /// The set as bits: bit n is code n.
            pub const fn bits(self) -> u32 {
                self.0
            }

            /// Adds a code.
            pub fn insert(&mut self, code: $code) {
                self.0 |= code.bit();
            }

            /// The set with a code added.
            pub const fn with(self, code: $code) -> Self {
                Self(self.0 | code.bit())
            }

            /// Adds a code if `present`.
            #[inline]
            pub fn insert_if(&mut self, code: $code, present: bool) {
                if present {
                    self.insert(code);
                }
            }

            /// Adds a code if `present`, else removes it.
            pub fn set(&mut self, code: $code, present: bool) {
                if present { self.0 |= code.bit() } else { self.0 &= !code.bit() }
            }

            /// Whether the code is in the set.
            pub const fn contains(self, code: $code) -> bool {
                self.0 & code.bit() != 0
            }

            /// Whether the set is empty.
            pub const fn is_empty(self) -> bool {
                self.0 == 0
            }

            /// The codes of either set.
            pub const fn union(self, other: Self) -> Self {
                Self(self.0 | other.0)
            }

            /// Whether any code is in both sets.
            pub const fn has_any(self, other: Self) -> bool {
                self.0 & other.0 != 0
            }

            /// The codes in the set, in order.
            pub fn iter(self) -> impl Iterator<Item = $code> {
                $code::ALL.iter().copied().filter(move |code| self.contains(*code))
            }
        }

        /// The codes' names in order, separated by commas; `none` for the empty set.
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

/// Defines codes as [`codes!`] does, each with its remedy.
macro_rules! remedied_codes {
    (
        $(#[doc = $doc:literal])* $code:ident;
        $(#[doc = $set_doc:literal])* $set:ident;
        $( $(#[doc = $meaning:literal])+ $name:ident = $number:literal => $remedy:literal, )+
    ) => {
        codes! {
            $(#[doc = $doc])* $code;
            $(#[doc = $set_doc])* $set;
            $( $(#[doc = $meaning])+ $name = $number, )+
        }

        impl $code {
            /// What the operator must do before clearing the fault, or to remove the blocker.
            pub fn remedy(self) -> &'static str {
                match self { $(Self::$name => $remedy),+ }
            }
        }
    };
}

/// Defines [`Fault`] as [`remedied_codes!`] does. Each fault also has its class, its detection, and its reaction
/// time: the row of the safety page.
macro_rules! faults {
    (
        $(#[doc = $doc:literal])* $code:ident;
        $(#[doc = $set_doc:literal])* $set:ident;
        $(
            $(#[doc = $meaning:literal])+
            $name:ident = $number:literal => $class:ident($by:literal, $bound:literal, $remedy:literal)
            $(for $ticks:literal ticks)?,
        )+
    ) => {
        remedied_codes! {
            $(#[doc = $doc])* $code;
            $(#[doc = $set_doc])* $set;
            $( $(#[doc = $meaning])+ $name = $number => $remedy, )+
        }

        impl $code {
            /// For each fault, in order: its class, how the vehicle detects it, and the time from the cause to the
            /// bridges' reaction.
            pub const DETECTION: &'static [(FaultClass, &'static str, &'static str)] =
                &[$((FaultClass::$class, concat!($by $(, " for ", $ticks, " ticks")?), $bound)),+];

            /// Ticks in a row for which the fault's cause must be present: 1 but for a debounced fault.
            pub const fn debounce_ticks(self) -> u16 {
                match self { $(Self::$name => 1 $(* $ticks)?),+ }
            }

            /// Number of debounced faults.
            pub const DEBOUNCED: usize = Self::debounced_before(Self::ALL.len());

            /// The place of a debounced fault among those.
            pub const fn debounce_place(self) -> usize {
                match self { $(Self::$name => const { Self::debounced_before(Self::$name as usize) }),+ }
            }

            const fn debounced_before(number: usize) -> usize {
                let (mut count, mut n) = (0, 0);
                while n < number {
                    if Self::ALL[n].debounce_ticks() > 1 {
                        count += 1;
                    }
                    n += 1;
                }
                count
            }
        }
    };
}
