//! The trace of a run: one row every 10 ms with the vehicle's status and the truth.

use firmware::protocol::message::LinkCounters;
use model::status::Status;

use plant::Truth;

use super::story::Sight;

/// One row.
#[derive(Debug, Clone, Copy)]
pub struct TraceRow {
    /// The operator's command: speed (m/s) and yaw rate (rad/s).
    pub commanded: [f64; 2],
    /// The vehicle's status.
    pub status: Status,
    /// Counters of the board's end of the link.
    pub link: LinkCounters,
    /// The truth at the time of the vehicle's sample.
    pub truth: Truth,
    /// Whether any bridge was on.
    pub bridges_on: bool,
}

impl TraceRow {
    /// Time of the row, s.
    pub fn time_s(&self) -> f64 {
        self.status.time_us as f64 * 1e-6
    }

    /// The row as a sight.
    pub fn sight(&self) -> Sight<'_> {
        Sight {
            status: &self.status,
            truth: Some(&self.truth),
        }
    }
}

/// Every row of a run.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    /// The rows in order of time.
    pub rows: Vec<TraceRow>,
}

/// A quantity of a row.
pub type Value = fn(&TraceRow) -> f64;

/// The columns of the CSV file: name with its unit, and quantity.
pub const COLUMNS: &[(&str, Value)] = &[
    ("time_s", TraceRow::time_s),
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
    ("applied_left_voltage_v", |r| f64::from(r.status.voltage_v[0])),
    ("applied_right_voltage_v", |r| f64::from(r.status.voltage_v[1])),
    ("applied_ballast_voltage_v", |r| f64::from(r.status.voltage_v[2])),
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
    ("term_speed_governed_v", |r| f64::from(r.status.terms.speed.governed_v)),
    ("aimed_landing_speed_m_s", |r| {
        f64::from(r.status.terms.speed.aim.landing_speed_m_s)
    }),
    ("aimed_acceleration_m_s2", |r| {
        f64::from(r.status.terms.speed.aim.acceleration_m_s2)
    }),
    ("aimed_phi_rad", |r| f64::from(r.status.terms.speed.aim.phi_rad)),
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
    ("term_spar_feed_forward_v", |r| {
        f64::from(r.status.terms.spar.feed_forward_v)
    }),
];

impl Trace {
    /// The values of one quantity.
    pub fn values(&self, value: impl Fn(&TraceRow) -> f64) -> Vec<f64> {
        self.rows.iter().map(value).collect()
    }

    /// FNV-1a hash of every value of every column, bit for bit: drives with equal hashes are
    /// equal.
    pub fn hash(&self) -> u64 {
        let values = self
            .rows
            .iter()
            .flat_map(|row| COLUMNS.iter().map(move |(_, value)| value(row)));
        fnv1a(values.flat_map(|value| value.to_bits().to_le_bytes()))
    }
}

/// The 64-bit FNV-1a hash of bytes.
pub fn fnv1a(bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(FNV_OFFSET, next_hash)
}

/// The 64-bit FNV-1a hash of a sequence of bytes.
#[derive(Debug, Clone, Copy)]
pub struct Fnv1a(pub u64);

impl Default for Fnv1a {
    fn default() -> Self {
        Self(FNV_OFFSET)
    }
}

impl Fnv1a {
    /// Adds the next bytes.
    pub fn take(&mut self, bytes: &[u8]) {
        self.0 = bytes.iter().copied().fold(self.0, next_hash);
    }
}

fn next_hash(hash: u64, byte: u8) -> u64 {
    (hash ^ u64::from(byte)).wrapping_mul(FNV_PRIME)
}

/// Constants of the 64-bit FNV-1a hash.
const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const FNV_PRIME: u64 = 0x0000_0100_0000_01b3;
