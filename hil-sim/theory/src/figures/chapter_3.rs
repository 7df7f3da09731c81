//! Chapter 3: step responses, whirl, and the speed law.

use model::control::speed_law::SpeedLaw;
use model::dynamics::planar::PlanarParameters;

use super::figure::{Entry, Figure, FigureError, Verdict};
use super::planar_vehicle::{limit, rest, run, vehicle};
use crate::analysis::equilibrium::poles;
use crate::analysis::input::Input;
use crate::analysis::series::last;
use crate::analysis::simulate::PlanarRun;
use crate::analysis::speed_response::speed_response;
use crate::analysis::whirl::whirl_cycle;
use report::plot::{Chart, Series};

/// The chapter's figures.
pub const FIGURES: &[Entry] = &[
    Entry::new("3.2", below_the_limit),
    Entry::new("3.3", above_the_limit),
    Entry::new("3.3a", whirl_over_slope),
    Entry::new("3.4", controlled),
    Entry::new("3.4a", sign_of_kp),
];

fn angles(title: &str, run: &PlanarRun) -> Chart {
    Chart::new(title, "time", "rad, rad per time unit")
        .with(Series::new("phi", &run.t, &run.phi))
        .with(Series::new("theta'", &run.t, &run.theta_rate))
}

fn below_the_limit() -> Result<Figure, FigureError> {
    let p = vehicle();
    let step = Input::voltage_step(&p, 0.0);
    let found = limit(&p, &step)?;
    let (near, four) = (
        run(&p, &step.towards(found - 1e-4), 40.0)?,
        run(&p, &step.towards(4.0), 40.0)?,
    );
    let printed = PlanarParameters { zeta: 0.2, ..p };
    let with_printed = limit(&printed, &Input::voltage_step(&printed, 0.0))?;
    Ok(Figure::new("3.2", "Open-loop step just below the whirl limit", Verdict::Corrected)
        .claim("On a slope of 0.0873 a step of U = 5.0344 still returns to steady rolling. An overshoot beyond 90 degrees ends in whirl.")
        .number("largest step that returns", "5.0344", format!("{found:.6}"))
        .number("the same with the printed zeta 0.2", "", format!("{with_printed:.5}"))
        .number("phi_max just below the limit", "", format!("{:.1} deg", near.phi_max.to_degrees()))
        .number("phi_max at U = 4", "", format!("{:.2} deg", four.phi_max.to_degrees()))
        .finding("The limit is 0.23 % lower, and only if the total damping is zeta + K = 2.2 (E1 to E3). The arm returns from swings far beyond 90 degrees: the stable manifold of the saddle at phi = pi - phi_0 is the boundary, not an angle (E8).")
        .chart(angles("U = limit - 0.0001", &near))
        .chart(angles("U = 4", &four)))
}

fn above_the_limit() -> Result<Figure, FigureError> {
    let p = vehicle();
    let step = Input::voltage_step(&p, 5.0345);
    let whirl = run(&p, &step, 60.0)?;
    let cycle = whirl_cycle(&p, 5.0345)
        .map_err(FigureError::from_error)?
        .ok_or_else(|| FigureError("the whirl is not sustained".into()))?;
    let climbs_above = p.beta.sin() + p.zeta * cycle.mean_phi_rate;
    let rates = Chart::new("Rates while whirling, U = 5.0345", "time", "rad per time unit")
        .with(Series::new("theta'", &whirl.t, &whirl.theta_rate))
        .with(Series::new("phi'", &whirl.t, &whirl.phi_rate));
    let forces = Chart::new("Normal force while whirling", "time", "N over (M+m) g").with(Series::new(
        "N",
        &whirl.t,
        &whirl.normal,
    ));
    Ok(Figure::new("3.3", "Open-loop step just above the whirl limit", Verdict::Corrected)
        .claim("At U = 5.0345 the arm whirls for ever: a stable limit cycle in which the vehicle drifts down the slope.")
        .number("mean theta'", "negative", format!("{:.4}", cycle.mean_theta_rate))
        .number("mean phi'", "", format!("{:.6}", cycle.mean_phi_rate))
        .number("voltage above which the whirling vehicle climbs", "", format!("{climbs_above:.3}"))
        .number("normal force over a turn", "taken as positive", format!("{:.1} to {:.1}", cycle.normal_min, cycle.normal_max))
        .finding("The cycle exists, and at this voltage the vehicle drifts down. The mean phi' does not depend on U, so above U = 6.483 the whirling vehicle climbs. During the cycle the vehicle would have to pull on the ground with three times its weight: a real vehicle would lift off (E9, E10).")
        .chart(rates)
        .chart(forces))
}

