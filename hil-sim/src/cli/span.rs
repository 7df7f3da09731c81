//! The flags of a run's span and sampling.

use clap::Args;

use crate::cli::values::{finite, positive, require};
use crate::error::CommandError;

/// Samples a run may have: beyond it a typing mistake would fill the memory.
const MOST_SAMPLES: f64 = 5e6;

/// How long to run and how often to sample.
#[derive(Debug, Clone, Args)]
pub struct SpanArguments {
    /// Length of the run in time units, > 0
    #[arg(long, value_name = "T", value_parser = finite, allow_hyphen_values = true)]
    pub t_end: Option<f64>,
    /// Time between samples, > 0
    #[arg(long, value_name = "DT", value_parser = finite, allow_hyphen_values = true)]
    pub sample: Option<f64>,
}

impl SpanArguments {
    /// Length and sample time, checked; `t_end` and `sample` where not given.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the flag, the value and the allowed range.
    pub fn resolve(&self, t_end: f64, sample: f64) -> Result<(f64, f64), CommandError> {
        let t_end = positive("--t-end", self.t_end.unwrap_or(t_end))?;
        let sample = positive("--sample", self.sample.unwrap_or(sample))?;
        let allowed = format!("at least --t-end / {MOST_SAMPLES}");
        require("--sample", sample, t_end / sample <= MOST_SAMPLES, &allowed)?;
        Ok((t_end, sample))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_checked() {
        let with = |t_end, sample| SpanArguments { t_end, sample }.resolve(10.0, 0.1);
        assert_eq!(with(None, None).unwrap(), (10.0, 0.1));
        assert_eq!(with(Some(3.0), Some(1.0)).unwrap(), (3.0, 1.0));
        for (t_end, sample) in [(Some(0.0), None), (None, Some(-1.0)), (Some(1e9), Some(1e-9))] {
            assert!(matches!(with(t_end, sample), Err(CommandError::Input(_))));
        }
    }
}
