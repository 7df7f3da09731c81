//! Metrics of a run.

use std::collections::VecDeque;

use model::supervise::arming::Mode;
use model::supervise::codes::{Fault, FaultSet};
use serde::Serialize;

use super::outcome::{Counts, DriveOutcome};
use super::trace::TraceRow;

/// One metric of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MetricValue {
    /// The metric's name, unit included.
    pub name: &'static str,
    /// The metric's value.
    pub value: f64,
}

/// The kind of a metric's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MetricKind {
    /// Any number, on a continuous scale.
    Measured,
    /// A whole number.
    Count,
    /// The number of a [`Mode`].
    Mode,
    /// The bits of a [`FaultSet`]. The order of these numbers has no meaning.
    Faults,
}

/// The kind of the metric with this name; `None` for an unknown metric.
pub fn kind(name: &str) -> Option<MetricKind> {
    NAMES.contains(&name).then_some(match name {
        "faults" => MetricKind::Faults,
        "final_mode" => MetricKind::Mode,
        "refused_arms"
        | "late_ticks"
        | "board_unreadable_frames"
        | "host_unreadable_frames"
        | "unarmed_drive_ms"
        | "emergency_stop_ms" => MetricKind::Count,
        _ => MetricKind::Measured,
    })
}

impl MetricKind {
    /// The names of `value`, for a kind whose values have names; `None` for an invalid value.
    pub fn names_of(self, value: f64) -> Option<Vec<&'static str>> {
        let bits = value as u32;
        if f64::from(bits) != value {
            return None;
        }
        match self {
            Self::Measured | Self::Count => None,
            Self::Mode => MODES
                .iter()
                .find(|mode| **mode as u32 == bits)
                .map(|mode| vec![mode.name()]),
            Self::Faults => {
                let set = FaultSet::from_bits(bits);
                (set.bits() == bits).then(|| set.iter().map(Fault::name).collect())
            }
        }
    }

    /// The value with these names, or the first unknown name.
    pub(super) fn value_of(self, names: &[String]) -> Result<f64, &str> {
        match (self, names) {
            (Self::Mode, [name]) => {
                let mode = MODES.iter().find(|mode| mode.name() == name).ok_or(name.as_str())?;
                Ok(f64::from(*mode as u32))
            }
            (Self::Faults, names) => {
                let mut set = FaultSet::EMPTY;
                for name in names {
                    let fault = Fault::ALL.iter().find(|fault| fault.name() == name);
                    set.insert(*fault.ok_or(name.as_str())?);
                }
                Ok(f64::from(set.bits()))
            }
            (_, names) => Err(names.first().map_or("", String::as_str)),
        }
    }

    /// Every name of this kind's values.
    pub(super) fn names(self) -> Vec<&'static str> {
        match self {
            Self::Measured | Self::Count => Vec::new(),
            Self::Mode => MODES.iter().map(|mode| mode.name()).collect(),
            Self::Faults => Fault::ALL.iter().map(|fault| fault.name()).collect(),
        }
    }
}

const MODES: [Mode; 3] = [Mode::Disarmed, Mode::Armed, Mode::Stopping];

type Measure = fn(&Metrics, &Counts) -> f64;

