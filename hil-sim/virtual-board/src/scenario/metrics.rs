//! Metrics of a run.

use model::supervise::arming::Mode;
use serde::Serialize;

use super::outcome::DriveOutcome;
use super::trace::Row;

/// One metric of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MetricValue {
    /// Its name, unit included.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
}

type Measure = fn(&DriveOutcome) -> f64;

/// Every metric: name and how it is measured.
const METRICS: &[(&str, Measure)] = &[
    ("armed_s", |o| {
        0.01 * o.trace.rows.iter().filter(|r| armed(r)).count() as f64
    }),
    ("distance_m", |o| {
        o.trace
            .rows
            .windows(2)
            .map(|w| (w[1].truth.x_m - w[0].truth.x_m).hypot(w[1].truth.y_m - w[0].truth.y_m))
            .sum()
    }),
    ("speed_peak_m_s", |o| peak(o, |r| r.truth.speed_m_s)),
    ("speed_error_rms_m_s", |o| rms(driving(o, speed_error))),
    ("speed_error_peak_m_s", |o| largest(driving(o, speed_error))),
    ("hold_drift_m", hold_drift_m),
    ("phi_peak_deg", |o| peak(o, |r| r.truth.phi_rad.to_degrees())),
    ("spar_peak_deg", |o| {
        largest(driving(o, |r| r.truth.spar_rad.to_degrees()))
    }),
    ("current_peak_a", |o| {
        peak(o, |r| r.truth.current_a[0].abs().max(r.truth.current_a[1].abs()))
    }),
    ("phi_estimate_error_rms_deg", |o| rms(driving(o, phi_error_deg))),
    ("phi_estimate_error_peak_deg", |o| largest(driving(o, phi_error_deg))),
    ("slope_estimate_error_rms_deg", |o| {
        rms(driving(o, |r| {
            (f64::from(r.status.estimate.slope_rad) - r.truth.slope_rad).to_degrees()
        }))
    }),
    ("yaw_rate_peak_rad_s", |o| peak(o, |r| r.truth.yaw_rate_rad_s)),
    ("heading_change_deg", |o| last(o, |r| r.truth.heading_rad.to_degrees())),
    ("heading_estimate_error_deg", |o| {
        last(o, |r| {
            (f64::from(r.status.estimate.heading_rad) - r.truth.heading_rad)
                .to_degrees()
                .abs()
        })
    }),
    ("dead_reckoning_drift_m", |o| {
        last(o, |r| {
            (f64::from(r.status.estimate.x_m) - r.truth.x_m).hypot(f64::from(r.status.estimate.y_m) - r.truth.y_m)
        })
    }),
    ("sliding_share", |o| {
        o.trace
            .rows
            .iter()
            .filter(|r| r.truth.sliding[0] || r.truth.sliding[1])
            .count() as f64
            / o.trace.rows.len().max(1) as f64
    }),
    ("lifted_share", |o| {
        o.trace
            .rows
            .iter()
            .filter(|r| r.truth.lifted[0] || r.truth.lifted[1])
            .count() as f64
            / o.trace.rows.len().max(1) as f64
    }),
    ("lateral_peak_m", |o| peak(o, |r| r.truth.y_m)),
    ("final_x_m", |o| last(o, |r| r.truth.x_m)),
    ("final_y_m", |o| last(o, |r| r.truth.y_m)),
    ("final_mode", |o| last(o, |r| f64::from(r.status.mode as u8))),
    ("faults", |o| last(o, |r| f64::from(r.status.faults.bits()))),
    ("refused_arms", |o| last(o, |r| f64::from(r.status.refused_arms))),
    ("late_ticks", |o| last(o, |r| f64::from(r.status.late_ticks))),
    ("board_bad_frames", |o| {
        last(o, |r| f64::from(r.link.unreadable_frames()))
    }),
    ("host_bad_frames", |o| o.bad_frames as f64),
    ("unarmed_drive_ms", |o| o.unarmed_drive_ms as f64),
    ("emergency_stop_ms", |o| {
        o.emergency_stop_ms.map_or(f64::NAN, |ms| ms as f64)
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

/// Every metric of a run.
pub fn measure(outcome: &DriveOutcome) -> Vec<MetricValue> {
    METRICS
        .iter()
        .map(|(name, measure)| MetricValue {
            name,
            value: measure(outcome),
        })
        .collect()
}

fn armed(row: &Row) -> bool {
    row.status.mode != Mode::Disarmed
}

/// Settling time left out of errors after arming: the chocks are just gone, s.
const SETTLING_S: f64 = 1.0;

/// The values of a quantity while driving: armed for a while.
fn driving(outcome: &DriveOutcome, value: fn(&Row) -> f64) -> impl Iterator<Item = f64> {
    let mut armed_at = f64::INFINITY;
    outcome.trace.rows.iter().filter_map(move |row| {
        if !armed(row) {
            armed_at = f64::INFINITY;
        } else if armed_at.is_infinite() {
            armed_at = row.time_s();
        }
        (row.time_s() - armed_at > SETTLING_S).then(|| value(row))
    })
}

fn speed_error(row: &Row) -> f64 {
    row.truth.speed_m_s - f64::from(row.status.speed_reference_m_s)
}

fn phi_error_deg(row: &Row) -> f64 {
    (f64::from(row.status.estimate.phi_rad) - row.truth.phi_rad).to_degrees()
}

/// How far the vehicle moved in its last two seconds, if it was armed and told to stand.
fn hold_drift_m(outcome: &DriveOutcome) -> f64 {
    let rows = &outcome.trace.rows;
    let Some(last) = rows.last() else { return f64::NAN };
    let Some(before) = rows.iter().find(|r| r.time_s() > last.time_s() - 2.0) else {
        return f64::NAN;
    };
    (last.truth.x_m - before.truth.x_m).hypot(last.truth.y_m - before.truth.y_m)
}

fn peak(outcome: &DriveOutcome, value: fn(&Row) -> f64) -> f64 {
    largest(outcome.trace.rows.iter().map(value))
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    // `f64::max` passes over what is not a number; a run that has one must not look good.
    values
        .map(f64::abs)
        .reduce(|largest, value| {
            if largest.is_nan() || largest >= value {
                largest
            } else {
                value
            }
        })
        .unwrap_or(f64::NAN)
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_u32), |(sum, count), value| (sum + value * value, count + 1));
    (sum / f64::from(count)).sqrt()
}

fn last(outcome: &DriveOutcome, value: fn(&Row) -> f64) -> f64 {
    outcome.trace.rows.last().map_or(f64::NAN, value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_of_values_with_one_that_is_no_number_is_no_number() {
        let nan = f64::NAN;
        assert_eq!(largest([1.0, -3.0, 2.0].into_iter()), 3.0);
        for values in [[nan, 1.0, 2.0], [1.0, nan, 2.0], [1.0, 2.0, nan]] {
            assert!(largest(values.into_iter()).is_nan(), "{values:?}");
        }
        assert!(largest(std::iter::empty()).is_nan());
        assert_eq!(largest([0.0, f64::INFINITY].into_iter()), f64::INFINITY);
    }
}
