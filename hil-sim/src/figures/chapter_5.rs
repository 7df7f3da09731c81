//! Chapter 5: performance envelopes.

use super::Entry;

/// The chapter's figures.
pub const FIGURES: &[Entry] = &[];
