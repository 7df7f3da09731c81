//! Chapter 5: performance envelopes.

use model::dynamics::planar::PlanarParameters;

use super::figure::{Entry, Figure, FigureError, Verdict};
use super::planar_vehicle::{limit, vehicle};
use crate::analysis::envelope::{EnvelopeBudget, envelope, slopes};
use crate::analysis::equilibrium::sustained_acceleration_limit;
use crate::analysis::input::Input;
use crate::analysis::jumps::{Jumps, critical_voltage};
use crate::analysis::waveform::Waveform;
use report::plot::{Chart, Series};

/// The chapter's figures.
pub const FIGURES: &[Entry] = &[
    Entry::new("5.1", waveforms),
    Entry::new("5.2", envelopes),
    Entry::new("5.2a", ramp_times),
    Entry::new("5.2b", jumps),
];

/// The thesis's T.
const RAMP_TIME: f64 = 5.0;

fn waveforms() -> Result<Figure, FigureError> {
    let s: Vec<f64> = (-20..=240).map(|k| 0.005 * f64::from(k)).collect();
    let chart = Waveform::ALL
        .into_iter()
        .fold(Chart::new("Waveforms", "t / T", "share of the move"), |chart, w| {
            let values: Vec<f64> = s.iter().map(|s| w.value(*s)).collect();
            chart.with(Series::new(w.name(), &s, &values))
        });
    // The step's normalised voltage on a nearly level slope: U / sin(beta) grows without bound.
    let nearly_level = PlanarParameters {
        beta: 0.001,
        ..vehicle()
    };
    let diverging = limit(&nearly_level, &Input::voltage_step(&nearly_level, 0.0))? / 0.001_f64.sin();
    Ok(Figure::new("5.1", "The waveforms", Verdict::Corrected)
        .claim("Every input moves from the hold voltage to its final voltage within T; voltages are normalised by the hold voltage, sin(beta).")
        .number("U / sin(beta) at beta = 0.001", "", format!("{diverging:.0}"))
        .finding("The normalised voltage diverges on the level. The final voltage acts only through the speed error at the start, so the natural measure is U - sin(beta) (E9, E17).")
        .chart(chart))
}

fn envelopes() -> Result<Figure, FigureError> {
    let beta = slopes(-0.7, 0.78, 75);
    let p = vehicle();
    let rows = envelope(EnvelopeBudget::default(), &p, &Waveform::ALL, RAMP_TIME, &beta, || ())
        .map_err(FigureError::from_error)?;
    let mut chart = Chart::new(
        "Critical voltage above the hold voltage, T = 5",
        "slope beta (rad)",
        "U - sin(beta)",
    );
    for (waveform, rows) in Waveform::ALL.into_iter().zip(rows.chunks(beta.len())) {
        let above: Vec<f64> = rows
            .iter()
            .map(|r| r.critical.unwrap_or(f64::NAN) - r.beta.sin())
            .collect();
        chart = chart.with(Series::new(waveform.name(), &beta, &above));
    }
    let at = |waveform: Waveform| limit(&p, &Input::voltage_step(&p, 0.0).shaped(waveform, RAMP_TIME));
    let backward = rows
        .iter()
        .filter(|r| r.waveform == Waveform::Step && r.whirl_direction == Some(-1));
    let steepest = backward.map(|r| r.beta).fold(f64::NEG_INFINITY, f64::max);
    Ok(Figure::new("5.2", "Envelopes of the waveforms", Verdict::Corrected)
        .claim("For T = 5 the ramp allows the largest voltage on every slope and the step the smallest; all curves end at the static limit.")
        .number("step at 0.0873", "", format!("{:.6}", at(Waveform::Step)?))
        .number("ramp at 0.0873", "", format!("{:.6}", at(Waveform::Ramp)?))
        .number("a forward step first fails backwards below", "", format!("beta = {steepest:.3}"))
        .finding("The order holds for these eleven waveforms and T = 5. It is no general law (5.2b). On downhill slopes the first failure of a forward step is a backward whirl on the return swing (E10, E19).")
        .chart(chart))
}

