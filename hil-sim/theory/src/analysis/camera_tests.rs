//! The spar of chapter 7, against its figures and errata.

use super::*;
use crate::analysis::lqr::{Weights, regulator};
use crate::analysis::trajectory::Extent;

fn reference() -> Experiment {
    let camera = CameraParameters::thesis();
    let gains = regulator(&camera, &Weights::THESIS).unwrap().gains;
    Experiment::new(camera, Some(gains))
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() < tolerance
}

/// Fig. 7.2a and b.
#[test]
fn a_tilt_of_ten_degrees_decays_as_figure_7_2_shows() {
    let run = Experiment {
        tilt0: 10_f64.to_radians(),
        ..reference()
    }
    .run(20.0, 0.001);
    let deg: Vec<f64> = run.theta.iter().map(|x| x.to_degrees()).collect();
    let first_zero = run.t[deg.iter().position(|x| *x < 0.0).unwrap()];
    let overshoot = deg.iter().copied().fold(0.0, f64::min);
    let settled = run.t[deg.iter().rposition(|x| x.abs() > 1.0).unwrap() + 1];
    let ballast = run.phi.iter().fold(0.0_f64, |m, x| m.max(x.abs())).to_degrees();
    assert!(
        close(first_zero, 1.944, 1.1e-3) && close(settled, 3.58, 2e-3),
        "{first_zero} {settled}"
    );
    assert!(
        close(overshoot, -2.04, 5e-3) && close(ballast, 39.6, 0.05),
        "{overshoot} {ballast}"
    );
    // The first voltage is 24 times what gravity on the ballast can ever balance.
    let capacity = CameraParameters::<f64>::thesis().coefficients().k2;
    assert!(close(run.v[0], 16.07, 5e-3) && close(capacity, 0.667, 5e-4) && close(run.v[0] / capacity, 24.1, 0.05));
    assert!(run.recovered);
}

/// Erratum E30: the amplitude is half of the one that the text states for Fig. 7.3.
#[test]
fn the_shaken_spar_swings_by_0_88_degrees() {
    let shaken = Experiment {
        shake: [0.1, 0.1],
        ..reference()
    };
    let controlled = shaken.run(150.0, 0.5).theta_amplitude_deg.unwrap();
    let free = Experiment { gains: None, ..shaken }
        .run(150.0, 0.5)
        .theta_amplitude_deg
        .unwrap();
    assert!(
        close(controlled, 0.8799, 5e-5) && close(free, 5.93, 5e-3),
        "{controlled} {free}"
    );
    // The amplitude does not depend on the samples.
    assert!(close(
        controlled,
        shaken.run(150.0, 7.0).theta_amplitude_deg.unwrap(),
        1e-12
    ));
}

/// Linear theory of the same shake: |(i - A + b g)^-1| times the horizontal force.
#[test]
fn linear_theory_gives_0_8853() {
    let r = reference();
    let (a, b) = r.camera.linearisation();
    let k = r.camera.coefficients();
    let g = r.gains.unwrap();
    // x'' = 0.1 cos t enters like v, through the inverse mass matrix: with the column -(k1 + k2), -k2.
    let mass = [[k.m1 + k.m2 + 2.0 * k.m3, k.m2 + k.m3], [k.m2 + k.m3, k.m2]];
    let determinant = mass[0][0] * mass[1][1] - mass[0][1] * mass[1][0];
    let push = [-0.1 * (k.k1 + k.k2), -0.1 * k.k2];
    let force = [
        (mass[1][1] * push[0] - mass[0][1] * push[1]) / determinant,
        (mass[0][0] * push[1] - mass[1][0] * push[0]) / determinant,
    ];
    // (i - F) x = f as a real system of real and imaginary parts.
    let f: [[f64; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] - b[i] * g[j]));
    let system = nalgebra::SMatrix::<f64, 8, 8>::from_fn(|i, j| {
        let (row, column) = (i % 4, j % 4);
        let unit = f64::from(u8::from(row == column));
        match (i < 4, j < 4) {
            (true, true) | (false, false) => -f[row][column],
            (true, false) => -unit,
            (false, true) => unit,
        }
    });
    let mut right = nalgebra::SVector::<f64, 8>::zeros();
    (right[2], right[3]) = (force[0], force[1]);
    let x = system.lu().solve(&right).unwrap();
    let amplitude = x[0].hypot(x[4]).to_degrees();
    assert!(close(amplitude, 0.8853, 5e-5), "{amplitude}");
}

