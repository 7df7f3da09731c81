//! What tables and figures quote of a sampled series.

/// The series in degrees, given in radians.
pub fn degrees(x: &[f64]) -> Vec<f64> {
    x.iter().map(|x| x.to_degrees()).collect()
}

/// The largest absolute value; 0 if there is none.
pub fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// The first value; NaN if there is none.
pub fn first(x: &[f64]) -> f64 {
    x.first().copied().unwrap_or(f64::NAN)
}

/// The last value; NaN if there is none.
pub fn last(x: &[f64]) -> f64 {
    x.last().copied().unwrap_or(f64::NAN)
}
