//! Chapter 3: step responses, whirl, and the speed law.

use super::Entry;

/// The chapter's figures.
pub const FIGURES: &[Entry] = &[];
