//! The flags of a run's span and sampling.

use clap::Args;

use crate::commands::values::{finite, positive, require};
use report::error::CommandError;

/// Largest number of samples of a run. With columns, charts and JSON, a sample of the widest run (`spatial`) takes 700
/// bytes, so a run stays within 400 MB for any input.
const MOST_SAMPLES: f64 = 500_000.0;
/// The longest run, in time units: hours of driving.
const LONGEST: f64 = 1e5;
/// Default time between samples, in time units; longer if a run would have too many samples.
const PRINTED_SAMPLE: f64 = 0.05;

/// How long to run and how often to sample.
#[derive(Debug, Clone, Args)]
pub struct SpanArguments {
    /// Length of the run in time units, > 0 [default: 60 for simulate, 10 for spatial, 100 for camera and coupled]
    #[arg(long, value_name = "T", value_parser = finite, allow_hyphen_values = true)]
    pub t_end: Option<f64>,
    /// Time between samples in time units, > 0 [default: 0.05, or a 500,000th of the run if that is longer]
    #[arg(long, value_name = "DT", value_parser = finite, allow_hyphen_values = true)]
    pub sample: Option<f64>,
}

impl SpanArguments {
    /// Checked length and sample time. The defaults are `t_end`, and `PRINTED_SAMPLE` or the time that gives the
    /// largest number of samples.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the flag, the value and the allowed range.
    pub fn resolve(&self, t_end: f64) -> Result<(f64, f64), CommandError> {
        let t_end = self.t_end.unwrap_or(t_end);
        let allowed = format!("positive and at most {LONGEST}");
        require("--t-end", t_end, t_end > 0.0 && t_end <= LONGEST, &allowed)?;
        let least = t_end / MOST_SAMPLES;
        let sample = positive("--sample", self.sample.unwrap_or(PRINTED_SAMPLE.max(least)))?;
        let allowed = format!("from --t-end / {MOST_SAMPLES} = {least} to --t-end = {t_end}");
        require("--sample", sample, (least..=t_end).contains(&sample), &allowed)?;
        Ok((t_end, sample))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_checked() {
        let with = |t_end, sample| SpanArguments { t_end, sample }.resolve(10.0);
        assert_eq!(with(None, None).unwrap(), (10.0, PRINTED_SAMPLE));
        assert_eq!(with(Some(3.0), Some(3.0)).unwrap(), (3.0, 3.0));
        assert_eq!(with(Some(1e5), None).unwrap(), (1e5, 0.2));
        assert_eq!(with(Some(1e5), Some(0.2)).unwrap(), (1e5, 0.2));
        for (t_end, sample) in [
            (Some(0.0), None),
            (None, Some(-1.0)),
            (Some(1e5), Some(0.199)),
            (Some(10.0), Some(1e-300)),
            (Some(1.1e5), Some(10.0)),
            (None, Some(10.1)),
        ] {
            assert!(matches!(with(t_end, sample), Err(CommandError::Input(_))));
        }
    }
}
