//! Chapter 6, for which the thesis has only a diagram: the motion by the thesis's equations and by the right equations.

use model::dynamics::spatial::{PHI, PHI_RATE, PSI, RATE_L, RATE_R, Spatial, SpatialParameters, SpatialState};

use super::figure::{Entry, Figure, FigureError, Verdict};
use crate::analysis::dop853::Dop853;
use crate::analysis::series::last;
use crate::analysis::spatial;
use report::plot::{Chart, Series};

/// The chapter's figures.
pub const FIGURES: &[Entry] = &[
    Entry::new("6.1a", level_turn),
    Entry::new("6.1b", side_slope),
    Entry::new("6.1c", spin),
];

const FIGURE_SPAN: f64 = 10.0;
const SPATIAL_SAMPLE: f64 = 0.05;
const REST: SpatialState<f64> = [0.0; 9];

/// The thesis's geometry with a half track of one wheel radius, on a plane.
fn vehicle(slope_y: f64) -> SpatialParameters<f64> {
    SpatialParameters {
        l: 0.8,
        alpha: 0.9,
        zeta: 2.2,
        mu: 0.066,
        nu: 0.0,
        s: 1.0,
        j0: 0.0,
        middle: 0.0,
        slope_x: 0.0,
        slope_y,
    }
}

/// Path and heading over time.
struct Track {
    t: Vec<f64>,
    x: Vec<f64>,
    y: Vec<f64>,
    psi: Vec<f64>,
}

impl Track {
    fn end(&self) -> String {
        format!("{:.3}, {:.3}, {:.3}", last(&self.x), last(&self.y), last(&self.psi))
    }
}

/// The track by d'Alembert's principle.
fn right(p: &SpatialParameters<f64>, u: [f64; 2]) -> Result<Track, FigureError> {
    let run = spatial::run(p, u, &REST, FIGURE_SPAN, SPATIAL_SAMPLE).map_err(FigureError::from_error)?;
    Ok(Track {
        t: run.t,
        x: run.x,
        y: run.y,
        psi: run.psi,
    })
}

/// The track by the variational principle (6.16), for comparison only, with the multipliers `lambda` at the
/// start.
///
/// Its x and y equations make the multipliers `lambda(0) + P(0) - P - n t` with P the momentum in the
/// plane, and they act on the wheels as a force `-Lambda psi'` ahead and a moment `Lambda v`, with
/// Lambda = lambda_1 sin psi - lambda_2 cos psi (erratum E21).
fn variational(p: &SpatialParameters<f64>, u: [f64; 2], lambda: [f64; 2]) -> Result<Track, FigureError> {
    let model = Spatial::new(*p);
    let al = p.alpha * p.l;
    let rate = |t: f64, x: &SpatialState<f64>| {
        let mut rate = model.rate(x, u);
        let [v, psi_rate] = model.forward_and_yaw_rate(x);
        let (sin_psi, cos_psi) = x[PSI].sin_cos();
        let (sin_phi, cos_phi) = x[PHI].sin_cos();
        let [n1, n2, _] = p.up();
        // From rest P(0) = 0; across the heading P is -aL sin(phi) psi' in this combination.
        let across = (lambda[0] - n1 * t) * sin_psi - (lambda[1] - n2 * t) * cos_psi + al * sin_phi * psi_rate;
        let (m11, m12, m22) = (1.0 + p.mu + p.nu, al * cos_phi + p.nu, al * p.l + p.nu);
        let push = -across * psi_rate / (m11 * m22 - m12 * m12);
        let inertia = (1.0 - p.alpha + p.mu + p.nu) * p.s * p.s + p.j0 + al * p.l * sin_phi * sin_phi;
        let turn = p.s * across * v / inertia;
        rate[RATE_R] += m22 * push + turn;
        rate[RATE_L] += m22 * push - turn;
        rate[PHI_RATE] -= m12 * push;
        rate
    };
    let mut track = Track {
        t: vec![0.0],
        x: vec![0.0],
        y: vec![0.0],
        psi: vec![0.0],
    };
    let mut run = Dop853::new(rate, 0.0, REST, 1e-11);
    for k in 1..=(FIGURE_SPAN / SPATIAL_SAMPLE).round() as u32 {
        let t = f64::from(k) * SPATIAL_SAMPLE;
        while run.time() < t {
            run.advance(t).map_err(FigureError::from_error)?;
        }
        let x = run.state();
        track.t.push(t);
        track.x.push(x[0]);
        track.y.push(x[1]);
        track.psi.push(x[2]);
    }
    Ok(track)
}

fn compared(title: &str, tracks: &[(&str, &Track)]) -> [Chart; 2] {
    let mut path = Chart::new(format!("{title}: path"), "x (R)", "y (R)");
    let mut heading = Chart::new(format!("{title}: heading"), "time (1/w)", "psi (rad)");
    for (name, track) in tracks {
        path = path.with(Series::new(*name, &track.x, &track.y));
        heading = heading.with(Series::new(*name, &track.t, &track.psi));
    }
    [path, heading]
}

