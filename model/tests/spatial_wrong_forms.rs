//! Two wrong derivations of rolling: how far their solutions go astray, and that their energy balance does not show it.
//! Only these tests contain them.
mod multibody;

use model::dynamics::planar::PlanarParameters;
use model::dynamics::spatial::{Spatial, SpatialParameters, SpatialState};
use model::integrate::rk4_step;
use multibody::{Equations, Jet, Multibody, Point};
use nalgebra::{DMatrix, DVector};

const STEPS: usize = 4000;
const SPAN: f64 = 10.0;

fn reference() -> SpatialParameters<f64> {
    let level = PlanarParameters {
        beta: 0.0,
        ..PlanarParameters::thesis()
    };
    SpatialParameters::from_planar(&level, 1.0, 0.0)
}

/// x, y, psi at t = 10 by the right equations.
fn right(p: &SpatialParameters<f64>, u: [f64; 2], state: SpatialState<f64>) -> [f64; 3] {
    let model = Spatial::new(*p);
    let end = (0..STEPS).fold(state, |x, _| rk4_step(&x, SPAN / STEPS as f64, |x| model.rate(x, u)));
    [end[0], end[1], end[2]]
}

/// The sign of the last term of (6.16).
#[derive(Clone, Copy, PartialEq)]
enum Sign {
    /// As the variational principle (and the Appendix's code) has it.
    Variational,
    /// As printed.
    Printed,
}

/// x, y, theta_r, theta_l, phi, their rates, and the two multipliers.
type Augmented = [f64; 12];

/// The system of (6.16): five coordinates, psi replaced by (6.12), the constraints (6.15) multiplied into
/// the Lagrangian.
struct Vakonomic {
    p: SpatialParameters<f64>,
    u: [f64; 2],
    sign: Sign,
}

impl Vakonomic {
    fn equations(&self, x: &Augmented) -> (Equations, f64) {
        let p = self.p;
        let points = move |q: &[Jet; 5]| -> Vec<Point> {
            let psi = (0.5 / p.s) * (q[2] - q[3]);
            let (sin, cos) = (psi.sin(), psi.cos());
            let reach = p.l * q[4].sin();
            let arm = [q[0] + reach * cos, q[1] + reach * sin, -(p.l * q[4].cos())];
            let wheel = |side: f64| [q[0] + side * sin, q[1] - side * cos, Jet::constant(0.0)];
            let share = 0.5 * (1.0 - p.alpha);
            vec![(p.alpha, arm), (share, wheel(p.s)), (share, wheel(-p.s))]
        };
        let spins = [
            (0.5 * p.mu, [0.0, 0.0, 1.0, 0.0, 0.0]),
            (0.5 * p.mu, [0.0, 0.0, 0.0, 1.0, 0.0]),
        ];
        let system = Multibody {
            points: &points,
            spins: &spins,
            gravity: p.up().map(|n| -n),
        };
        let (q, rates) = split(x);
        (system.equations(&q, &rates), system.energy(&q, &rates))
    }

    fn rate(&self, x: &Augmented) -> Augmented {
        let p = self.p;
        let (Equations { mass, mut force }, _) = self.equations(x);
        let (q, rates) = split(x);
        let lambda = [x[10], x[11]];
        let tau: [f64; 2] = [0, 1].map(|i| self.u[i] - 0.5 * p.zeta * (rates[2 + i] + rates[4]));
        for (i, applied) in [0.0, 0.0, tau[0], tau[1], tau[0] + tau[1]].into_iter().enumerate() {
            force[i] += applied;
        }
        // C1 = x' - v cos(psi), C2 = y' - v sin(psi) with psi = (theta_r - theta_l)/2s.
        let (sin, cos) = ((q[2] - q[3]) / (2.0 * p.s)).sin_cos();
        let (v, psi_rate) = (0.5 * (rates[2] + rates[3]), (rates[2] - rates[3]) / (2.0 * p.s));
        let a = [
            [1.0, 0.0, -0.5 * cos, -0.5 * cos, 0.0],
            [0.0, 1.0, -0.5 * sin, -0.5 * sin, 0.0],
        ];
        let a_rate = [[0.5 * sin * psi_rate; 2], [-0.5 * cos * psi_rate; 2]];
        let turn = v / (2.0 * p.s);
        let gradient = [[turn * sin, -turn * sin], [-turn * cos, turn * cos]];
        for c in 0..2 {
            for wheel in 0..2 {
                force[2 + wheel] += lambda[c]
                    * match self.sign {
                        Sign::Variational => gradient[c][wheel] - a_rate[c][wheel],
                        Sign::Printed => gradient[c][wheel] + a_rate[c][wheel],
                    };
            }
        }
        let mut system = DMatrix::zeros(7, 7);
        system.view_mut((0, 0), (5, 5)).copy_from(&mass);
        let mut known = DVector::zeros(7);
        known.rows_mut(0, 5).copy_from(&force);
        for c in 0..2 {
            for i in 0..5 {
                system[(5 + c, i)] = a[c][i];
                // The multiplier's rate is the unknown: plus as in d/dt(lambda A), or minus as printed.
                system[(i, 5 + c)] = if self.sign == Sign::Variational {
                    a[c][i]
                } else {
                    -a[c][i]
                };
            }
            known[5 + c] = -(a_rate[c][0] * rates[2] + a_rate[c][1] * rates[3]);
        }
        let solution = system.lu().solve(&known).expect("regular");
        std::array::from_fn(|i| if i < 5 { rates[i] } else { solution[i - 5] })
    }

