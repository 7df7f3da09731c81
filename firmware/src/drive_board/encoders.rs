//! The filter at the encoders' inputs: long enough for the motors' noise, short enough for the fastest motor.

use super::nucleo_h743zi;

/// Consecutive samples that must agree before the timer accepts a level: the longest filter of every board's timers.
const SAMPLES: u32 = 8;

/// Shortest pulse that passes the filter of a board, ns, for the clock of its timers and the periods between two
/// samples. Shorter pulses are noise: the ringing that an edge of the bridges' PWM couples into an encoder's cable ends
/// within some hundred nanoseconds.
pub const fn filter_ns(clock_hz: u32, divider: u32) -> u32 {
    (SAMPLES * divider * 1000).div_ceil(clock_hz / 1_000_000)
}

/// Shortest pulse that passes the filter of the NUCLEO-H743ZI2, ns. The pages and the tests read it.
pub const FILTER_NS: u32 = filter_ns(nucleo_h743zi::ENCODER_CLOCK_HZ, nucleo_h743zi::ENCODER_DIVIDER);

#[cfg(test)]
mod tests {
    use model::vehicle::MotorParameters;

    use super::super::nucleo_f767zi;
    use super::*;
    use crate::built_in::PARAMETERS;

    /// Time between two edges of a motor's encoder at its no-load speed, ns. A level of one channel lasts for two of these.
    ///
    /// The counts per turn are four edges of one period: the rate of the edges is `V / K / (2 pi) x counts`.
    fn edge_interval_ns(motor: &MotorParameters<f32>, supply_max_v: f32) -> f32 {
        let turns_per_s = supply_max_v / motor.back_emf_constant_v_s_per_rad / (2.0 * core::f32::consts::PI);
        1e9 / (turns_per_s * motor.encoder_counts_per_rev)
    }

    /// At twice the no-load speed, beyond which the supervisor calls a count a jump, a level still lasts for twice the
    /// filter's time: half of it is left for an encoder whose channels are unequal.
    #[test]
    fn the_fastest_encoder_passes_the_filter() {
        let f767zi = filter_ns(nucleo_f767zi::ENCODER_CLOCK_HZ, nucleo_f767zi::ENCODER_DIVIDER);
        let ballast = PARAMETERS.ballast_motor();
        for motor in ballast.into_iter().chain([&PARAMETERS.drive_motor]) {
            let level_ns = 2.0 * edge_interval_ns(motor, PARAMETERS.battery.maximum_v) / 2.0;
            for filter_ns in [FILTER_NS, f767zi] {
                assert!(level_ns > 2.0 * filter_ns as f32, "{level_ns} ns, {filter_ns} ns");
            }
        }
    }
}