/// Every metric: its name, and the function that reads its value from the collected data.
const METRICS: &[(&str, Measure)] = &[
    ("armed_s", |m, _| 0.01 * m.armed_rows as f64),
    ("distance_m", |m, _| m.distance_m),
    ("speed_peak_m_s", |m, _| m.speed.value()),
    ("speed_error_rms_m_s", |m, _| m.speed_error.rms()),
    ("speed_error_peak_m_s", |m, _| m.speed_error.peak.value()),
    ("hold_drift_m", |m, _| m.hold_drift_m()),
    ("phi_peak_deg", |m, _| m.phi_deg.value()),
    ("spar_peak_deg", |m, _| m.spar_deg.value()),
    ("current_peak_a", |m, _| m.current_a.value()),
    ("phi_estimate_error_rms_deg", |m, _| m.phi_error_deg.rms()),
    ("phi_estimate_error_peak_deg", |m, _| m.phi_error_deg.peak.value()),
    ("slope_estimate_error_rms_deg", |m, _| m.slope_error_deg.rms()),
    ("yaw_rate_peak_rad_s", |m, _| m.yaw_rate_rad_s.value()),
    ("heading_change_deg", |m, _| {
        m.last(|r| r.truth.heading_rad.to_degrees())
    }),
    ("heading_estimate_error_deg", |m, _| {
        m.last(|r| {
            (f64::from(r.status.estimate.heading_rad) - r.truth.heading_rad)
                .to_degrees()
                .abs()
        })
    }),
    ("dead_reckoning_drift_m", |m, _| {
        m.last(|r| {
            (f64::from(r.status.estimate.x_m) - r.truth.x_m).hypot(f64::from(r.status.estimate.y_m) - r.truth.y_m)
        })
    }),
    ("sliding_share", |m, _| m.share(m.sliding_rows)),
    ("lifted_share", |m, _| m.share(m.lifted_rows)),
    ("lateral_peak_m", |m, _| m.lateral_m.value()),
    ("final_x_m", |m, _| m.last(|r| r.truth.x_m)),
    ("final_y_m", |m, _| m.last(|r| r.truth.y_m)),
    ("final_mode", |m, _| m.last(|r| f64::from(r.status.mode as u8))),
    ("faults", |m, _| m.last(|r| f64::from(r.status.faults.bits()))),
    ("refused_arms", |m, _| m.last(|r| f64::from(r.status.refused_arms))),
    ("late_ticks", |m, _| m.last(|r| f64::from(r.status.late_ticks))),
    ("board_unreadable_frames", |m, _| {
        m.last(|r| f64::from(r.link.unreadable_frames()))
    }),
    ("host_unreadable_frames", |_, counts| {
        counts.host_unreadable_frames as f64
    }),
    ("unarmed_drive_ms", |_, counts| counts.unarmed_drive_ms as f64),
    ("emergency_stop_ms", |_, counts| {
        counts.emergency_stop_ms.map_or(f64::NAN, |ms| ms as f64)
    }),
];

/// The names of every metric.
pub const NAMES: [&str; METRICS.len()] = {
    let mut names = [""; METRICS.len()];
    let mut i = 0;
    while i < METRICS.len() {
        names[i] = METRICS[i].0;
        i += 1;
    }
    names
};

/// Time after arming that is excluded from errors, s, because the chocks have just been removed.
const SETTLING_S: f64 = 1.0;
/// Length of the end of a run in which a holding vehicle must not move, s.
const HOLD_S: f64 = 2.0;

/// Collects the metrics of a run row by row, with memory use that does not grow with the run.
#[derive(Debug, Clone, Default)]
pub struct Metrics {
    rows: u64,
    armed_rows: u64,
    sliding_rows: u64,
    lifted_rows: u64,
    /// Time at which the vehicle was armed, s; `None` while disarmed.
    armed_at_s: Option<f64>,
    distance_m: f64,
    speed: Peak,
    phi_deg: Peak,
    current_a: Peak,
    yaw_rate_rad_s: Peak,
    lateral_m: Peak,
    spar_deg: Peak,
    speed_error: Errors,
    phi_error_deg: Errors,
    slope_error_deg: Errors,
    last: Option<TraceRow>,
    /// Time and place of the rows of the last [`HOLD_S`].
    places: VecDeque<[f64; 3]>,
}

impl Metrics {
    /// Adds the next row of the run.
    pub fn add(&mut self, row: &TraceRow) {
        let (truth, status, time_s) = (&row.truth, &row.status, row.time_s());
        if let Some(last) = &self.last {
            self.distance_m += (truth.x_m - last.truth.x_m).hypot(truth.y_m - last.truth.y_m);
        }
        self.rows += 1;
        self.sliding_rows += u64::from(truth.sliding[0] || truth.sliding[1]);
        self.lifted_rows += u64::from(truth.lifted[0] || truth.lifted[1]);
        self.speed.add(truth.speed_m_s);
        self.phi_deg.add(truth.phi_rad.to_degrees());
        self.current_a
            .add(truth.current_a[0].abs().max(truth.current_a[1].abs()));
        self.yaw_rate_rad_s.add(truth.yaw_rate_rad_s);
        self.lateral_m.add(truth.y_m);
        if status.mode == Mode::Disarmed {
            self.armed_at_s = None;
        } else {
            self.armed_rows += 1;
            self.armed_at_s.get_or_insert(time_s);
        }
        if self.armed_at_s.is_some_and(|at_s| time_s - at_s > SETTLING_S) {
            let error_deg = |estimated: f32, true_rad: f64| (f64::from(estimated) - true_rad).to_degrees();
            self.spar_deg.add(truth.spar_rad.to_degrees());
            self.speed_error
                .add(truth.speed_m_s - f64::from(status.speed_reference_m_s));
            self.phi_error_deg
                .add(error_deg(status.estimate.phi_rad, truth.phi_rad));
            self.slope_error_deg
                .add(error_deg(status.estimate.slope_rad, truth.slope_rad));
        }
        self.places.push_back([time_s, truth.x_m, truth.y_m]);
        while self.places.front().is_some_and(|[at_s, ..]| *at_s <= time_s - HOLD_S) {
            self.places.pop_front();
        }
        self.last = Some(*row);
    }

