//! Why motors and supply bounded the drive: how much current flowed, and how high the supply rose.

use super::block::further;
use super::sight::Sight;

/// The observations of motors and supply.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PowerWitness {
    /// Highest current of each motor, A.
    current_a: [f64; 3],
    /// Highest supply, V.
    battery_v: f64,
    /// Steepest slope as the vehicle estimates it, uphill positive, rad.
    slope_rad: f64,
}

impl PowerWitness {
    pub(super) fn see(&mut self, sight: Sight<'_>) {
        let status = sight.status;
        for (highest_a, current_a) in self.current_a.iter_mut().zip(status.current_a) {
            *highest_a = highest_a.max(f64::from(current_a).abs());
        }
        self.battery_v = self.battery_v.max(f64::from(status.battery_v));
        self.slope_rad = further(self.slope_rad, f64::from(status.estimate.slope_rad));
    }

    /// The heat of motors and bridges in a sentence.
    pub(super) fn heat(&self) -> String {
        let [left, right, ballast] = self.current_a;
        format!(
            "MotorHeat: the heat of a motor or its bridge, or more current than its limit, bounds its current: left {left:.1} A, right {right:.1} A, \
             ballast {ballast:.1} A at most, on {:.1} deg at most",
            self.slope_rad.to_degrees()
        )
    }

    /// The supply that takes back no more power, in a sentence.
    pub(super) fn supply(&self) -> String {
        format!(
            "Regeneration: the supply, up to {:.1} V, takes back no more power, and the vehicle brakes less",
            self.battery_v
        )
    }
}
