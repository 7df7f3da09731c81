//! Chapter 4: contact forces and slip.

use super::Entry;

/// The chapter's figures.
pub const FIGURES: &[Entry] = &[];
