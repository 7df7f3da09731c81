//! Chapter 4: contact forces and slip.

use model::control::speed_law::SpeedLaw;
use model::dynamics::planar::PlanarParameters;

use super::figure::{Entry, Figure, FigureError, Verdict};
use super::planar_vehicle::{limit, run, vehicle};
use crate::analysis::input::Input;
use crate::analysis::series::first;
use crate::analysis::slip::{longest_pulse, slip_limit};
use crate::analysis::waveform::Waveform;
use report::plot::{Chart, Series};

/// The chapter's figures.
pub const FIGURES: &[Entry] = &[
    Entry::new("4.1", slip_metric),
    Entry::new("4.2", constituents),
    Entry::new("4.2a", slip_over_slope),
    Entry::new("4.2b", pulses),
];

/// Greased steel on steel, as in the thesis.
const GREASED: f64 = 0.005;

fn slip_metric() -> Result<Figure, FigureError> {
    let p = vehicle();
    let step = run(&p, &Input::voltage_step(&p, 5.02), 25.0)?;
    let percent: Vec<f64> = step
        .friction_coefficient()
        .iter()
        .map(|c| 100.0 * c / GREASED)
        .collect();
    let available = vec![100.0; step.t.len()];
    let needed = step.friction_coefficient_required.unwrap_or(f64::INFINITY);
    let standing = 100.0 * p.beta.tan() / GREASED;
    let chart = Chart::new(
        "Required friction over the available (mu_s = 0.005), U = 5.02",
        "time",
        "%",
    )
    .logarithmic()
    .with(Series::new("required", &step.t, &percent))
    .with(Series::new("available", &step.t, &available));
    Ok(Figure::new("4.1", "Required friction over the available friction", Verdict::Refuted)
        .claim("Even with greased steel on steel (0.005) slip does not enter any reasonable operation; the spikes near zero are numerical resolution.")
        .number("needed at t = 0", "highest of the run", format!("{:.0} % of 0.005, or a coefficient of {needed:.3}", 100.0 * needed / GREASED))
        .number("needed to stand on the slope", "below 100 %", format!("{standing:.0} %"))
        .finding("The vehicle slides on this slope even when it stands. No tyre has a coefficient of 3.845. The dips are zeros of the friction on a logarithmic axis. They are no effect of resolution, and do not lie where phi passes the normal (E14, E16).")
        .chart(chart))
}

fn constituents() -> Result<Figure, FigureError> {
    let p = vehicle();
    let step = run(&p, &Input::voltage_step(&p, 5.02), 25.0)?;
    let chart = Chart::new("Contact forces over (M+m) g, U = 5.02", "time", "force")
        .with(Series::new("friction F", &step.t, &step.friction))
        .with(Series::new("normal force N", &step.t, &step.normal));
    let beta = -0.3;
    let downhill = PlanarParameters { beta, ..p };
    let hop = run(&downhill, &Input::voltage_step(&downhill, 4.46), 25.0)?;
    let lifted = Chart::new("Downhill, beta = -0.3, U = 4.46: the wheel lifts", "time", "force")
        .with(Series::new("friction F", &hop.t, &hop.friction))
        .with(Series::new("normal force N", &hop.t, &hop.normal));
    Ok(Figure::new("4.2", "Friction and normal force", Verdict::Corrected)
        .claim("The forces needed to hold the no-slip constraint are low against the dynamic forces.")
        .number("F at t = 0", "", format!("{:.4}", first(&step.friction)))
        .number("N at t = 0", "", format!("{:.4}", first(&step.normal)))
        .number("N at t = 0, downhill -0.3, U = 4.46", "", format!("{:.3}", first(&hop.normal)))
        .finding("At the start of the step friction is almost four times the normal force, and the wheel first rolls backwards. On a downhill step the vehicle hops. The multipliers and the Newton-Euler equations give the same two forces, to 1e-12 (E12 to E14).")
        .chart(chart)
        .chart(lifted))
}

