//! The optimal regulator of the spar, against other methods and properties of the optimum.

use super::*;

/// The optimal gains of the thesis's spar for Q = diag(10000, 100, 0, 0), r = 1.
///
/// (7.21), corrected: `g = (1/r) b^T P` with `v = -g . x`. The printed vector [92.06, 6.84, -49.14, -6.96]
/// has lost the sign of its first element and misprints 6.496 as 6.96; it is unstable with either sign
/// of v (erratum E28).
const THESIS_SPAR_GAINS: [f32; 4] = [-92.06057, 6.84090, -49.14485, -6.49598];

/// The poles of the spar under `v = -g . x`; `None` if a number is not finite.
fn closed_loop_poles(camera: &CameraParameters<f64>, gains: &[f64; 4]) -> Option<[[f64; 2]; 4]> {
    let problem = Problem::new(camera, &Weights::THESIS);
    eigenvalues(&problem.closed_loop(&Vector4::from(*gains)))
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() < tolerance
}

#[test]
fn the_gains_of_7_21_corrected_solve_the_riccati_equation() {
    let fresh = regulator(&CameraParameters::thesis(), &Weights::THESIS).unwrap();
    for (constant, gain) in THESIS_SPAR_GAINS.iter().zip(fresh.gains) {
        assert!(close(f64::from(*constant), gain, 1e-5), "{fresh:?}");
    }
    assert!(fresh.riccati_residual < 1e-13, "{fresh:?}");
    assert!(fresh.poles.iter().all(|p| p[0] < -0.37), "{fresh:?}");
}

#[test]
fn the_reference_vehicle_has_the_optimal_gains_of_its_spar() {
    let vehicle = vehicle_file::reference().unwrap();
    let fresh = regulator(&vehicle.camera().unwrap(), &Weights::THESIS).unwrap();
    for (stored, gain) in vehicle.spar_gains().unwrap().iter().zip(fresh.gains) {
        // The file's lengths and the motor's constants are rounded.
        assert!((stored / gain - 1.0).abs() < 2e-3, "{stored} {gain}");
    }
}

/// The model's stability test of a vehicle's gains agrees with the eigenvalues, for random spars and gains.
#[test]
fn gains_that_hold_the_spar_are_told_from_those_that_do_not() {
    let mut noise = plant::noise::Noise::new(5, 0);
    let mut between = |least: f64, most: f64| least + (most - least) * (noise.bits() as f64 / u64::MAX as f64);
    let (mut stable, mut unstable) = (0, 0);
    while stable < 300 || unstable < 300 {
        let camera = CameraParameters {
            lm: between(0.0, 1.0),
            lr: between(0.05, 1.0),
            mm: between(0.0, 5.0),
            mr: between(0.1, 8.0),
            zeta: between(0.0, 1.0),
            xi: between(0.0, 4.0),
        };
        let Ok(optimal) = regulator(&camera, &Weights::THESIS) else {
            continue;
        };
        // From the optimum out to gains far away from it.
        let spread = between(0.0, 2.0);
        let gains = optimal.gains.map(|gain| gain * (1.0 + between(-spread, spread)));
        let poles = closed_loop_poles(&camera, &gains).unwrap();
        let slowest = poles.iter().fold(f64::NEG_INFINITY, |slowest, p| slowest.max(p[0]));
        // At the edge of stability, within rounding, the two may differ.
        if slowest.abs() < 1e-6 {
            continue;
        }
        assert_eq!(
            camera.is_stable_under(&gains),
            slowest < 0.0,
            "{camera:?} {gains:?} {poles:?}"
        );
        if slowest < -1e-3 {
            assert!(camera.cast::<f32>().is_stable_under(&gains.map(|gain| gain as f32)));
        }
        if slowest < 0.0 {
            stable += 1;
        } else {
            unstable += 1;
        }
    }
}

#[test]
fn the_printed_gains_are_unstable_with_either_sign() {
    // Erratum E28: [92.06, 6.84, -49.14, -6.96] as printed after (7.21).
    let printed = [92.06, 6.84, -49.14, -6.96];
    let camera = CameraParameters::thesis();
    let unstable = |gains| {
        let poles = closed_loop_poles(&camera, &gains).unwrap();
        poles.into_iter().filter(|p| p[0] > 0.0).collect::<Vec<_>>()
    };
    // v = -g . x: a real pole and a growing oscillation.
    let minus = unstable(printed);
    assert!(
        minus.iter().any(|p| close(p[0], 2.198, 5e-4) && p[1] == 0.0),
        "{minus:?}"
    );
    // v = +g . x: a growing oscillation.
    let plus = unstable(printed.map(|g| -g));
    assert!(
        plus.len() == 2 && close(plus[0][0], 0.984, 5e-4) && close(plus[1][1], 1.448, 5e-4),
        "{plus:?}"
    );
    // The right gains with the minus of (7.21) and the minus of (7.19) together: positive feedback.
    let right = regulator(&camera, &Weights::THESIS).unwrap().gains;
    let twice = unstable(right.map(|g| -g));
    assert!(twice.iter().any(|p| close(p[0], 9.776, 5e-4)), "{twice:?}");
}

