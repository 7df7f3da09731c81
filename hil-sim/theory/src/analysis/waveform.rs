//! The eleven input waveforms of Fig. 5.1.

use std::f64::consts::{FRAC_PI_2, PI};

use clap::ValueEnum;
use serde::Serialize;

/// A monotone waveform `w(s)` from 0 to 1 over `s = t/T` in (0, 1); 0 before, 1 after.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Waveform {
    /// 1 immediately.
    Step,
    /// s.
    Ramp,
    /// (1 - cos pi s) / 2.
    HalfCosine,
    /// s^2.
    ParabolicAccel,
    /// s (2 - s).
    ParabolicDecel,
    /// (1 - e^(-5 s)) / (1 - e^-5).
    ExpK5,
    /// s^2 (3 - 2 s).
    CubicSmoothstep,
    /// sin(pi s / 2).
    QuarterSine,
    /// 1 - cos(pi s / 2).
    QuarterVersine,
    /// s^3 (10 - 15 s + 6 s^2).
    QuinticSmoothstep,
    /// (e^(5 s) - 1) / (e^5 - 1).
    ExpGrowthK5,
}

impl Waveform {
    /// Every waveform, in the order of Fig. 5.1.
    pub const ALL: [Self; 11] = [
        Self::Step,
        Self::Ramp,
        Self::HalfCosine,
        Self::ParabolicAccel,
        Self::ParabolicDecel,
        Self::ExpK5,
        Self::CubicSmoothstep,
        Self::QuarterSine,
        Self::QuarterVersine,
        Self::QuinticSmoothstep,
        Self::ExpGrowthK5,
    ];

    /// The name used on the command line, in JSON and in CSV headers.
    pub fn name(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Ramp => "ramp",
            Self::HalfCosine => "half-cosine",
            Self::ParabolicAccel => "parabolic-accel",
            Self::ParabolicDecel => "parabolic-decel",
            Self::ExpK5 => "exp-k5",
            Self::CubicSmoothstep => "cubic-smoothstep",
            Self::QuarterSine => "quarter-sine",
            Self::QuarterVersine => "quarter-versine",
            Self::QuinticSmoothstep => "quintic-smoothstep",
            Self::ExpGrowthK5 => "exp-growth-k5",
        }
    }

    /// `w(s)`: 0 for `s < 0`, 1 for `s >= 1`; the step is 1 from `s = 0` on.
    pub fn value(self, s: f64) -> f64 {
        if s < 0.0 {
            return 0.0;
        }
        if s >= 1.0 {
            return 1.0;
        }
        match self {
            Self::Step => 1.0,
            Self::Ramp => s,
            Self::HalfCosine => 0.5 * (1.0 - (PI * s).cos()),
            Self::ParabolicAccel => s * s,
            Self::ParabolicDecel => s * (2.0 - s),
            Self::ExpK5 => (-5.0 * s).exp_m1() / (-5.0_f64).exp_m1(),
            Self::CubicSmoothstep => s * s * (3.0 - 2.0 * s),
            Self::QuarterSine => (FRAC_PI_2 * s).sin(),
            Self::QuarterVersine => 1.0 - (FRAC_PI_2 * s).cos(),
            Self::QuinticSmoothstep => s * s * s * (10.0 + s * (-15.0 + 6.0 * s)),
            Self::ExpGrowthK5 => (5.0 * s).exp_m1() / 5.0_f64.exp_m1(),
        }
    }

    /// Duration of the waveform when `ramp_time` is T: 0 for the step.
    pub fn duration(self, ramp_time: f64) -> f64 {
        if self == Self::Step { 0.0 } else { ramp_time }
    }

    /// `w` at the time `t` with the ramp time `ramp_time` (0: a step).
    pub fn at(self, t: f64, ramp_time: f64) -> f64 {
        let duration = self.duration(ramp_time);
        if duration > 0.0 {
            self.value(t / duration)
        } else {
            f64::from(t >= 0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_waveform_is_monotone_from_0_to_1_and_has_its_own_name() {
        for (i, w) in Waveform::ALL.into_iter().enumerate() {
            let values: Vec<f64> = (0..=1000).map(|k| w.at(5.0 * f64::from(k) / 1000.0, 5.0)).collect();
            assert!(values.windows(2).all(|p| p[1] >= p[0]), "{w:?}");
            assert_eq!((w.at(-0.1, 5.0), values[1000], w.at(9.0, 5.0)), (0.0, 1.0, 1.0));
            assert!(
                w == Waveform::Step || (values[0].abs() < 1e-15 && (values[999] - 1.0).abs() < 0.006),
                "{w:?}"
            );
            assert_eq!(Waveform::from_str(w.name(), false), Ok(w));
            assert!(Waveform::ALL[..i].iter().all(|v| v.name() != w.name()));
        }
    }

    #[test]
    fn printed_values_at_a_quarter() {
        let expected = [
            1.0,
            0.25,
            0.146_446_609_4,
            0.0625,
            0.4375,
            0.718_335_3,
            0.156_25,
            0.382_683_432_4,
            0.076_120_467_5,
            0.103_515_625,
            0.016_893_4,
        ];
        for (w, e) in Waveform::ALL.into_iter().zip(expected) {
            assert!((w.value(0.25) - e).abs() < 1e-6, "{w:?} {} {e}", w.value(0.25));
        }
    }
}