    /// x, y, psi at t = 10, and the largest change of energy less work on the way.
    fn run(&self, state: SpatialState<f64>, lambda: [f64; 2]) -> ([f64; 3], f64) {
        let [x, y, _, theta_r, theta_l, phi, rate_r, rate_l, phi_rate] = state;
        let v = 0.5 * (rate_r + rate_l);
        let start: Augmented = [
            x, y, theta_r, theta_l, phi, v, 0.0, rate_r, rate_l, phi_rate, lambda[0], lambda[1],
        ];
        let energy = |x: &Augmented| self.equations(x).1;
        let mut worst: f64 = 0.0;
        let end = (0..STEPS).fold(start, |x, _| {
            worst = worst.max((energy(&x) - energy(&start)).abs());
            rk4_step(&x, SPAN / STEPS as f64, |x| self.rate(x))
        });
        ([end[0], end[1], (end[2] - end[3]) / (2.0 * self.p.s)], worst)
    }
}

fn split(x: &Augmented) -> ([f64; 5], [f64; 5]) {
    (std::array::from_fn(|i| x[i]), std::array::from_fn(|i| x[5 + i]))
}

fn assert_place(got: [f64; 3], want: [f64; 3], tolerance: f64) {
    for (g, w) in got.iter().zip(want) {
        assert!((g - w).abs() < tolerance, "{got:?} {want:?}");
    }
}

const REST: SpatialState<f64> = [0.0; 9];
const ROLLING: SpatialState<f64> = [0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 1.0, 0.4, 0.0];

#[test]
fn a_level_turn_differs_and_depends_on_where_the_multipliers_start() {
    let wrong = Vakonomic {
        p: reference(),
        u: [0.6, 0.4],
        sign: Sign::Variational,
    };
    assert_place(right(&wrong.p, wrong.u, REST), [3.7394, 1.9051, 0.9007], 5e-5);
    assert_place(wrong.run(REST, [0.0, 0.0]).0, [3.7358, 1.9124, 0.9022], 5e-5);
    assert_place(wrong.run(REST, [0.2, 0.1]).0, [3.8023, 1.7656, 0.8885], 5e-5);
}

#[test]
fn on_a_side_slope_the_wrong_principle_steers_by_itself() {
    let p = SpatialParameters {
        slope_y: 0.1,
        ..reference()
    };
    let u = [0.6, 0.6];
    assert_place(right(&p, u, REST), [5.192, 0.052, 0.009], 5e-4);
    let variational = Vakonomic {
        p,
        u,
        sign: Sign::Variational,
    };
    assert_place(variational.run(REST, [0.0, 0.0]).0, [4.284, -1.493, -0.903], 5e-4);
    let printed = Vakonomic {
        p,
        u,
        sign: Sign::Printed,
    };
    assert_place(printed.run(REST, [0.0, 0.0]).0, [4.860, 2.382, 1.122], 5e-4);
}

#[test]
fn free_rolling_goes_elsewhere_and_conserves_energy_all_the_same() {
    let p = SpatialParameters {
        zeta: 0.0,
        ..reference()
    };
    let wrong = Vakonomic {
        p,
        u: [0.0, 0.0],
        sign: Sign::Variational,
    };
    let (place, drift) = wrong.run(ROLLING, [0.0, 0.0]);
    assert_place(place, [3.007, 0.640, 4.904], 5e-4);
    assert!(drift < 1e-9, "{drift}");
    assert_place(right(&p, [0.0, 0.0], ROLLING), [0.255, 4.239, 3.293], 5e-4);
}

