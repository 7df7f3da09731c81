//! A part of numbered runs, and its batches.

use std::ops::Range;

use report::error::CommandError;
use virtual_board::campaign::part;

/// Part `index` of `count`, counted from 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shard {
    index: u64,
    count: u64,
}

impl Shard {
    /// All runs.
    pub(super) const WHOLE: Self = Self { index: 1, count: 1 };

    /// The numbers of this part's runs, out of `runs`.
    pub(super) fn of(self, runs: u64) -> Range<u64> {
        part(runs, self.index, self.count)
    }
}

/// Parses a part from `I/N`.
pub(super) fn shard(text: &str) -> Result<Shard, String> {
    let parts = text
        .split_once('/')
        .map(|(index, count)| (index.parse(), count.parse()));
    match parts {
        Some((Ok(index), Ok(count))) if 1 <= index && index <= count => Ok(Shard { index, count }),
        _ => Err("must be I/N, two whole numbers from 1 on, I at most N".to_owned()),
    }
}

/// A pool of `jobs` threads; without `jobs`, one thread per core.
pub(super) fn threads(jobs: Option<u16>) -> Result<rayon::ThreadPool, CommandError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(jobs.map_or(0, usize::from))
        .build()
        .map_err(|error| CommandError::Other(error.to_string()))
}

/// `range` in pieces of at most `size`.
pub(super) fn batches(range: Range<u64>, size: u64) -> impl Iterator<Item = Range<u64>> {
    let end = range.end;
    range
        .step_by(size.max(1) as usize)
        .map(move |start| start..(start + size.max(1)).min(end))
}
