//! Chapter 7: the camera spar alone.

use model::dynamics::camera::CameraParameters;
use rayon::prelude::*;

use super::figure::{Entry, Figure, FigureError, Verdict};
use crate::analysis::camera::{CameraRun, Experiment};
use crate::analysis::lqr::{Weights, regulator};
use crate::analysis::series::{degrees, first, largest};
use report::plot::{Chart, Series};

/// The chapter's figures.
pub const FIGURES: &[Entry] = &[
    Entry::new("7.2a", tilt),
    Entry::new("7.2b", tilt_effort),
    Entry::new("7.3a", forced),
    Entry::new("7.3b", forced_effort),
    Entry::new("7.4a", recovery),
];

/// The thesis's spar under its optimal regulator.
fn reference() -> Result<Experiment, FigureError> {
    let camera = CameraParameters::thesis();
    let gains = regulator(&camera, &Weights::THESIS)
        .map_err(FigureError::from_error)?
        .gains;
    Ok(Experiment::new(camera, Some(gains)))
}

fn tilted() -> Result<CameraRun, FigureError> {
    Ok(Experiment {
        tilt0: 10_f64.to_radians(),
        ..reference()?
    }
    .run(15.0, 0.005))
}

fn shaken(controlled: bool) -> Result<CameraRun, FigureError> {
    let experiment = Experiment {
        shake: [0.1, 0.1],
        ..reference()?
    };
    let gains = experiment.gains.filter(|_| controlled);
    Ok(Experiment { gains, ..experiment }.run(120.0, 0.02))
}

/// The largest |x|, as text.
fn peak(x: &[f64], digits: usize) -> String {
    format!("{:.digits$}", largest(x))
}

fn tilt() -> Result<Figure, FigureError> {
    let run = tilted()?;
    let theta = degrees(&run.theta);
    let first_zero = run
        .t
        .iter()
        .zip(&theta)
        .find(|(_, x)| **x < 0.0)
        .map_or(f64::NAN, |(t, _)| *t);
    let overshoot = theta.iter().copied().fold(0.0, f64::min);
    let settled = run
        .t
        .iter()
        .zip(&theta)
        .rfind(|(_, x)| x.abs() > 1.0)
        .map_or(f64::NAN, |(t, _)| *t);
    let gains = reference()?
        .gains
        .unwrap_or_default()
        .map(|g| format!("{g:.5}"))
        .join(", ");
    Ok(Figure::new("7.2a", "Camera spar after a tilt of 10 deg", Verdict::Confirmed)
        .claim("The displacement decays fast under the optimal gains.")
        .number("gains of v = -g.x", "92.06, 6.84, -49.14, -6.96", gains)
        .number("first zero (1/w_c)", "", format!("{first_zero:.2}"))
        .number("overshoot (deg)", "", format!("{overshoot:.2}"))
        .number("within 1 deg after (1/w_c)", "", format!("{settled:.2}"))
        .finding("The displacement decays fast with the right gains. The printed gains lack a sign and misprint one number; they are unstable with either sign of v (E28).")
        .chart(Chart::new("Spar after a tilt of 10 deg", "time (1/w_c)", "theta (deg)").with(Series::new("", &run.t, &theta))))
}

fn tilt_effort() -> Result<Figure, FigureError> {
    let run = tilted()?;
    let capacity = CameraParameters::<f64>::thesis().coefficients().k2;
    let first = first(&run.v);
    Ok(
        Figure::new("7.2b", "Ballast after a tilt of 10 deg", Verdict::Confirmed)
            .claim("The control effort, shown as the ballast's angle.")
            .number("largest ballast angle (deg)", "", peak(&degrees(&run.phi), 1))
            .number("first voltage v(0)", "", format!("{first:.2}"))
            .number(
                "v(0) over the ballast's gravity torque",
                "",
                format!("{:.0}", first / capacity),
            )
            .finding("The angle is moderate. The voltage, which the thesis's figure does not show, is not (E30).")
            .chart(Chart::new("Ballast", "time (1/w_c)", "phi (deg)").with(Series::new("", &run.t, &degrees(&run.phi))))
            .chart(Chart::new("Motor voltage", "time (1/w_c)", "v").with(Series::new("", &run.t, &run.v))),
    )
}

fn forced() -> Result<Figure, FigureError> {
    let (with, without) = (shaken(true)?, shaken(false)?);
    let amplitude = |run: &CameraRun| format!("{:.4}", run.theta_amplitude_deg.unwrap_or(f64::NAN));
    Ok(Figure::new("7.3a", "Camera spar on a shaken axle", Verdict::Corrected)
        .claim("Under x'' = 0.1 cos t, y'' = 0.1 sin t it stabilises in a 2 deg oscillation.")
        .number("amplitude (deg)", "2", amplitude(&with))
        .number("uncontrolled (deg)", "", amplitude(&without))
        .finding("The amplitude is 0.88 deg, or 1.76 deg peak to peak; the thesis may mean the latter (E30). With (7.13) as printed the amplitude would be 0.864 deg (E27).")
        .chart(
            Chart::new("Spar under x'' = 0.1 cos t, y'' = 0.1 sin t", "time (1/w_c)", "theta (deg)")
                .with(Series::new("controlled", &with.t, &degrees(&with.theta)))
                .with(Series::new("uncontrolled", &without.t, &degrees(&without.theta))),
        ))
}

fn forced_effort() -> Result<Figure, FigureError> {
    let run = shaken(true)?;
    let late = run.t.len() * 2 / 3;
    Ok(Figure::new("7.3b", "Ballast on a shaken axle", Verdict::Confirmed)
        .claim("The control effort of the forced response.")
        .number(
            "ballast amplitude, settled (deg)",
            "",
            peak(&degrees(&run.phi[late..]), 2),
        )
        .number("voltage amplitude, settled", "", peak(&run.v[late..], 3))
        .finding("The motor keeps the spar level with a small swing of the ballast.")
        .chart(
            Chart::new("Ballast on a shaken axle", "time (1/w_c)", "phi (deg)").with(Series::new(
                "",
                &run.t,
                &degrees(&run.phi),
            )),
        ))
}

fn recovery() -> Result<Figure, FigureError> {
    let r = reference()?;
    let limit = |v_max: f64| Experiment { v_max, ..r }.recovery_limit_deg(60.0, 0.5).unwrap_or(180.0);
    let voltages: Vec<f64> = (1..=40).map(f64::from).collect();
    let limits: Vec<f64> = voltages.par_iter().map(|v| limit(*v)).collect();
    let unlimited = limit(f64::INFINITY);
    let at = |v: usize| format!("{:.2}", limits.get(v - 1).copied().unwrap_or(f64::NAN));
    Ok(Figure::new("7.4a", "Largest tilt from which the spar recovers", Verdict::Added)
        .claim("\"Robustness is demonstrated\" with 10 deg; the motor is not limited.")
        .number("limit without a voltage limit (deg)", "", format!("{unlimited:.2}"))
        .number("limit at |v| <= 20 (deg)", "", at(20))
        .number("limit at |v| <= 10 (deg)", "", at(10))
        .number("limit at |v| <= 5 (deg)", "", at(5))
        .number("limit at |v| <= 2 (deg)", "", at(2))
        .finding("Beyond 18.94 deg the unlimited loop spins its ballast up and drops the spar; a limited motor recovers from more (E31).")
        .chart(
            Chart::new("Recovery limit over the motor's voltage limit", "|v| limit", "tilt (deg)")
                .with(Series::new("limited motor", &voltages, &limits))
                .with(Series::new("unlimited", &[1.0, 40.0], &[unlimited; 2])),
        ))
}