/// The constraints inserted into T before Lagrange's equations: v, psi', phi and phi' on the level, undriven.
fn substituted(p: &SpatialParameters<f64>, x: &[f64; 9]) -> [f64; 9] {
    let (sin, cos) = x[5].sin_cos();
    let al = p.alpha * p.l;
    let (v, psi_rate) = (0.5 * (x[6] + x[7]), (x[6] - x[7]) / (2.0 * p.s));
    let yaw_inertia = (1.0 - p.alpha + p.mu) * p.s * p.s + p.j0 + al * p.l * sin * sin;
    // d/dt dT/dv = 0 and d/dt dT/dpsi' = 0: both momenta conserved, which the right equations deny.
    let (m11, m12, m22) = (1.0 + p.mu, al * cos, al * p.l);
    let (f1, f2) = (
        al * sin * x[8] * x[8],
        al * p.l * sin * cos * psi_rate * psi_rate - al * sin,
    );
    let determinant = m11 * m22 - m12 * m12;
    let forward = (m22 * f1 - m12 * f2) / determinant;
    let swing = (m11 * f2 - m12 * f1) / determinant;
    let yaw = -2.0 * al * p.l * sin * cos * x[8] * psi_rate / yaw_inertia;
    let (sin_psi, cos_psi) = x[2].sin_cos();
    let turn = p.s * yaw;
    [
        v * cos_psi,
        v * sin_psi,
        psi_rate,
        x[6],
        x[7],
        x[8],
        forward + turn,
        forward - turn,
        swing,
    ]
}

#[test]
fn constraints_put_into_the_kinetic_energy_go_astray_and_conserve_energy_too() {
    let p = SpatialParameters {
        zeta: 0.0,
        ..reference()
    };
    let model = Spatial::new(p);
    let start = [0.0, 0.0, 0.0, 0.0, 0.0, 0.8, 1.5, 0.5, 0.0];
    let h = SPAN / STEPS as f64;
    let energy = model.energy(&start);
    let mut drift: f64 = 0.0;
    let wrong = (0..STEPS).fold(start, |x, _| {
        drift = drift.max((model.energy(&x) - energy).abs());
        rk4_step(&x, h, |x| substituted(&p, x))
    });
    let good = right(&p, [0.0, 0.0], start);
    assert!(drift < 1e-9, "{drift}");
    assert!(
        (wrong[0] - good[0]).hypot(wrong[1] - good[1]) > 0.5,
        "{wrong:?} {good:?}"
    );
    // The wrong form loses these two terms, and nothing else: +aL sin(phi) psi'^2 ahead, -aL sin(phi) v psi' in yaw.
    let x = [0.0, 0.0, 0.4, 0.0, 0.0, 0.7, 1.1, 0.3, -0.5];
    let [v, psi_rate] = model.forward_and_yaw_rate(&x);
    let (al, (sin, cos)) = (p.alpha * p.l, x[5].sin_cos());
    let (m11, m12, m22) = (1.0 + p.mu, al * cos, al * p.l);
    let lost = al * sin * psi_rate * psi_rate / (m11 * m22 - m12 * m12);
    let yaw_inertia = (1.0 - p.alpha + p.mu) * p.s * p.s + al * p.l * sin * sin;
    let turn = -p.s * al * sin * v * psi_rate / yaw_inertia;
    let (full, partial) = (model.rate(&x, [0.0, 0.0]), substituted(&p, &x));
    for (i, missing) in [(6, m22 * lost + turn), (7, m22 * lost - turn), (8, -m12 * lost)] {
        assert!((full[i] - partial[i] - missing).abs() < 1e-12, "{i}");
    }
}

/// The Appendix's alpha = R (theta_r + theta_l) / 2d in the constraints (6.15): what the wheels would do.
#[test]
fn with_the_sign_of_the_appendix_a_vehicle_driven_straight_ahead_spins_on_the_spot() {
    let s = 0.9;
    let moves = |sign: f64, rate_r: f64, rate_l: f64, psi: f64| {
        let psi_rate = (rate_r + sign * rate_l) / (2.0 * s);
        let ahead = rate_r - s * psi_rate;
        [ahead * f64::cos(psi), ahead * f64::sin(psi), psi_rate]
    };
    let appendix = moves(1.0, 1.0, 1.0, 0.4);
    assert!(appendix[0].abs() < 1e-15 && appendix[1].abs() < 1e-15 && (appendix[2] - 1.0 / s).abs() < 1e-15);
    // With (6.12) they roll straight, which is what the model does.
    let right = moves(-1.0, 1.0, 1.0, 0.4);
    let model = Spatial::new(SpatialParameters { s, ..reference() });
    let rate = model.rate(&[0.0, 0.0, 0.4, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0], [0.0, 0.0]);
    for (r, m) in right.iter().zip(rate) {
        assert!((r - m).abs() < 1e-15, "{right:?} {rate:?}");
    }
}
