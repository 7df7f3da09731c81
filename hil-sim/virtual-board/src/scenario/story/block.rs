//! Why the vehicle was blocked: the obstacle, and how hard the vehicle pushed.

use super::sight::Sight;

/// Inclination under the wheels, beyond the slope under the vehicle, from which the obstacle is an edge, rad.
const EDGE_RAD: f64 = 0.17;
/// Inclination below which the ground counts as level, rad.
const LEVEL_RAD: f64 = 0.02;

/// The observations of a blocked vehicle.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct BlockWitness {
    /// Largest commanded speed, with its direction, m/s.
    told_m_s: f64,
    /// Largest angle of the arm from the vertical, rad.
    lean_rad: f64,
    /// Highest current of a wheel's motor, A.
    current_a: f64,
    /// Slope as the vehicle estimates it, uphill positive, rad.
    estimated_rad: f64,
    /// Steepest rise of the ground under the wheels, in the commanded direction, rad; `None` where the ground is
    /// unknown.
    rise_rad: Option<f64>,
    chocked: bool,
    slides: bool,
}

/// The value with the larger magnitude.
pub(super) fn further(kept: f64, value: f64) -> f64 {
    if value.abs() > kept.abs() { value } else { kept }
}

impl BlockWitness {
    pub(super) fn see(&mut self, sight: Sight<'_>) {
        let status = sight.status;
        self.told_m_s = further(self.told_m_s, f64::from(status.speed_reference_m_s));
        self.lean_rad = further(self.lean_rad, f64::from(status.estimate.phi_rad));
        self.estimated_rad = f64::from(status.estimate.slope_rad);
        let [left_a, right_a, _] = status.current_a.map(|current| f64::from(current).abs());
        self.current_a = self.current_a.max(left_a).max(right_a);
        self.slides |= sight.slides();
        if let Some(truth) = sight.truth {
            let ahead_rad = truth.slope_rad * self.told_m_s.signum();
            self.rise_rad = Some(self.rise_rad.map_or(ahead_rad, |rise_rad| rise_rad.max(ahead_rad)));
            self.chocked |= truth.chocked;
        }
    }

    /// The stall in a sentence.
    pub(super) fn stall(&self) -> String {
        format!(
            "told to drive at {:.2} m/s, the vehicle is blocked: {}; its arm leans up to {:.0} deg, its wheels' motors draw up to {:.1} A",
            self.told_m_s,
            self.obstacle(),
            self.lean_rad.to_degrees(),
            self.current_a
        )
    }

    /// The excessive slope in a sentence.
    pub(super) fn slope(&self) -> String {
        format!(
            "SlopeLimit: the slope, {:.1} deg as the vehicle finds it, is beyond what the arm's weight or the grip can hold",
            self.estimated_rad.to_degrees()
        )
    }

    fn obstacle(&self) -> String {
        let found_deg = self.estimated_rad.to_degrees();
        let Some(rise_rad) = self.rise_rad else {
            return format!("it finds a slope of {found_deg:.1} deg and does not come up");
        };
        let rise_deg = rise_rad.to_degrees();
        if self.chocked {
            "chocks stand at its wheels".to_owned()
        } else if rise_rad > self.estimated_rad * self.told_m_s.signum() + EDGE_RAD {
            format!("an edge rises at {rise_deg:.0} deg under its wheels")
        } else if rise_rad > LEVEL_RAD {
            format!("the ground rises at {rise_deg:.1} deg")
        } else if self.slides {
            "its wheels slide".to_owned()
        } else {
            "no ground rises in its way: a wheel is seized, or something holds it".to_owned()
        }
    }
}
