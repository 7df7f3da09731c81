//! Checking what the user typed: each message names the flag, the value and what is allowed.

use crate::error::CommandError;

/// Parses a finite number; what clap calls for every numeric flag.
///
/// # Errors
/// What is allowed (clap adds the flag and the value).
pub fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("must be a finite number".into()),
    }
}

/// `value` of `flag` if `ok`, else the message that says what is `allowed`.
///
/// # Errors
/// [`CommandError::Input`]; NaN and infinities never pass.
pub fn require(flag: &str, value: f64, ok: bool, allowed: &str) -> Result<f64, CommandError> {
    if ok && value.is_finite() {
        Ok(value)
    } else {
        Err(CommandError::Input(format!("{flag} is {value}, must be {allowed}")))
    }
}

/// `value` if it is positive.
///
/// # Errors
/// [`CommandError::Input`] naming the flag.
pub fn positive(flag: &str, value: f64) -> Result<f64, CommandError> {
    require(flag, value, value > 0.0, "positive")
}

/// `value` if it is zero or more.
///
/// # Errors
/// [`CommandError::Input`] naming the flag.
pub fn not_negative(flag: &str, value: f64) -> Result<f64, CommandError> {
    require(flag, value, value >= 0.0, "zero or more")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_finite_numbers_pass() {
        assert_eq!(finite("-0.3"), Ok(-0.3));
        for bad in ["NaN", "inf", "-inf", "1e999", "", "one"] {
            assert!(finite(bad).is_err(), "{bad}");
        }
        assert!(positive("--l", 0.0).is_err() && not_negative("--mu", 0.0).is_ok());
        let message = require("--alpha", 1.5, false, "above 0 and below 1")
            .unwrap_err()
            .to_string();
        assert_eq!(message, "--alpha is 1.5, must be above 0 and below 1");
    }
}