fn level_turn() -> Result<Figure, FigureError> {
    let (p, u) = (vehicle(0.0), [0.6, 0.4]);
    let good = right(&p, u)?;
    let wrong = variational(&p, u, [0.0, 0.0])?;
    let other = variational(&p, u, [0.2, 0.1])?;
    let [path, heading] = compared(
        "Level turn, u = 0.6 right, 0.4 left",
        &[
            ("d'Alembert", &good),
            ("(6.16)", &wrong),
            ("(6.16), other multipliers at t = 0", &other),
        ],
    );
    Ok(Figure::new("6.1a", "A turn on the level", Verdict::Refuted)
        .claim("Rolling is to be treated with the full variational result (6.16); the system is too complicated to solve.")
        .number("x, y, psi at t = 10", "", good.end())
        .number("the same by (6.16)", "", wrong.end())
        .number("by (6.16), lambda(0) = (0.2, 0.1)", "", other.end())
        .finding("The right model is three short equations (E23). (6.16) gives another motion. That motion depends on the initial values of the multipliers, which nothing determines (E21).")
        .chart(path)
        .chart(heading))
}

fn side_slope() -> Result<Figure, FigureError> {
    let (p, u) = (vehicle(0.1), [0.6, 0.6]);
    let good = right(&p, u)?;
    let wrong = variational(&p, u, [0.0, 0.0])?;
    let [path, heading] = compared(
        "Side slope of 0.1 rad, equal torques",
        &[("d'Alembert", &good), ("(6.16)", &wrong)],
    );
    Ok(Figure::new("6.1b", "Across a side slope with equal torques", Verdict::Refuted)
        .claim("As for the turn: (6.16) is the equation of motion.")
        .number("x, y, psi at t = 10", "", good.end())
        .number("the same by (6.16)", "", wrong.end())
        .finding("The vehicle drives almost straight. By (6.16) it would steer itself uphill, and its energy would still balance exactly (E21).")
        .chart(path)
        .chart(heading))
}

fn spin() -> Result<Figure, FigureError> {
    let p = vehicle(0.0);
    let limit = p
        .spin_stability_limit()
        .ok_or_else(|| FigureError("no spin limit".into()))?;
    let swing = |factor: f64| -> Result<Series, FigureError> {
        let rate = factor * limit;
        let start = [0.0, 0.0, 0.0, 0.0, 0.0, 1e-3, rate, -rate, 0.0];
        let hold = 0.5 * p.zeta * rate;
        let run = spatial::run(&p, [hold, -hold], &start, 120.0, 0.1).map_err(FigureError::from_error)?;
        // The peaks of the swing grow or shrink with the pole.
        let peaks = run
            .phi
            .windows(3)
            .zip(&run.t)
            .filter(|(w, _)| w[1] > w[0] && w[1] > w[2] && w[1] > 0.0);
        let points = peaks.map(|(w, t)| (t + 0.1, w[1])).collect();
        Ok(Series::from_points(format!("{factor} of the limit"), points))
    };
    let chart = Chart::new(
        "Spinning on the spot, released 0.001 rad off",
        "time (1/w)",
        "peaks of phi (rad)",
    )
    .logarithmic()
    .with(swing(0.95)?)
    .with(swing(1.0)?)
    .with(swing(1.05)?);
    Ok(Figure::new("6.1c", "Spinning on the spot", Verdict::Added)
        .claim("None: the thesis does not look at turns.")
        .number("largest stable psi' (1/w)", "", format!("{limit:.6}"))
        .finding("Above this rate the hanging arm swings with growing amplitude, whatever the damping (E26).")
        .chart(chart))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_end(track: &Track, want: [f64; 3], tolerance: f64) {
        let end = [track.x[200], track.y[200], track.psi[200]];
        for (e, w) in end.iter().zip(want) {
            assert!((e - w).abs() < tolerance, "{end:?} {want:?}");
        }
    }

    /// The reduced form drawn here against the numbers of the multiplier form, which the model's tests
    /// derive in six coordinates.
    #[test]
    fn the_variational_tracks_are_those_of_the_multiplier_form() {
        let turn = |lambda| variational(&vehicle(0.0), [0.6, 0.4], lambda).unwrap();
        assert_end(&turn([0.0, 0.0]), [3.7358, 1.9124, 0.9022], 5e-5);
        assert_end(&turn([0.2, 0.1]), [3.8023, 1.7656, 0.8885], 5e-5);
        let side = variational(&vehicle(0.1), [0.6, 0.6], [0.0, 0.0]).unwrap();
        assert_end(&side, [4.284, -1.493, -0.903], 5e-4);
    }
}
