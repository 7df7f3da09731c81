//! The heat of a motor's winding, by the true currents of a run.

use virtual_board::scenario::trace::TraceRow;

/// Heat of drive motor `motor` over what its continuous current keeps up: tau h' = (i / i_c)^2 - h. The time and the heat of
/// each row.
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
