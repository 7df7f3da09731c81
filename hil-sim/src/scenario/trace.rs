//! What a run leaves behind: one row every 10 ms of what the vehicle reported and what was true.

use firmware::link::message::LinkCounters;
use model::status::Status;

use crate::plant::Truth;
use crate::plot::{Chart, Columns, Series};

/// One row.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// What the operator commanded: speed (m/s) and yaw rate (rad/s).
    pub commanded: [f64; 2],
    /// What the vehicle reported.
    pub status: Status,
    /// Counters of the board's end of the link.
    pub link: LinkCounters,
    /// What was true when the vehicle sensed.
    pub truth: Truth,
    /// Whether any bridge was on.
    pub bridges_on: bool,
}

impl Row {
    /// Time of the row, s.
    pub fn time_s(&self) -> f64 {
        self.status.time_us as f64 * 1e-6
    }
}

/// Every row of a run.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// In order of time.
    pub rows: Vec<Row>,
}

type Value = fn(&Row) -> f64;

/// The terms of the speed law, by the names of the chart.
const SPEED_TERMS: &[(&str, Value)] = &[
    ("feed-forward", |r| f64::from(r.status.terms.speed.feed_forward_v)),
    ("weight", |r| f64::from(r.status.terms.speed.weight_v)),
    ("speed feedback", |r| f64::from(r.status.terms.speed.speed_feedback_v)),
    ("swing rate", |r| f64::from(r.status.terms.speed.swing_rate_v)),
    ("swing damping", |r| f64::from(r.status.terms.speed.swing_damping_v)),
    ("friction", |r| f64::from(r.status.terms.speed.friction_v)),
    ("guard", |r| f64::from(r.status.terms.speed.guard_v)),
    ("trim", |r| f64::from(r.status.terms.speed.trim_v)),
];

/// The columns of the CSV file.
const COLUMNS: &[(&str, Value)] = &[
    ("time_s", Row::time_s),
    ("mode", |r| f64::from(r.status.mode as u8)),
    ("faults", |r| f64::from(r.status.faults.bits())),
    ("blockers", |r| f64::from(r.status.blockers.bits())),
    ("limits", |r| f64::from(r.status.limits.bits())),
    ("commanded_speed_m_s", |r| r.commanded[0]),
    ("speed_reference_m_s", |r| f64::from(r.status.speed_reference_m_s)),
    ("true_speed_m_s", |r| r.truth.speed_m_s),
    ("estimated_speed_m_s", |r| f64::from(r.status.estimate.speed_m_s)),
    ("true_phi_rad", |r| r.truth.phi_rad),
    ("estimated_phi_rad", |r| f64::from(r.status.estimate.phi_rad)),
    ("true_slope_rad", |r| r.truth.slope_rad),
    ("estimated_slope_rad", |r| f64::from(r.status.estimate.slope_rad)),
    ("commanded_yaw_rate_rad_s", |r| r.commanded[1]),
    ("true_yaw_rate_rad_s", |r| r.truth.yaw_rate_rad_s),
    ("estimated_yaw_rate_rad_s", |r| {
        f64::from(r.status.estimate.yaw_rate_rad_s)
    }),
    ("true_heading_rad", |r| r.truth.heading_rad),
    ("estimated_heading_rad", |r| f64::from(r.status.estimate.heading_rad)),
    ("true_x_m", |r| r.truth.x_m),
    ("true_y_m", |r| r.truth.y_m),
    ("estimated_x_m", |r| f64::from(r.status.estimate.x_m)),
    ("estimated_y_m", |r| f64::from(r.status.estimate.y_m)),
    ("true_spar_rad", |r| r.truth.spar_rad),
    ("estimated_spar_rad", |r| f64::from(r.status.estimate.spar_rad)),
    ("true_ballast_rad", |r| r.truth.ballast_rad),
    ("commanded_left_voltage_v", |r| f64::from(r.status.voltage_v[0])),
    ("commanded_right_voltage_v", |r| f64::from(r.status.voltage_v[1])),
    ("commanded_ballast_voltage_v", |r| f64::from(r.status.voltage_v[2])),
    ("true_left_current_a", |r| r.truth.current_a[0]),
    ("true_right_current_a", |r| r.truth.current_a[1]),
    ("true_ballast_current_a", |r| r.truth.current_a[2]),
    ("true_battery_v", |r| r.truth.battery_v),
    ("true_left_normal_n", |r| r.truth.normal_n[0]),
    ("true_right_normal_n", |r| r.truth.normal_n[1]),
    ("true_left_slip_m_s", |r| r.truth.slip_m_s[0]),
    ("true_right_slip_m_s", |r| r.truth.slip_m_s[1]),
    ("yaw_rate_reference_rad_s", |r| {
        f64::from(r.status.yaw_rate_reference_rad_s)
    }),
    ("estimated_ballast_rad", |r| f64::from(r.status.estimate.ballast_rad)),
    ("estimated_gyro_bias_rad_s", |r| {
        f64::from(r.status.estimate.gyro_bias_rad_s)
    }),
    ("term_speed_feed_forward_v", |r| {
        f64::from(r.status.terms.speed.feed_forward_v)
    }),
    ("term_speed_weight_v", |r| f64::from(r.status.terms.speed.weight_v)),
    ("term_speed_feedback_v", |r| {
        f64::from(r.status.terms.speed.speed_feedback_v)
    }),
    ("term_speed_swing_rate_v", |r| {
        f64::from(r.status.terms.speed.swing_rate_v)
    }),
    ("term_speed_swing_damping_v", |r| {
        f64::from(r.status.terms.speed.swing_damping_v)
    }),
    ("term_speed_friction_v", |r| f64::from(r.status.terms.speed.friction_v)),
    ("term_speed_guard_v", |r| f64::from(r.status.terms.speed.guard_v)),
    ("term_speed_trim_v", |r| f64::from(r.status.terms.speed.trim_v)),
    ("term_steering_feed_forward_v", |r| {
        f64::from(r.status.terms.steering.feed_forward_v)
    }),
    ("term_steering_proportional_v", |r| {
        f64::from(r.status.terms.steering.proportional_v)
    }),
    ("term_steering_integral_v", |r| {
        f64::from(r.status.terms.steering.integral_v)
    }),
    ("term_steering_hold_v", |r| f64::from(r.status.terms.steering.hold_v)),
    ("term_spar_v", |r| f64::from(r.status.terms.spar.spar_v)),
    ("term_spar_ballast_v", |r| f64::from(r.status.terms.spar.ballast_v)),
    ("term_spar_rate_v", |r| f64::from(r.status.terms.spar.spar_rate_v)),
    ("term_spar_ballast_rate_v", |r| {
        f64::from(r.status.terms.spar.ballast_rate_v)
    }),
];

