//! Chatter: the rotors swing from flank to flank of worn gears.
//!
//! Gears have play. While they carry little torque, a rotor turns freely within the play, and its encoder shows a wheel
//! motion that does not exist. A fast law keeps driving the rotors from flank to flank. The observer sees an unforeseen
//! motion whose sign alternates some twenty times per second. A blow, a slope or a slide pushes the observer's error to
//! one side only. The alternating part therefore distinguishes worn gears from the ground.

use crate::bounded::Bounded;

/// Rate of the mean that is subtracted, per time unit. The mean follows the ground (effects of a tenth of a time unit
/// and longer) but not the chatter.
const MEAN_RATE: f32 = 4.0;
/// Rate of the mean of the remainder, per time unit. The mean spans several time units, in which a blow passes.
const LEVEL_RATE: f32 = 0.25;
/// Largest remainder that counts in one tick, half the size of chatter. A blow is ten times as large but is over within
/// one and a half time units, so it raises the mean to less than [`WORN`].
const ALTERNATING_MAX: f32 = 0.05;
/// Mean above which the gears count as worn, nondimensional: half the mean that chatter produces.
const WORN: f32 = 0.02;

/// The alternating part of the unforeseen joint rates, and whether it has ever indicated worn gears.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Chatter {
    mean: f32,
    level: f32,
    worn: bool,
}

impl Chatter {
    /// One tick: the joint rate beyond what the observer foresaw.
    pub(super) fn update(&mut self, unforeseen: f32, tick: f32) {
        self.mean += MEAN_RATE * tick * (unforeseen - self.mean);
        self.level += LEVEL_RATE * tick * ((unforeseen - self.mean).abs().bounded(0.0, ALTERNATING_MAX) - self.level);
        self.worn |= self.level > WORN;
    }

    /// Whether the gears have chattered since the law started. The answer stays true, because wear is permanent.
    pub(super) fn worn(&self) -> bool {
        self.worn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One tick of the reference vehicle, in time units.
    const TICK: f32 = 0.006_26;

    /// Ticks until the gears count as worn; `None` if that takes more than `most`.
    fn found(most: u32, unforeseen: impl Fn(f32) -> f32) -> Option<u32> {
        let mut chatter = Chatter::default();
        (0..most).find(|&tick| {
            chatter.update(unforeseen(tick as f32 * TICK), TICK);
            chatter.worn()
        })
    }

    #[test]
    fn rotors_between_their_flanks_are_found_within_a_second() {
        // 20 to 30 per second, 0.12 to 0.18 rad of the period's phase per tick.
        for rate in [20.0_f32, 25.0, 30.0] {
            let omega = core::f32::consts::TAU * rate * 0.001 / TICK;
            let ticks = found(1_000, |time| 0.1 * libm::sinf(omega * time));
            assert!(ticks.is_some(), "{rate} per second");
        }
    }

    #[test]
    fn a_steady_motion_and_one_blow_are_not_play() {
        // An unknown slope or a slide: as large as chatter, but to one side.
        assert_eq!(found(60_000, |time| 0.1 * (time / 2.0).min(1.0)), None);
        // Blows of any strength, which the observer forgets within a third of a time unit.
        for blow in [0.2, 1.0, 3.0] {
            assert_eq!(found(60_000, |time| blow * libm::expf(-3.0 * time)), None, "{blow}");
        }
        // Noise of the sensors that never ends.
        assert_eq!(found(60_000, |time| 0.015 * libm::sinf(25.0 * time)), None);
    }
}
