//! Finds an encoder that stands while its motor turns.

use super::reading::RESIDUAL_TICKS;

/// Angle by which the motor has certainly turned since its encoder last advanced, in steps, in either direction, because a
/// loop that is closed through a dead encoder swings. A voltage that alternates within some ticks, as noise and vibration
/// make it, turns no motor: it makes no steps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Silence {
    count: i32,
    /// Ticks in which the motor certainly turned.
    ticks: u16,
    steps: u16,
    /// Angle since the last step, rad, and the ticks in which the motor certainly turned since then.
    turned_rad: f32,
    step_ticks: u16,
}

/// An encoder counts as standing while its count stays within this many edges: with one dead line of two it toggles.
const SILENT_COUNTS: u32 = 4;
/// One step, rad at the output, and the steps after which an encoder that stands is dead: 0.1 rad, of which a thousand
/// edges are then missing. A step takes at most this many ticks, a certain rate of 0.125 rad/s: what adds up more slowly is
/// the rest of a voltage that alternates, whose halves are not sampled alike.
const STEP_RAD: f32 = 0.025;
const STEP_TICKS: u16 = 200;
const SILENT_STEPS: u16 = 4;

impl Silence {
    /// Takes one tick's count. Returns whether the encoder stands.
    #[inline]
    pub fn update(&mut self, count: i32) -> bool {
        let stands = count.wrapping_sub(self.count).unsigned_abs() <= SILENT_COUNTS;
        if !stands {
            *self = Self {
                count,
                ..Self::default()
            };
        }
        stands
    }

    /// Adds the angle by which the motor certainly turned in a tick in which its encoder stands, rad. Returns whether the
    /// encoder is dead.
    pub fn turn(&mut self, turned_rad: f32) -> bool {
        self.ticks = self.ticks.saturating_add(1);
        self.step_ticks += 1;
        self.turned_rad += turned_rad;
        let steps = self.turned_rad.abs() >= STEP_RAD;
        if steps || self.step_ticks >= STEP_TICKS {
            self.steps = self.steps.saturating_add(u16::from(steps));
            self.turned_rad = 0.0;
            self.step_ticks = 0;
        }
        self.ticks >= RESIDUAL_TICKS && self.steps >= SILENT_STEPS
    }

    /// Whether the motor has certainly turned.
    pub fn is_raised(&self) -> bool {
        self.steps > 0
    }
}