/// Erratum E27: with (7.13) as printed (k2 missing before the base term) the answer changes.
#[test]
fn the_printed_base_term_gives_0_864() {
    let r = reference();
    let model = Camera::new(r.camera);
    let k2 = r.camera.coefficients().k2;
    let rate = |t: f64, x: &CameraState<f64>| {
        let base = [0.1 * t.cos(), 0.1 * t.sin()];
        // The missing factor is a force (1 - k2) cos(theta + phi) x'' on the ballast alone: a voltage.
        let surplus = -(1.0 - k2) * (x[THETA] + x[PHI]).cos() * base[0];
        model.rate(x, r.voltage(x) + surplus, base)
    };
    let mut last = Extent::EMPTY;
    follow(rate, [0.0; 4], 150.0, &[], |step| {
        last.see(step, 100.0, THETA);
        ControlFlow::Continue(())
    })
    .unwrap();
    assert!(close(last.half_width().to_degrees(), 0.864, 5e-4), "{last:?}");
}

/// Erratum E31: the largest tilt from which the spar recovers, with an unlimited and with a limited motor.
#[test]
fn recovery_limits_with_and_without_a_limited_motor() {
    let limits = [
        (f64::INFINITY, 18.94, 5e-3),
        (20.0, 27.7, 0.05),
        (10.0, 39.1, 0.05),
        (5.0, 30.3, 0.05),
        (2.0, 24.6, 0.05),
    ];
    for (v_max, want, tolerance) in limits {
        let limit = Experiment { v_max, ..reference() }
            .recovery_limit_deg(60.0, 1.0)
            .unwrap();
        assert!(close(limit, want, tolerance), "{v_max} {limit}");
    }
}

#[test]
fn beyond_the_limit_the_ballast_spins_up_and_the_run_says_so() {
    let lost = Experiment {
        tilt0: 25_f64.to_radians(),
        ..reference()
    }
    .run(60.0, 0.1);
    assert!(!lost.recovered && lost.t.len() < 600 && lost.theta.iter().all(|x| x.is_finite()));
    assert!(lost.phi.iter().any(|x| x.abs() > TAU));
    // A limited motor brings the spar back from the same tilt.
    assert!(
        Experiment {
            tilt0: 25_f64.to_radians(),
            v_max: 10.0,
            ..reference()
        }
        .run(60.0, 0.1)
        .recovered
    );
}

/// Erratum E29: with the ballast locked the spar is a rigid body that swings at sqrt(m g l_cg / I).
#[test]
fn a_locked_spar_swings_at_0_7385() {
    let camera = CameraParameters::<f64>::thesis();
    let k = camera.coefficients();
    let (moment, inertia) = (k.k1 + k.k2, k.m1 + k.m2 + 2.0 * k.m3);
    assert!(close((moment / inertia).sqrt(), 0.7385, 5e-5));
    // (7.1) puts the distance of the centre of mass in the place of the length of a point-mass pendulum.
    let centre = moment / (1.0 + camera.mm + camera.mr);
    assert!(close((1.0 / centre).sqrt(), 3.098, 5e-4));
    // By simulation: a large back-EMF locks the ballast for good, a small swing takes half a period to turn.
    let locked = Experiment::new(
        CameraParameters {
            zeta: 0.0,
            xi: 1e4,
            ..camera
        },
        None,
    );
    let run = Experiment { tilt0: 1e-3, ..locked }.run(12.0, 0.001);
    let turn = run.theta_rate.iter().skip(1).position(|w| *w > 0.0).unwrap() as f64 * 0.001;
    assert!(close(std::f64::consts::PI / turn, 0.7385, 2e-3), "{turn}");
}
