//! The spatial vehicle of chapter 6, against its errata and its balances.

use super::*;
use crate::analysis::dop853::integrate;
use crate::analysis::poles::eigenvalues;
use model::dynamics::planar::{Planar, PlanarParameters};
use proptest::prelude::*;

/// L = 0.8, a = 0.9, zeta = 2.2, mu = 0.066, half track one wheel radius, level.
fn reference() -> SpatialParameters<f64> {
    let level = PlanarParameters {
        beta: 0.0,
        ..PlanarParameters::thesis()
    };
    SpatialParameters::from_planar(&level, 1.0, 0.0)
}

const REST: SpatialState<f64> = [0.0; 9];

/// x, y and psi at the end of a run of 10.
fn place(p: &SpatialParameters<f64>, u: [f64; 2], state: &SpatialState<f64>) -> [f64; 3] {
    let run = run(p, u, state, 10.0, 0.5).unwrap();
    assert_eq!(run.t.len(), 21);
    for (energy, constraint) in run.energy_residual.iter().zip(&run.constraint_residual) {
        assert!(energy.abs() < 1e-10 && *constraint < 1e-10, "{energy} {constraint}");
    }
    [run.x[20], run.y[20], run.psi[20]]
}

fn assert_place(got: [f64; 3], want: [f64; 3], tolerance: f64) {
    for (g, w) in got.iter().zip(want) {
        assert!((g - w).abs() < tolerance, "{got:?} {want:?}");
    }
}

/// Erratum E21: a turn, a side slope and free rolling by d'Alembert's principle.
#[test]
fn turns_side_slopes_and_free_rolling_end_where_they_should() {
    assert_place(place(&reference(), [0.6, 0.4], &REST), [3.7394, 1.9051, 0.9007], 5e-5);
    let side = SpatialParameters {
        slope_y: 0.1,
        ..reference()
    };
    assert_place(place(&side, [0.6, 0.6], &REST), [5.192, 0.052, 0.009], 5e-4);
    let free = SpatialParameters {
        zeta: 0.0,
        ..reference()
    };
    let rolling = [0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 1.0, 0.4, 0.0];
    assert_place(place(&free, [0.0, 0.0], &rolling), [0.255, 4.239, 3.293], 5e-4);
}

/// Erratum E20: phi from the plane's normal here, from the vertical in the planar model.
#[test]
fn straight_running_is_the_planar_vehicle() {
    for (beta, u) in [(0.0873, 3.0), (-0.2, 1.5), (0.3, 2.0)] {
        let planar = PlanarParameters {
            beta,
            ..PlanarParameters::thesis()
        };
        let flat = Planar::new(planar);
        let want = integrate(
            |_, x: &[f64; 4]| flat.rate(x, u),
            0.0,
            [0.0, 0.1, 0.0, 0.0],
            20.0,
            1e-13,
        )
        .unwrap();
        let spatial = SpatialParameters::from_planar(&planar, 0.9, 0.05);
        let start = [0.0, 0.0, 0.0, 0.0, 0.0, 0.1 - beta, 0.0, 0.0, 0.0];
        let got = run(&spatial, [0.5 * u, 0.5 * u], &start, 20.0, 20.0).unwrap();
        let difference = (got.theta_r[1] - want[0])
            .abs()
            .max((got.phi[1] + beta - want[1]).abs());
        assert!(difference < 8e-12, "{difference:e}");
        assert!(got.y[1].abs() < 1e-12 && (got.x[1] - got.theta_r[1]).abs() < 1e-11);
        // Without the correction the two angles describe different vehicles.
        let uncorrected = run(
            &spatial,
            [0.5 * u, 0.5 * u],
            &[0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0],
            20.0,
            20.0,
        );
        assert!((uncorrected.unwrap().theta_r[1] - want[0]).abs() > 1e-3);
    }
}

/// The poles of the reduced system (v, psi', phi, phi') on the level, spinning at `rate`.
fn spin_poles(p: &SpatialParameters<f64>, rate: f64) -> [[f64; 2]; 4] {
    let model = Spatial::new(*p);
    let slope = |y: &[f64; 4]| {
        let [v, spin, phi, phi_rate] = *y;
        let x = [0.0, 0.0, 0.0, 0.0, 0.0, phi, v + p.s * spin, v - p.s * spin, phi_rate];
        // The voltages that hold the spin against the damping.
        let hold = 0.5 * p.zeta * p.s * rate;
        let [right, left, swing] = model.accelerations(&x, [hold, -hold]);
        [0.5 * (right + left), 0.5 * (right - left) / p.s, phi_rate, swing]
    };
    let h = 1e-5;
    let columns: [[f64; 4]; 4] = std::array::from_fn(|j| {
        let moved = |d: f64| {
            let mut y = [0.0, rate, 0.0, 0.0];
            y[j] += d;
            slope(&y)
        };
        let (plus, minus) = (moved(h), moved(-h));
        std::array::from_fn(|i| (plus[i] - minus[i]) / (2.0 * h))
    });
    eigenvalues(&nalgebra::SMatrix::from_fn(|i, j| columns[j][i])).unwrap()
}