    /// Every metric of the rows so far and of the run's counts.
    pub fn values(&self, counts: &Counts) -> Vec<MetricValue> {
        METRICS
            .iter()
            .map(|(name, measure)| MetricValue {
                name,
                value: measure(self, counts),
            })
            .collect()
    }

    fn last(&self, value: fn(&TraceRow) -> f64) -> f64 {
        self.last.as_ref().map_or(f64::NAN, value)
    }

    fn share(&self, rows: u64) -> f64 {
        rows as f64 / self.rows.max(1) as f64
    }

    /// Distance that the vehicle moved in its last two seconds, if it was armed and commanded to stand.
    fn hold_drift_m(&self) -> f64 {
        match (self.places.front(), self.places.back()) {
            (Some([_, x0, y0]), Some([_, x1, y1])) => (x1 - x0).hypot(y1 - y0),
            _ => f64::NAN,
        }
    }
}

/// Every metric of a run.
pub fn measure(outcome: &DriveOutcome) -> Vec<MetricValue> {
    let mut metrics = Metrics::default();
    for row in &outcome.trace.rows {
        metrics.add(row);
    }
    metrics.values(&outcome.counts)
}

/// The largest magnitude of a quantity; NaN before the first value, and after any NaN.
#[derive(Debug, Clone, Copy, Default)]
struct Peak(Option<f64>);

impl Peak {
    fn add(&mut self, value: f64) {
        let value = value.abs();
        // `f64::max` ignores NaN, but a run with a NaN must not look good.
        self.0 = Some(match self.0 {
            Some(largest) if largest.is_nan() || largest >= value => largest,
            _ => value,
        });
    }

    fn value(self) -> f64 {
        self.0.unwrap_or(f64::NAN)
    }
}

/// Mean square and peak of an error.
#[derive(Debug, Clone, Copy, Default)]
struct Errors {
    squares: f64,
    count: u64,
    peak: Peak,
}

impl Errors {
    fn add(&mut self, value: f64) {
        self.squares += value * value;
        self.count += 1;
        self.peak.add(value);
    }

    fn rms(self) -> f64 {
        (self.squares / self.count as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_metric_has_a_kind_and_its_names_stand_for_its_values() {
        assert_eq!(kind("beauty"), None);
        assert!(NAMES.iter().all(|name| kind(name).is_some()));
        let faults = kind("faults").expect("a metric");
        assert_eq!(faults.names_of(3.0), Some(vec!["EmergencyStop", "BridgeBreak"]));
        assert_eq!(faults.names_of(0.0), Some(vec![]));
        for none in [0.5, -1.0, f64::NAN, f64::from(u32::MAX)] {
            assert_eq!(faults.names_of(none), None, "{none}");
        }
        let named = ["BridgeBreak".to_owned(), "EmergencyStop".to_owned()];
        assert_eq!(faults.value_of(&named), Ok(3.0));
        assert_eq!(faults.value_of(&["Sadness".to_owned()]), Err("Sadness"));
        let mode = kind("final_mode").expect("a metric");
        assert_eq!((mode.names_of(2.0), mode.names_of(3.0)), (Some(vec!["stopping"]), None));
        assert_eq!(mode.value_of(&["armed".to_owned()]), Ok(1.0));
        assert!(mode.value_of(&["armed".to_owned(), "disarmed".to_owned()]).is_err());
    }

    #[test]
    fn the_largest_of_values_with_one_that_is_no_number_is_no_number() {
        let nan = f64::NAN;
        let largest = |values: &[f64]| {
            let mut peak = Peak::default();
            for value in values {
                peak.add(*value);
            }
            peak.value()
        };
        assert_eq!(largest(&[1.0, -3.0, 2.0]), 3.0);
        for values in [[nan, 1.0, 2.0], [1.0, nan, 2.0], [1.0, 2.0, nan]] {
            assert!(largest(&values).is_nan(), "{values:?}");
        }
        assert!(largest(&[]).is_nan());
        assert_eq!(largest(&[0.0, f64::INFINITY]), f64::INFINITY);
    }
}
