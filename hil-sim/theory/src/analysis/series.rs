//! Numbers of a sampled series that tables and figures quote.

/// Converts a series from radians to degrees.
pub fn degrees(x: &[f64]) -> Vec<f64> {
    x.iter().map(|x| x.to_degrees()).collect()
}

/// The largest absolute value; 0 for an empty series.
pub fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// The first value; NaN for an empty series.
pub fn first(x: &[f64]) -> f64 {
    x.first().copied().unwrap_or(f64::NAN)
}

/// The last value; NaN for an empty series.
pub fn last(x: &[f64]) -> f64 {
    x.last().copied().unwrap_or(f64::NAN)
}
