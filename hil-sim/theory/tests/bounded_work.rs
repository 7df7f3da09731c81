//! Whatever parameters the user types, every search and every run ends: it has a budget of integration steps, and reports when it
//! has spent them. The budgets here are small, so that the extremes of every parameter take little time.

use model::control::speed_law::SpeedLaw;
use model::dynamics::planar::PlanarParameters;
use theory::analysis::critical::{Direction, NoCriticalValue, critical_within};
use theory::analysis::envelope::{EnvelopeBudget, NoEnvelope, envelope, slopes};
use theory::analysis::equilibrium::static_phi;
use theory::analysis::input::Input;
use theory::analysis::simulate::simulate_within;
use theory::analysis::slip::{slip_limit, slip_limit_within};
use theory::analysis::step_budget::StepBudget;
use theory::analysis::waveform::Waveform;

/// A budget for one search, a quarter of what the thesis's vehicle needs on average.
const STEPS: u64 = 1_000;

/// The thesis's vehicle with one parameter at one extreme of what the flags allow.
fn extremes() -> Vec<(String, PlanarParameters<f64>)> {
    let thesis = PlanarParameters::thesis();
    let mut all = Vec::new();
    for value in [1e-300_f64, 1e-6, 1e3, 1e6] {
        for (name, p) in [
            ("l", PlanarParameters { l: value, ..thesis }),
            ("zeta", PlanarParameters { zeta: value, ..thesis }),
            ("mu", PlanarParameters { mu: value, ..thesis }),
            ("nu", PlanarParameters { nu: value, ..thesis }),
            (
                "alpha",
                PlanarParameters {
                    alpha: value.min(1.0 - f64::EPSILON),
                    ..thesis
                },
            ),
        ] {
            // On the level every arm has an equilibrium.
            all.push((format!("{name} {value:e}"), PlanarParameters { beta: 0.0, ..p }));
        }
    }
    all
}

#[test]
fn a_search_for_a_limit_makes_no_more_steps_than_its_budget() {
    let mut ended = [0_u32; 2];
    for (name, p) in extremes() {
        let Some(phi) = static_phi(&p) else {
            continue;
        };
        let law = SpeedLaw {
            feed_forward_zeta: p.zeta,
            alpha_l: p.alpha * p.l,
            kp: 0.8,
            kd: 10.0,
        };
        for (what, input, start) in [
            ("step", Input::voltage_step(&p, 0.0), [phi, 0.0, 0.0]),
            ("fast start", Input::voltage_step(&p, 0.0), [6.2, 1e3, 0.0]),
            (
                "slow ramp",
                Input::voltage_step(&p, 0.0).shaped(Waveform::Ramp, 1e4),
                [phi, 0.0, 0.0],
            ),
            ("reference", Input::reference_step(law, 0.0), [phi, 0.0, 0.0]),
            (
                "little voltage",
                Input {
                    u_max: 1e-300,
                    ..Input::reference_step(law, 0.0)
                },
                [phi, 0.0, 0.0],
            ),
        ] {
            for direction in [Direction::Forward, Direction::Reverse] {
                let budget = StepBudget::of(STEPS);
                let found = critical_within(&budget, &p, &input, start, direction);
                assert!(budget.spent() <= STEPS, "{name}, {what}: {}", budget.spent());
                if let Err(NoCriticalValue::TooLong { steps, .. }) = found {
                    assert_eq!((steps, budget.spent()), (STEPS, STEPS), "{name}, {what}");
                    ended[0] += 1;
                } else {
                    ended[1] += 1;
                }
            }
        }
    }
    assert!(
        ended.iter().all(|times| *times > 20),
        "one of the two ends hardly occurs: {ended:?}"
    );
}

#[test]
fn a_run_makes_no_more_steps_than_its_budget() {
    let mut spent = 0;
    for (name, p) in extremes() {
        let phi = static_phi(&p).unwrap_or(0.0);
        for (u, start) in [(1.0, [0.0, phi, 0.0, 0.0]), (1e5, [0.0, 1e3, 1e3, 0.0])] {
            let budget = StepBudget::of(STEPS);
            let run = simulate_within(&budget, &p, &Input::voltage_step(&p, u), start, 1e5, 1e4);
            if budget.spent() == STEPS {
                spent += 1;
                assert!(run.is_err(), "{name}, {u}: a run that is not complete passes for one");
            }
        }
    }
    assert!(spent > 20, "{spent}");
}

/// Each point of an envelope has a budget, and all points share one. The shared budget depends on the sum of the points' steps, not
/// on the order in which the cores compute them.
#[test]
fn an_envelope_ends_with_its_points_or_with_their_sum() {
    let p = PlanarParameters::thesis();
    let of = |point, all| {
        let waveforms = [Waveform::Step, Waveform::Ramp];
        envelope(
            EnvelopeBudget { point, all },
            &p,
            &waveforms,
            5.0,
            &slopes(-0.3, 0.7, 5),
            || (),
        )
    };
    let whole = of(1_000_000, 1_000_000).expect("ten points");
    assert_eq!(whole.len(), 10);
    let found = of(STEPS, 1_000_000);
    assert!(
        matches!(
            found,
            Err(NoEnvelope::NoCriticalValue(NoCriticalValue::TooLong {
                steps: STEPS,
                ..
            }))
        ),
        "{found:?}"
    );
    // Bisects for the smallest shared budget that suffices: below it there is no envelope, and from it on always the same.
    let (mut little, mut enough) = (10_000, 100_000);
    while enough - little > 1_000 {
        let middle = u64::midpoint(little, enough);
        match of(1_000_000, middle) {
            Ok(points) => {
                assert_eq!(points, whole);
                enough = middle;
            }
            Err(error) => {
                assert_eq!(
                    error,
                    NoEnvelope::TooLong {
                        steps: middle,
                        points: 10
                    }
                );
                little = middle;
            }
        }
    }
    assert!((20_000..90_000).contains(&enough), "{enough}");
}

/// If the responses have spent their steps, there is no slip limit: the rest of the search would give a wrong one.
#[test]
fn a_slip_limit_is_whole_or_none() {
    let thesis = PlanarParameters::thesis();
    let mu_s = 0.5;
    let whole = slip_limit(&thesis, mu_s).expect("a limit");
    // The steps are spent on the way to the whirl limit, at the peak, and at the crossing.
    for allowed in [10_000, 45_000, 60_000] {
        let found = slip_limit_within(allowed, &thesis, mu_s);
        assert!(found.is_err(), "{allowed}: {found:?}");
    }
    assert_eq!(slip_limit_within(100_000, &thesis, mu_s), Ok(whole));
}