fn whirl_over_slope() -> Result<Figure, FigureError> {
    let slopes: Vec<f64> = (0..45).map(|k| 0.0046 + 0.0075 * f64::from(k)).collect();
    let turning = slopes
        .iter()
        .map(|beta| {
            let cycle = whirl_cycle(
                &PlanarParameters {
                    beta: *beta,
                    ..vehicle()
                },
                6.0,
            );
            Ok(cycle
                .map_err(FigureError::from_error)?
                .map_or(f64::NAN, |c| c.mean_phi_rate))
        })
        .collect::<Result<Vec<f64>, FigureError>>()?;
    let level = PlanarParameters { beta: 0.0, ..vehicle() };
    let over = limit(&level, &Input::voltage_step(&level, 0.0))? + 0.01;
    let settles = run(&level, &Input::voltage_step(&level, over), 40.0)?;
    let turns = Chart::new("Sustained whirl", "slope beta (rad)", "mean phi'").with(Series::new("", &slopes, &turning));
    let level = Chart::new("Level: the arm turns over once and settles", "time", "rad").with(Series::new(
        "phi",
        &settles.t,
        &settles.phi,
    ));
    Ok(Figure::new("3.3a", "Where whirl is sustained", Verdict::Added)
        .claim("Whirl is the other stable state of the vehicle.")
        .number("slopes with a sustained forward whirl", "", "above 0.004482")
        .number("level, just above the limit", "", format!("phi ends at {:.4} rad = one turn", last(&settles.phi)))
        .finding("The slope feeds the cycle: sin(beta) <phi'> = zeta var(theta' + phi'). Below the fold at 0.004482 the arm turns over and settles (E10).")
        .chart(turns)
        .chart(level))
}

fn controlled() -> Result<Figure, FigureError> {
    let p = vehicle();
    let law = SpeedLaw::thesis(p.zeta, p.alpha * p.l);
    let voltage = 5.02;
    let reference = (voltage - p.beta.sin()) / p.zeta;
    let open = run(&p, &Input::voltage_step(&p, voltage), 80.0)?;
    let closed = run(&p, &Input::reference_step(law, reference), 80.0)?;
    let long = run(&p, &Input::reference_step(law, 1.0), 200.0)?;
    let measures = speed_response(&long, 1.0).ok_or_else(|| FigureError("the speed is not reached".into()))?;
    let better = SpeedLaw {
        kp: 2.0,
        kd: 2.0,
        ..law
    };
    let tuned = run(&p, &Input::reference_step(better, reference), 80.0)?;
    let z = poles(&p, rest(&p)?, Some(&law));
    let phi = Chart::new("phi at the speed of U = 5.02", "time", "rad")
        .with(Series::new("open loop", &open.t, &open.phi))
        .with(Series::new("kp 0.8, kd 10", &closed.t, &closed.phi))
        .with(Series::new("kp 2, kd 2", &tuned.t, &tuned.phi));
    let rate = Chart::new("theta' at the speed of U = 5.02", "time", "rad per time unit")
        .with(Series::new("open loop", &open.t, &open.theta_rate))
        .with(Series::new("kp 0.8, kd 10", &closed.t, &closed.theta_rate))
        .with(Series::new("kp 2, kd 2", &tuned.t, &tuned.theta_rate));
    Ok(Figure::new("3.4", "Uncontrolled and controlled", Verdict::Corrected)
        .claim("The speed law moderates the arm's motion and smooths the vehicle's speed, without steady-state error.")
        .number("phi_max, open loop", "", format!("{:.1} deg", open.phi_max.to_degrees()))
        .number("phi_max, controlled", "", format!("{:.1} deg", closed.phi_max.to_degrees()))
        .number("poles", "", format!("{:.3}, {:.4} +- {:.4}i", z[0][0], z[2][0], z[2][1]))
        .number("speed overshoot, settling (2 %)", "", format!("{:.0} %, {:.0} time units", 100.0 * measures.overshoot, measures.settling_time))
        .number("largest reference step", "", format!("{:.5}", limit(&p, &Input::reference_step(law, 0.0))?))
        .number("the same with kp 2, kd 2", "", format!("{:.2}", limit(&p, &Input::reference_step(better, 0.0))?))
        .finding("The law moderates the swing, but does not smooth the speed: the speed's mode has a damping ratio of 0.122 and overshoots by three quarters. Zero steady-state error needs the total damping 2.2 in the feed-forward; with the printed 0.2 the vehicle runs backwards (E2, E4, E5, E11).")
        .chart(phi)
        .chart(rate))
}

fn sign_of_kp() -> Result<Figure, FigureError> {
    let p = vehicle();
    let mut chart = Chart::new("Reference step 1", "time", "theta' (rad per time unit)");
    let mut figure = Figure::new("3.4a", "What the speed feedback does", Verdict::Refuted)
        .claim("Negative rate feedback of the wheel (Kp = -0.8) recovers part of the response speed.");
    for kp in [0.8, 0.0, -0.8] {
        let law = SpeedLaw {
            kp,
            ..SpeedLaw::thesis(p.zeta, p.alpha * p.l)
        };
        let step = Input::reference_step(law, 1.0);
        let response = run(&p, &step, 25.0)?;
        let measures = speed_response(&response, 1.0).ok_or_else(|| FigureError("the speed is not reached".into()))?;
        figure = figure.number(
            format!("U = ... {kp:+} (theta' - ref): time to 90 %, phi_max, largest step"),
            "",
            format!(
                "{:.2}, {:.3} rad, {:.3}",
                measures.rise_time,
                response.phi_max,
                limit(&p, &step)?
            ),
        );
        chart = chart.with(Series::new(format!("{kp:+}"), &response.t, &response.theta_rate));
    }
    Ok(figure
        .finding("As (3.25) is written, the term feeds the speed error back positively. It slows the response; in return the swing is smaller and the largest step larger. The cost is robustness: the loop needs zeta > 0.8 (E6).")
        .chart(chart))
}
