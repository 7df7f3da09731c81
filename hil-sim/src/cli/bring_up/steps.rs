//! The procedure's steps, in order. The page's table is made of them.

use super::powered_steps::POWERED;
use super::step::BringUpStep;
use super::unpowered_steps::UNPOWERED;

/// The steps, in order: all of those without the bridges' supply first.
pub const STEPS: &[BringUpStep] = &joined();

const fn joined() -> [BringUpStep; UNPOWERED.len() + POWERED.len()] {
    let mut steps = [UNPOWERED[0]; UNPOWERED.len() + POWERED.len()];
    let mut at = 0;
    while at < steps.len() {
        steps[at] = if at < UNPOWERED.len() {
            UNPOWERED[at]
        } else {
            POWERED[at - UNPOWERED.len()]
        };
        at += 1;
    }
    steps
}