fn spin_growth(p: &SpatialParameters<f64>, rate: f64) -> f64 {
    spin_poles(p, rate).iter().map(|z| z[0]).fold(f64::MIN, f64::max)
}

/// Erratum E26.
#[test]
fn the_reference_vehicle_spins_stably_up_to_1_614132() {
    for zeta in [0.01, 0.5, 2.2] {
        let p = SpatialParameters { zeta, ..reference() };
        let limit = p.spin_stability_limit().unwrap();
        assert!((limit - 1.614132).abs() < 5e-7, "{limit}");
        assert!(spin_growth(&p, 0.9999 * limit) < 0.0 && spin_growth(&p, 1.0001 * limit) > 0.0);
        // A pair crosses the axis: an oscillation grows; nothing diverges.
        assert!(spin_poles(&p, 1.0001 * limit).iter().any(|z| z[0] > 0.0 && z[1] > 2.0));
    }
}

/// A simulated run grows or decays as the poles predict.
#[test]
fn a_spin_beyond_the_limit_throws_the_mass_out() {
    let p = reference();
    let limit = p.spin_stability_limit().unwrap();
    let swing = |rate: f64| {
        let start = [0.0, 0.0, 0.0, 0.0, 0.0, 1e-3, rate, -rate, 0.0];
        let hold = 0.5 * p.zeta * rate;
        let run = run(&p, [hold, -hold], &start, 200.0, 0.05).unwrap();
        run.phi.iter().fold(0.0_f64, |m, x| m.max(x.abs()))
    };
    let (below, above) = (swing(0.97 * limit), swing(1.03 * limit));
    assert!(below < 2e-3 && above > 0.1, "{below} {above}");
}

proptest! {
    #[test]
    fn the_spin_limit_is_where_the_poles_cross(
        l in 0.3..1.6_f64, alpha in 0.3..0.95_f64, zeta in 0.3..3.0_f64, mu in 0.0..0.2_f64, nu in 0.0..0.2_f64,
        s in 0.4..2.0_f64, mass in 1.0..1.5_f64,
    ) {
        let p = SpatialParameters { l, alpha, zeta, mu, nu, s, ..reference() }.carrying(mass);
        match p.spin_stability_limit() {
            Some(limit) if limit < 20.0 => {
                prop_assert!(spin_growth(&p, 0.99 * limit) < 0.0, "{limit}");
                prop_assert!(spin_growth(&p, 1.01 * limit) > 0.0, "{limit}");
            }
            Some(_) => prop_assert!(spin_growth(&p, 19.0) < 1e-9),
            None => for rate in [1.0, 3.0, 9.0] {
                prop_assert!(spin_growth(&p, rate) < 1e-9);
            },
        }
    }

    /// On any plane and from any state, a run and its mirror image agree, and both keep their balances.
    #[test]
    fn runs_keep_their_balances_and_their_mirror(
        slope in prop::array::uniform2(-0.4..0.4_f64), u in prop::array::uniform2(-1.5..1.5_f64), s in 0.5..1.5_f64,
        state in prop::array::uniform9(-0.8..0.8_f64),
    ) {
        let p = SpatialParameters { slope_x: slope[0], slope_y: slope[1], s, nu: 0.05, ..reference() };
        let q = SpatialParameters { slope_y: -slope[1], ..p };
        let [x, y, psi, theta_r, theta_l, phi, rate_r, rate_l, phi_rate] = state;
        let mirrored = [x, -y, -psi, theta_l, theta_r, phi, rate_l, rate_r, phi_rate];
        let a = run(&p, u, &state, 4.0, 1.0).unwrap();
        let b = run(&q, [u[1], u[0]], &mirrored, 4.0, 1.0).unwrap();
        for k in 0..a.t.len() {
            prop_assert!((a.x[k] - b.x[k]).abs() < 1e-8 && (a.y[k] + b.y[k]).abs() < 1e-8);
            prop_assert!((a.psi[k] + b.psi[k]).abs() < 1e-8 && (a.phi[k] - b.phi[k]).abs() < 1e-8);
            prop_assert!(a.energy_residual[k].abs() < 1e-9 && a.constraint_residual[k] < 1e-9);
        }
    }
}
