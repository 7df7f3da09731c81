//! The filter at the encoders' inputs: long enough for the motors' noise, short enough for the fastest motor.

use model::vehicle::MotorParameters;

/// Kernel clock of the encoders' timers, Hz.
const CLOCK_HZ: u32 = 200_000_000;
/// Clock periods between two samples of an input.
const DIVIDER: u32 = 32;
/// Samples in a row that must agree before the timer takes a level: the part's longest filter.
const SAMPLES: u32 = 8;
/// Shortest pulse that passes the filter, ns. Shorter ones are noise: the ringing that an edge of the bridges' PWM
/// couples into an encoder's cable ends within some hundred nanoseconds.
pub const FILTER_NS: u32 = SAMPLES * DIVIDER * (1_000_000_000 / CLOCK_HZ);

/// Time between two edges of a motor's encoder at its no-load speed, ns. A level of one channel lasts for two of these.
///
/// The counts per turn are four edges of one period: the rate of the edges is `V / K / (2 pi) x counts`.
pub fn edge_interval_ns(motor: &MotorParameters<f32>, supply_max_v: f32) -> f32 {
    let turns_per_s = supply_max_v / motor.back_emf_constant_v_s_per_rad / (2.0 * core::f32::consts::PI);
    1e9 / (turns_per_s * motor.encoder_counts_per_rev)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::PARAMETERS;

    /// At twice the no-load speed, beyond which the supervisor calls a count a jump, a level still lasts for twice the
    /// filter's time: half of it is left for an encoder whose channels are unequal.
    #[test]
    fn the_fastest_encoder_passes_the_filter() {
        let ballast = PARAMETERS.spar.as_ref().map(|(_, motor)| motor);
        for motor in ballast.into_iter().chain([&PARAMETERS.drive_motor]) {
            let level_ns = 2.0 * edge_interval_ns(motor, PARAMETERS.battery.maximum_v) / 2.0;
            assert!(level_ns > 2.0 * FILTER_NS as f32, "{level_ns} ns");
        }
    }
}