/// The gains by another method: the Riccati differential equation integrated backwards from P = 0, in plain
/// arrays.
fn by_integration(camera: &CameraParameters<f64>, weights: &Weights, span: f64, steps: usize) -> [f64; 4] {
    type Square = [[f64; 4]; 4];
    let (a, b) = camera.linearisation();
    let gains = |p: &Square| p.map(|row| row.iter().zip(b).map(|(p, b)| p * b).sum::<f64>() / weights.r);
    let rate = |p: &Square| -> Square {
        let g = gains(p);
        let pa: Square = std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| p[i][k] * a[k][j]).sum()));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let q = if i == j { weights.q[i] } else { 0.0 };
                pa[i][j] + pa[j][i] - g[i] * g[j] * weights.r + q
            })
        })
    };
    let ahead = |p: &Square, factor: f64, k: &Square| -> Square {
        std::array::from_fn(|i| std::array::from_fn(|j| p[i][j] + factor * k[i][j]))
    };
    let h = span / steps as f64;
    let mut p = [[0.0; 4]; 4];
    for _ in 0..steps {
        let k1 = rate(&p);
        let k2 = rate(&ahead(&p, 0.5 * h, &k1));
        let k3 = rate(&ahead(&p, 0.5 * h, &k2));
        let k4 = rate(&ahead(&p, h, &k3));
        for (weight, k) in [(1.0, k1), (2.0, k2), (2.0, k3), (1.0, k4)] {
            p = ahead(&p, weight * h / 6.0, &k);
        }
    }
    gains(&p)
}

#[test]
fn the_riccati_differential_equation_settles_at_the_same_gains() {
    let camera = CameraParameters {
        lm: 0.25,
        lr: 0.2,
        mm: 2.0,
        mr: 5.0,
        zeta: 0.3,
        xi: 1.5,
    };
    let weights = Weights {
        q: [400.0, 30.0, 5.0, 0.0],
        r: 2.0,
    };
    let want = by_integration(&camera, &weights, 40.0, 40_000);
    let got = regulator(&camera, &weights).unwrap();
    for (g, w) in got.gains.iter().zip(want) {
        assert!(close(*g, w, 1e-9 * (1.0 + w.abs())), "{got:?} {want:?}");
    }
}

/// Lowest power first: the polynomials `det(s 1 - A)` and `adj(s 1 - A) b`, by Faddeev and `LeVerrier`, in
/// plain arrays.
fn transfer(a: &[[f64; 4]; 4], b: &[f64; 4]) -> ([f64; 5], [[f64; 4]; 4]) {
    let mut m: [[f64; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    let mut determinant = [0.0, 0.0, 0.0, 0.0, 1.0];
    let mut numerators = [[0.0; 4]; 4];
    for k in (0..4).rev() {
        for (numerator, row) in numerators.iter_mut().zip(&m) {
            numerator[k] = row.iter().zip(b).map(|(m, b)| m * b).sum();
        }
        let am: [[f64; 4]; 4] =
            std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|n| a[i][n] * m[n][j]).sum()));
        determinant[k] = -(0..4).map(|i| am[i][i]).sum::<f64>() / (4 - k) as f64;
        m = am;
        for (i, row) in m.iter_mut().enumerate() {
            row[i] += determinant[k];
        }
    }
    (determinant, numerators)
}

/// `p(z)` of a real polynomial, lowest power first, as [re, im].
fn value(p: &[f64], z: [f64; 2]) -> [f64; 2] {
    p.iter().rev().fold([0.0; 2], |v, c| {
        [v[0] * z[0] - v[1] * z[1] + c, v[0] * z[1] + v[1] * z[0]]
    })
}

