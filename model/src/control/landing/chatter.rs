//! Chatter: the rotors swing from flank to flank of worn gears.
//!
//! The gears have play. Where they carry little torque, a rotor turns freely within it, and its encoder shows a motion of
//! the wheel that is none. A fast law drives the rotors on, from flank to flank. The observer takes that motion for one that
//! it did not foresee, with a sign that alternates some twenty times a second; a blow, a slope and a slide push it to one
//! side. So what alternates tells worn gears from what the ground does.

use crate::bounded::Bounded;

/// Rate of the mean that is taken away, per time unit. It follows what the ground does, a tenth of a time unit and longer,
/// and not the chatter.
const MEAN_RATE: f32 = 4.0;
/// Rate of the mean of what is left, per time unit: several time units, in which a blow passes.
const LEVEL_RATE: f32 = 0.25;
/// What counts of it in one tick at most, half of what chatter has: a blow is ten times as large, and over within a time
/// unit and a half, in which it brings the mean to less than [`WORN`].
const ALTERNATING_MAX: f32 = 0.05;
/// Mean from which the gears are worn, nondimensional: half of what chatter brings it to.
const WORN: f32 = 0.02;

/// What alternates in the joint rates that the observer did not foresee, and whether it was ever that of worn gears.
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

    /// The gears have chattered since the law started. Wear stays.
    pub(super) fn worn(&self) -> bool {
        self.worn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Time units of a tick of the reference vehicle.
    const TICK: f32 = 0.006_26;

    /// Ticks until the gears are taken for worn, of at most `most`.
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
        // A slope that nobody told, a slide: as large as chatter, to one side.
        assert_eq!(found(60_000, |time| 0.1 * (time / 2.0).min(1.0)), None);
        // Blows that the observer forgets within a third of a time unit, however hard.
        for blow in [0.2, 1.0, 3.0] {
            assert_eq!(found(60_000, |time| blow * libm::expf(-3.0 * time)), None, "{blow}");
        }
        // Noise of the sensors that never ends.
        assert_eq!(found(60_000, |time| 0.015 * libm::sinf(25.0 * time)), None);
    }
}
