//! Checks of the user's values: each message names the flag, the value and the allowed range.

use report::error::CommandError;

/// Parses a finite number: the value parser of every numeric flag.
///
/// # Errors
/// The allowed values (clap adds the flag and the value).
pub fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("must be a finite number".into()),
    }
}

/// `value` of `flag` if `ok`, else the message with the `allowed` range.
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

/// The largest parameter, gain or friction coefficient: a larger one is a typing mistake and would overflow
/// the arithmetic.
const LARGEST: f64 = 1e6;
/// The largest magnitude of a voltage, reference speed or acceleration.
pub const LARGEST_INPUT: f64 = 1e5;
/// The largest magnitude of an angle (rad) or angular rate at the start of a run.
pub const LARGEST_START: f64 = 1e3;

/// `value` if it is positive and at most the largest parameter.
///
/// # Errors
/// [`CommandError::Input`] naming the flag.
pub fn positive(flag: &str, value: f64) -> Result<f64, CommandError> {
    let ok = value > 0.0 && value <= LARGEST;
    require(flag, value, ok, &format!("positive and at most {LARGEST}"))
}

/// `value` if it is zero or more and at most the largest parameter.
///
/// # Errors
/// [`CommandError::Input`] naming the flag.
pub fn not_negative(flag: &str, value: f64) -> Result<f64, CommandError> {
    let ok = (0.0..=LARGEST).contains(&value);
    require(flag, value, ok, &format!("zero or more and at most {LARGEST}"))
}

/// `value` if it is between `-most` and `most`.
///
/// # Errors
/// [`CommandError::Input`] naming the flag.
pub fn within(flag: &str, value: f64, most: f64) -> Result<f64, CommandError> {
    require(flag, value, value.abs() <= most, &format!("between -{most} and {most}"))
}

/// The available voltage in either direction, given with `flag`; infinite without the flag.
///
/// # Errors
/// [`CommandError::Input`] naming the flag.
pub fn available(flag: &str, voltage: Option<f64>) -> Result<f64, CommandError> {
    voltage.map_or(Ok(f64::INFINITY), |v| positive(flag, v))
}

/// A slope in rad, less steep than a wall.
///
/// # Errors
/// [`CommandError::Input`] naming the flag.
pub fn slope(flag: &str, value: f64) -> Result<f64, CommandError> {
    let ok = value.abs() < std::f64::consts::FRAC_PI_2;
    require(flag, value, ok, "between -pi/2 and pi/2 (rad)")
}

/// A gain, of either sign.
///
/// # Errors
/// [`CommandError::Input`] naming the flag.
pub fn gain(flag: &str, value: f64) -> Result<f64, CommandError> {
    within(flag, value, LARGEST)
}

/// Parses `N` finite numbers separated by commas.
///
/// # Errors
/// The allowed values (clap adds the flag and the value).
pub fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let allowed = || format!("must be {N} finite numbers separated by commas");
    let values: Vec<f64> = text
        .split(',')
        .map(finite)
        .collect::<Result<_, _>>()
        .map_err(|_| allowed())?;
    values.try_into().map_err(|_| allowed())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers_are_checked() {
        assert_eq!(numbers("1,-2.5, 3e2,0"), Ok([1.0, -2.5, 300.0, 0.0]));
        for bad in ["1,2,3", "1,2,3,4,5", "1,2,,4", "1,2,NaN,4", ""] {
            assert_eq!(
                numbers::<4>(bad),
                Err("must be 4 finite numbers separated by commas".into()),
                "{bad}"
            );
        }
    }

    #[test]
    fn only_finite_numbers_pass() {
        assert_eq!(finite("-0.3"), Ok(-0.3));
        for bad in ["NaN", "inf", "-inf", "1e999", "", "one"] {
            assert!(finite(bad).is_err(), "{bad}");
        }
        assert!(positive("--l", 0.0).is_err() && not_negative("--mu", 0.0).is_ok());
        assert!(
            positive("--l", 1e6).is_ok() && positive("--l", 1.1e6).is_err() && not_negative("--mu", 1e300).is_err()
        );
        assert!(gain("--kp", -1e6).is_ok() && within("--voltage", -2.0, 1.0).is_err());
        let message = require("--alpha", 1.5, false, "above 0 and below 1")
            .unwrap_err()
            .to_string();
        assert_eq!(message, "--alpha is 1.5, must be above 0 and below 1");
    }
}
