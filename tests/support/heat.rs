//! The heat of a motor's winding or bridge, computed from the true currents of a run.

use virtual_board::scenario::trace::TraceRow;

/// Time and heat of each row, for drive motor `motor`: tau h' = (i / i_c)^2 - h, where 1 is the heat that the continuous current
/// maintains.
pub fn heats(rows: &[TraceRow], motor: usize, continuous_a: f64, time_constant_s: f64) -> Vec<(f64, f64)> {
    let (mut heat, mut before_s) = (0.0, 0.0);
    rows.iter()
        .map(|row| {
            let share = -f64::exp_m1(-(row.time_s() - before_s) / time_constant_s);
            before_s = row.time_s();
            heat += share * ((row.truth.current_a[motor] / continuous_a).powi(2) - heat);
            (before_s, heat)
        })
        .collect()
}