/// Kalman's equality, which holds for stable gains at every frequency w only if they are optimal:
/// `|1 + g^T (j w 1 - A)^-1 b|^2 = 1 + sum q_i |x_i|^2 / r` with `x = (j w 1 - A)^-1 b`.
#[test]
fn gains_satisfy_kalmans_equality_and_poles_are_roots_of_the_closed_loop() {
    // Geometries that hang and that stand, and weights over eight decades.
    let mut count = 0;
    for (lm, mr) in [(0.05, 1.0), (1.0 / 6.0, 4.0), (0.4, 6.0), (0.1, 2.5)] {
        for q1 in [0.0, 1.0, 1e4, 1e6] {
            for r in [1e-2, 1.0, 100.0] {
                let camera = CameraParameters {
                    lm,
                    lr: 0.2,
                    mm: 3.0,
                    mr,
                    zeta: 0.2,
                    xi: 2.0,
                };
                let weights = Weights {
                    q: [q1, 10.0, 0.0, 0.1],
                    r,
                };
                let got = regulator(&camera, &weights).unwrap();
                let (a, b) = camera.linearisation();
                let (open, numerators) = transfer(&a, &b);
                let mut closed = open;
                for (gain, numerator) in got.gains.iter().zip(&numerators) {
                    for (c, n) in closed.iter_mut().zip(numerator) {
                        *c += gain * n;
                    }
                }
                let square = |p: &[f64], w: f64| value(p, [0.0, w]).iter().map(|x| x * x).sum::<f64>();
                for w in [0.0, 0.1, 0.5, 1.0, 2.0, 10.0, 100.0] {
                    let cost: f64 = weights
                        .q
                        .iter()
                        .zip(&numerators)
                        .map(|(q, n)| q * square(n, w) / r)
                        .sum();
                    let (found, want) = (square(&closed, w), square(&open, w) + cost);
                    assert!(
                        (found / want - 1.0).abs() < 1e-9,
                        "{camera:?} {weights:?} {w} {found} {want}"
                    );
                }
                for p in got.poles {
                    assert!(p[0] < 0.0);
                    // The distance to the root nearby, by Newton's step.
                    let slope: [f64; 4] = std::array::from_fn(|k| (k + 1) as f64 * closed[k + 1]);
                    let (c, c1) = (value(&closed, p), value(&slope, p));
                    let away = c[0].hypot(c[1]) / c1[0].hypot(c1[1]);
                    assert!(
                        away < 1e-9 * (1.0 + p[0].hypot(p[1])),
                        "{camera:?} {weights:?} {p:?} {away}"
                    );
                }
                let sum: f64 = got.poles.iter().map(|p| p[0]).sum();
                assert!(close(sum, -closed[3], 1e-10 * closed[3].abs()), "{sum} {closed:?}");
                assert!(got.riccati_residual < 1e-11, "{camera:?} {weights:?} {got:?}");
                count += 1;
            }
        }
    }
    assert_eq!(count, 48);
}

#[test]
fn control_cheap_beyond_the_hamiltonian_s_digits_is_found_too() {
    // The limit of cheap control: the gain on the spar is sqrt(q1 / r), its poles run to the zeros.
    for ratio in [1e8, 1e12, 1e16] {
        let weights = Weights {
            q: [1e4, 0.0, 0.0, 0.0],
            r: 1e4 / ratio,
        };
        let got = regulator(&CameraParameters::thesis(), &weights).unwrap();
        assert!(got.riccati_residual < 1e-10, "{ratio:e} {got:?}");
        assert!(
            close(got.gains[0].abs() / ratio.sqrt(), 1.0, 3.0 / ratio.powf(0.25)),
            "{ratio:e} {got:?}"
        );
    }
}

#[test]
fn weights_that_see_nothing_leave_a_standing_spar_to_the_cheapest_control() {
    // Q = 0 on a spar that stands (k1 < -k2): the cheapest stabilising law mirrors the unstable poles.
    let camera = CameraParameters {
        lm: 0.05,
        lr: 0.05,
        mm: 1.0,
        mr: 1.0,
        zeta: 0.2,
        xi: 2.0,
    };
    let open = closed_loop_poles(&camera, &[0.0; 4]).unwrap();
    let got = regulator(&camera, &Weights { q: [0.0; 4], r: 1.0 }).unwrap();
    for p in open {
        let mirrored = [-p[0].abs(), p[1]];
        assert!(
            got.poles
                .iter()
                .any(|g| (g[0] - mirrored[0]).hypot(g[1] - mirrored[1]) < 1e-9),
            "{open:?} {got:?}"
        );
    }
    assert!(open.iter().any(|p| p[0] > 0.5));
}

#[test]
fn an_undamped_motion_the_weights_do_not_see_has_no_regulator() {
    let camera = CameraParameters {
        zeta: 0.0,
        xi: 0.0,
        ..CameraParameters::thesis()
    };
    assert_eq!(regulator(&camera, &Weights { q: [0.0; 4], r: 1.0 }), Err(NoRegulator));
}