fn ramp_times() -> Result<Figure, FigureError> {
    let p = vehicle();
    let times: Vec<f64> = (0..50).map(|k| 0.1 * 1.13_f64.powi(k)).collect();
    let step = limit(&p, &Input::voltage_step(&p, 0.0))?;
    let mut chart = Chart::new("Critical voltage over that of the step, beta = 0.0873", "T", "ratio").logarithmic();
    for waveform in [
        Waveform::Ramp,
        Waveform::HalfCosine,
        Waveform::CubicSmoothstep,
        Waveform::ExpK5,
    ] {
        let of = |t: &f64| limit(&p, &Input::voltage_step(&p, 0.0).shaped(waveform, *t)).map(|u| u / step);
        let ratios = times.iter().map(of).collect::<Result<Vec<f64>, _>>()?;
        chart = chart.with(Series::new(waveform.name(), &times, &ratios));
    }
    let ratio = |t: f64| limit(&p, &Input::voltage_step(&p, 0.0).shaped(Waveform::Ramp, t)).map(|u| u / step);
    let sustained = sustained_acceleration_limit(&p).ok_or_else(|| FigureError("no static equilibrium".into()))?;
    let rate = |w: Waveform| -> Result<f64, FigureError> {
        let of = |t: f64| limit(&p, &Input::voltage_step(&p, 0.0).shaped(w, t));
        Ok((of(800.0)? - of(400.0)?) / 400.0)
    };
    let smooth = rate(Waveform::HalfCosine)? * std::f64::consts::FRAC_PI_2 / p.zeta;
    let abrupt = rate(Waveform::Ramp)? / p.zeta;
    Ok(Figure::new("5.2a", "The effect of T", Verdict::Refuted)
        .claim("As T is increased all these input curves tend to coalesce.")
        .number("ramp over step, T = 0.5 / 5 / 40", "towards 1", format!("{:.3} / {:.2} / {:.1}", ratio(0.5)?, ratio(5.0)?, ratio(40.0)?))
        .number("sustained acceleration limit A_max", "", format!("{sustained:.6} g"))
        .number("steepest rate over zeta for large T: half-cosine, ramp", "", format!("{smooth:.4}, {abrupt:.4} g"))
        .finding("The reverse is true: the curves coalesce as T goes to 0, where every waveform becomes the step, and diverge as T grows. The steepest rate, zeta A_max, limits a slow waveform that begins smoothly. The ramp begins at once with its full acceleration; the arm overshoots, and the ramp reaches nine tenths of that rate (E18).")
        .chart(chart))
}

fn jumps() -> Result<Figure, FigureError> {
    let p = vehicle();
    let of = |first: f64, last: f64, t: f64| {
        critical_voltage(&p, Jumps { first, last }, t, 20.0).ok_or_else(|| FigureError("no limit found".into()))
    };
    let times: Vec<f64> = (1..=24).map(|k| 0.25 * f64::from(k)).collect();
    let curve = |first: f64, last: f64| {
        times
            .iter()
            .map(|t| of(first, last, *t))
            .collect::<Result<Vec<f64>, _>>()
    };
    let chart = Chart::new("Critical voltage, beta = 0.0873", "T", "U")
        .with(Series::new("ramp", &times, &curve(0.0, 0.0)?))
        .with(Series::new("two half steps", &times, &curve(0.5, 0.5)?))
        .with(Series::new("jump 6 %, ramp, jump 36 %", &times, &curve(0.06, 0.36)?));
    Ok(Figure::new("5.2b", "The ramp is not the best input", Verdict::Refuted)
        .claim("The ramp allows the largest voltage because its steepest slope is the smallest.")
        .number("T = 1: ramp, two half steps", "ramp best", format!("{:.3}, {:.3}", of(0.0, 0.0, 1.0)?, of(0.5, 0.5, 1.0)?))
        .number("T = 5: ramp, jump 6 % - ramp - jump 36 %", "ramp best", format!("{:.3}, {:.3}", of(0.0, 0.0, 5.0)?, of(0.06, 0.36, 5.0)?))
        .finding("Inputs with jumps, whose steepest slope is infinite, beat the ramp. What matters is how the input excites a lightly damped mode of period 3.07 (E19).")
        .chart(chart))
}
