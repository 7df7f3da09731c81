//! Invariants of the planar vehicle for random parameters.

use model::dynamics::planar::{Planar, PlanarParameters, PlanarState};
use proptest::prelude::*;
use theory::analysis::dop853::integrate;
use theory::analysis::equilibrium::{characteristic_polynomial, poles, static_phi};
use theory::analysis::input::Input;
use theory::analysis::simulate::simulate;
use theory::analysis::waveform::Waveform;

/// Random vehicles with parameters in the range of vehicles that can be built.
fn vehicles() -> impl Strategy<Value = PlanarParameters<f64>> {
    (
        0.3_f64..1.4,
        0.3_f64..0.95,
        0.0_f64..4.0,
        0.01_f64..0.4,
        0.0_f64..0.2,
        -0.25_f64..0.25,
    )
        .prop_map(|(l, alpha, zeta, mu, nu, beta)| PlanarParameters {
            l,
            alpha,
            zeta,
            mu,
            nu,
            beta,
        })
}

fn states() -> impl Strategy<Value = PlanarState<f64>> {
    (-3.0_f64..3.0, -4.0_f64..4.0, -3.0_f64..3.0, -3.0_f64..3.0).prop_map(|(a, b, c, d)| [a, b, c, d])
}

/// Kinetic energy of both bodies, wheels and rotors, and the height of both bodies.
fn energy(p: &PlanarParameters<f64>, x: &PlanarState<f64>) -> f64 {
    let [theta, phi, wheel, arm] = *x;
    // Axle along the slope, arm relative to the axle; the slope's direction is turned by beta.
    let (along, across) = (
        wheel + p.l * arm * (phi - p.beta).cos(),
        p.l * arm * (phi - p.beta).sin(),
    );
    let masses = 0.5 * (1.0 - p.alpha) * wheel * wheel + 0.5 * p.alpha * (along * along + across * across);
    let turning = 0.5 * p.mu * wheel * wheel + 0.5 * p.nu * (wheel + arm) * (wheel + arm);
    masses + turning + theta * p.beta.sin() - p.alpha * p.l * phi.cos()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The energy of the bodies grows by the work of the motor less the loss in the damping. The climb counts as
    /// potential energy or, apart, as the work of the slope.
    #[test]
    fn energy_balances(p in vehicles(), start in states(), u in -4.0_f64..4.0) {
        let planar = Planar::new(p);
        let rate = |_: f64, x: &[f64; 7]| {
            let state = [x[0], x[1], x[2], x[3]];
            let r = planar.rate(&state, u);
            let relative = x[2] + x[3];
            [r[0], r[1], r[2], r[3], u * relative, p.zeta * relative * relative, p.beta.sin() * x[2]]
        };
        let x = integrate(rate, 0.0, [start[0], start[1], start[2], start[3], 0.0, 0.0, 0.0], 8.0, 1e-12).unwrap();
        let end = [x[0], x[1], x[2], x[3]];
        let gained = energy(&p, &end) - energy(&p, &start);
        let size = 1.0 + x[4].abs() + x[5].abs();
        prop_assert!((gained - (x[4] - x[5])).abs() < 1e-8 * size, "{gained} {} {}", x[4], x[5]);
        let climbed = (end[0] - start[0]) * p.beta.sin();
        prop_assert!((climbed - x[6]).abs() < 1e-8 * size);
    }

    /// The mirror image of a run is the run of the mirror image.
    #[test]
    fn mirrored_slopes_mirror_the_motion(p in vehicles(), start in states(), u in -4.0_f64..4.0) {
        let q = PlanarParameters { beta: -p.beta, ..p };
        let (a, b) = (Planar::new(p), Planar::new(q));
        let mirrored = start.map(|v| -v);
        let (x, y) = (a.rate(&start, u), b.rate(&mirrored, -u));
        for i in 0..4 {
            prop_assert!((x[i] + y[i]).abs() <= 1e-13 * (1.0 + x[i].abs()));
        }
        let (f, g) = (a.contact_forces(&start, u), b.contact_forces(&mirrored, -u));
        prop_assert!((f.friction + g.friction).abs() < 1e-12 * (1.0 + f.friction.abs()));
        prop_assert!((f.normal - g.normal).abs() < 1e-12 * (1.0 + f.normal.abs()));
    }

    /// Arithmetic in f32, as on the vehicle, against f64: one evaluation, and a drive with equal steps.
    #[test]
    fn f32_follows_f64(p in vehicles(), start in states(), u in -4.0_f64..4.0) {
        // Exactly representable in f32, so that only the arithmetic differs.
        let p: PlanarParameters<f64> = p.cast::<f32>().cast();
        let start = start.map(|v| f64::from(v as f32));
        let u = f64::from(u as f32);
        let (double, single) = (Planar::new(p), Planar::<f32>::new(p.cast()));
        let (x, y) = (double.accelerations(&start, u), single.accelerations(&start.map(|v| v as f32), u as f32));
        let size = 1.0 + x[0].abs().max(x[1].abs());
        for i in 0..2 {
            prop_assert!((x[i] - f64::from(y[i])).abs() < 3e-5 * size, "{x:?} {y:?}");
        }
        let (mut a, mut b) = (start, start.map(|v| v as f32));
        for _ in 0..400 {
            a = double.rk4(&a, u, 0.0078125);
            b = single.rk4(&b, u as f32, 0.0078125);
        }
        let spread = (1..4).map(|i| (a[i] - f64::from(b[i])).abs()).fold(0.0, f64::max);
        prop_assert!(spread < 5e-3, "{a:?} {b:?}");
    }

    /// (3.21) by the Routh determinant `a2 a1 - a3 a0`, whose closed form is never negative and is zero where its bracket vanishes
    /// (erratum E7), and by the roots.
    #[test]
    fn the_open_loop_is_stable_but_for_one_exception(p in vehicles()) {
        let p = PlanarParameters { nu: 0.0, zeta: p.zeta + 0.05, ..p };
        prop_assume!(p.beta.sin().abs() < 0.95 * p.alpha * p.l);
        let phi = static_phi(&p).unwrap();
        let al = p.alpha * p.l;
        let bracket = 1.0 + p.mu - al * (p.beta - phi).cos();
        let closed_form = p.zeta * al * phi.cos() * bracket * bracket;
        let [a0, a1, a2, a3] = characteristic_polynomial(&p, phi, None);
        prop_assert!((a2 * a1 - a3 * a0 - closed_form).abs() < 1e-12 * (1.0 + closed_form));
        prop_assert!(characteristic_polynomial(&p, phi, None).iter().all(|a| *a > 0.0));
        prop_assert!(poles(&p, phi, None).iter().all(|z| z[0] < 1e-9));
        // The saddle has exactly one unstable direction.
        let unstable = poles(&p, std::f64::consts::PI - phi, None).iter().filter(|z| z[0] > 0.0).count();
        prop_assert_eq!(unstable, 1);
    }

    /// The extremes that a run reports do not depend on its samples.
    #[test]
    fn extremes_do_not_depend_on_sampling(p in vehicles(), u in 0.1_f64..3.0) {
        let p = PlanarParameters { zeta: p.zeta + 0.3, ..p };
        prop_assume!(p.beta.sin().abs() < 0.9 * p.alpha * p.l);
        let start = [0.0, static_phi(&p).unwrap(), 0.0, 0.0];
        let input = Input::voltage_step(&p, u).shaped(Waveform::HalfCosine, 1.0);
        let (coarse, fine) = (simulate(&p, &input, start, 12.0, 4.0).unwrap(), simulate(&p, &input, start, 12.0, 0.002).unwrap());
        prop_assert_eq!((coarse.phi_max, coarse.lifted, coarse.t.len()), (fine.phi_max, fine.lifted, 4));
        let sampled = fine.phi.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        prop_assert!(sampled <= fine.phi_max + 1e-10 && sampled > fine.phi_max - 1e-4);
        if let Some(needed) = fine.friction_coefficient_required {
            let sampled = fine.friction_coefficient().iter().copied().fold(0.0, f64::max);
            prop_assert!(sampled <= needed * (1.0 + 1e-9) && sampled > needed * 0.99, "{} {}", sampled, needed);
        }
    }
}

/// Erratum E7: the exception, an undamped swing.
#[test]
fn a_long_arm_can_be_undamped() {
    let p = PlanarParameters {
        l: 1.2,
        alpha: 0.9,
        zeta: 2.2,
        mu: 0.08,
        nu: 0.0,
        beta: 0.0,
    };
    let found = poles(&p, 0.0, None);
    assert!(
        found[1][0].abs() < 1e-12 && (found[2][1] - 2.236).abs() < 1e-3 && found[1][1] == -found[2][1],
        "{found:?}"
    );
}