impl Trace {
    /// The values of one quantity.
    pub fn values(&self, value: impl Fn(&Row) -> f64) -> Vec<f64> {
        self.rows.iter().map(value).collect()
    }

    /// The whole trace as a table.
    pub fn columns(&self) -> Columns {
        COLUMNS.iter().fold(Columns::new(), |columns, (name, value)| {
            columns.with(*name, self.values(value))
        })
    }

    /// The charts of the report: file name and chart.
    pub fn charts(&self) -> Vec<(&'static str, Chart)> {
        let t = self.values(Row::time_s);
        let over_time = |title: &str, unit: &str, curves: &[(&str, Value)]| {
            curves
                .iter()
                .fold(Chart::new(title, "time, s", unit), |chart, (name, value)| {
                    chart.with(Series::new(*name, &t, &self.values(value)))
                })
        };
        vec![
            (
                "speed",
                over_time(
                    "Speed",
                    "m/s",
                    &[
                        ("commanded", |r| r.commanded[0]),
                        ("reference", |r| f64::from(r.status.speed_reference_m_s)),
                        ("true", |r| r.truth.speed_m_s),
                    ],
                ),
            ),
            (
                "phi",
                over_time(
                    "Arm angle phi from the vertical",
                    "deg",
                    &[
                        ("true", |r| r.truth.phi_rad.to_degrees()),
                        ("estimated", |r| f64::from(r.status.estimate.phi_rad).to_degrees()),
                        ("slope, true", |r| r.truth.slope_rad.to_degrees()),
                        ("slope, estimated", |r| {
                            f64::from(r.status.estimate.slope_rad).to_degrees()
                        }),
                    ],
                ),
            ),
            (
                "camera",
                over_time(
                    "Camera spar",
                    "deg",
                    &[
                        ("spar, true", |r| r.truth.spar_rad.to_degrees()),
                        ("spar, estimated", |r| {
                            f64::from(r.status.estimate.spar_rad).to_degrees()
                        }),
                        ("ballast from the vertical", |r| {
                            (r.truth.spar_rad + r.truth.ballast_rad).to_degrees()
                        }),
                    ],
                ),
            ),
            (
                "yaw-rate",
                over_time(
                    "Yaw rate",
                    "rad/s",
                    &[
                        ("commanded", |r| r.commanded[1]),
                        ("true", |r| r.truth.yaw_rate_rad_s),
                        ("estimated", |r| f64::from(r.status.estimate.yaw_rate_rad_s)),
                    ],
                ),
            ),
            (
                "current",
                over_time(
                    "Motor currents",
                    "A",
                    &[
                        ("left", |r| r.truth.current_a[0]),
                        ("right", |r| r.truth.current_a[1]),
                        ("ballast", |r| r.truth.current_a[2]),
                    ],
                ),
            ),
            ("speed-terms", over_time("Terms of the speed law", "V", SPEED_TERMS)),
            (
                "path",
                Chart::new("Path on the plane", "x, m", "y, m")
                    .with(Series::new(
                        "true",
                        &self.values(|r| r.truth.x_m),
                        &self.values(|r| r.truth.y_m),
                    ))
                    .with(Series::new(
                        "dead reckoning",
                        &self.values(|r| f64::from(r.status.estimate.x_m)),
                        &self.values(|r| f64::from(r.status.estimate.y_m)),
                    )),
            ),
        ]
    }
}