fn slip_over_slope() -> Result<Figure, FigureError> {
    let slopes: Vec<f64> = (0..25).map(|k| 0.03 * f64::from(k)).collect();
    let mut chart = Chart::new("Largest voltage step", "slope beta (rad)", "U");
    let mut needed = Vec::new();
    let mut whirl = Vec::new();
    for mu_s in [0.6, 0.8, 1.0] {
        let mut steps = Vec::new();
        for beta in &slopes {
            let found = slip_limit(
                &PlanarParameters {
                    beta: *beta,
                    ..vehicle()
                },
                mu_s,
            )
            .map_err(FigureError::from_error)?;
            steps.push(found.critical_voltage.unwrap_or(f64::NAN));
            if mu_s == 0.6 {
                whirl.push(found.whirl_voltage);
                needed.push(found.mu_s_where_whirl_comes_first.unwrap_or(f64::NAN));
            }
        }
        chart = chart.with(Series::new(format!("no slip, mu_s = {mu_s}"), &slopes, &steps));
    }
    let whirls_first = Chart::new(
        "Grip above which whirl comes before slip",
        "slope beta (rad)",
        "friction coefficient",
    )
    .with(Series::new("", &slopes, &needed));
    let p = vehicle();
    let at = |mu_s: f64| slip_limit(&p, mu_s).map_err(FigureError::from_error);
    let (six, eight, ten) = (at(0.6)?, at(0.8)?, at(1.0)?);
    let voltage = |v: Option<f64>| v.map_or_else(|| "none".to_owned(), |v| format!("{v:.3}"));
    let coefficient = |input: &Input| -> Result<String, FigureError> {
        Ok(run(&p, input, 60.0)?
            .friction_coefficient_required
            .map_or_else(|| "lifts".to_owned(), |c| format!("{c:.3}")))
    };
    let ramp = coefficient(&Input::voltage_step(&p, 8.0).shaped(Waveform::Ramp, 5.0))?;
    let loop_step = Input::reference_step(SpeedLaw::thesis(p.zeta, p.alpha * p.l), 1.0);
    Ok(Figure::new("4.2a", "Traction limits every step, long before whirl", Verdict::Refuted)
        .claim("Whirling, not slip, is the definitive boundary of the performance envelope.")
        .number("step without slip at 0.0873, mu_s 0.6 / 0.8 / 1.0", "",
            format!("{} / {} / {}", voltage(six.critical_voltage), voltage(eight.critical_voltage), voltage(ten.critical_voltage)))
        .number("whirl limit", "5.0344", format!("{:.4}", six.whirl_voltage))
        .number("friction that a ramp to U = 8 over 5 needs", "", ramp)
        .number("speed loop, reference 1: step, ramp over 5", "",
            format!("{}, {}", coefficient(&loop_step)?, coefficient(&loop_step.shaped(Waveform::Ramp, 5.0))?))
        .finding("Whirl comes first only with a friction coefficient above 5.99 (level), 3.85 (0.0873) or 2.08 (0.3), which no tyre has. Ramped inputs need an order of magnitude less friction (E14).")
        .chart(chart.with(Series::new("whirl", &slopes, &whirl)))
        .chart(whirls_first))
}

fn pulses() -> Result<Figure, FigureError> {
    let p = vehicle();
    let amplitudes: Vec<f64> = (0..30).map(|k| 5.0 + 0.5 * f64::from(k)).collect();
    let longest = amplitudes
        .iter()
        .map(|u| {
            Ok(longest_pulse(&p, *u)
                .map_err(FigureError::from_error)?
                .unwrap_or(f64::NAN))
        })
        .collect::<Result<Vec<f64>, FigureError>>()?;
    let whirl = limit(&p, &Input::voltage_step(&p, 0.0))?;
    let six = slip_limit(&p, 0.6)
        .map_err(FigureError::from_error)?
        .critical_voltage
        .unwrap_or(f64::NAN);
    let chart = Chart::new(
        "Longest pulse from which the arm returns",
        "pulse voltage U",
        "duration",
    )
    .with(Series::new("", &amplitudes, &longest));
    Ok(Figure::new("4.2b", "Short pulses", Verdict::Refuted)
        .claim("A high, short pulse slips at first, but as the voltage is dropped and the pulse prolonged whirl stands out as the limit.")
        .number("any pulse slips above (mu_s = 0.6)", "", format!("U = {six:.3}"))
        .number("whirl limit of a step", "", format!("{whirl:.4}"))
        .finding("The friction needed at the start of a pulse does not depend on its duration, so every pulse above U = 0.576 makes the wheels slip, however short it is. At no amplitude does whirl come first (E15).")
        .chart(chart))
}
