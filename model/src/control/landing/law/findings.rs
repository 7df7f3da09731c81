//! What the law has found out about the vehicle, for status and estimator.

use super::super::obstacle::PushState;
use super::LandingLaw;

impl LandingLaw {
    /// Whether the vehicle is commanded to drive but makes no progress.
    pub fn is_stuck(&self) -> bool {
        self.obstacle.push() == PushState::Stuck
    }

    /// Whether the wheels have just come past what had held them up.
    pub fn is_just_free(&self) -> bool {
        self.obstacle.is_just_free()
    }

    /// Whether the slope is steeper than the arm's weight can balance or the configured grip can hold.
    pub fn slope_limited(&self) -> bool {
        self.slope_limited
    }

    /// Whether the vehicle was armed on a slope on which it cannot stand.
    pub fn refuses_slope(&self) -> bool {
        self.refusal.refuses()
    }
}
