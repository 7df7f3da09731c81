//! The reduced spatial equations against six coordinates with Lagrange multipliers, and against wheels
//! that are rings of point masses.
mod multibody;

use model::dynamics::planar::{Planar, PlanarParameters};
use model::dynamics::spatial::{
    PHI, PHI_RATE, PSI, RATE_L, RATE_R, Spatial, SpatialParameters, SpatialState, THETA_L, THETA_R, X, Y,
};
use model::integrate::rk4_step;
use multibody::{Jet, Multibody, Point};
use proptest::prelude::*;

fn parameters() -> impl Strategy<Value = SpatialParameters<f64>> {
    (
        0.3..1.3_f64,
        0.3..0.95_f64,
        0.0..3.0_f64,
        0.0..0.2_f64,
        0.0..0.2_f64,
        0.4..2.0_f64,
        0.0..0.2_f64,
        // Of what the arm leaves.
        0.0..0.9_f64,
        -0.6..0.6_f64,
        -0.6..0.6_f64,
    )
        .prop_map(
            |(l, alpha, zeta, mu, nu, s, j0, middle, slope_x, slope_y)| SpatialParameters {
                l,
                alpha,
                zeta,
                mu,
                nu,
                s,
                j0,
                middle: middle * (1.0 - alpha),
                slope_x,
                slope_y,
            },
        )
}

fn states() -> impl Strategy<Value = SpatialState<f64>> {
    prop::array::uniform9(-2.5..2.5_f64)
}

/// Arm and wheel centres as the thesis places them: (6.1), (6.2). Coordinates x, y, psi, ...
fn bodies(p: &SpatialParameters<f64>, q: &[Jet; 6]) -> [[Jet; 3]; 3] {
    let (sin, cos) = (q[2].sin(), q[2].cos());
    let reach = p.l * q[5].sin();
    let arm = [
        q[0] + reach * cos,
        q[1] + reach * sin,
        Jet::constant(1.0) - p.l * q[5].cos(),
    ];
    let wheel = |side: f64| [q[0] + side * sin, q[1] - side * cos, Jet::constant(1.0)];
    [arm, wheel(p.s), wheel(-p.s)]
}

/// (6.12) as a rate and (6.15) for the right wheel: three constraints on six coordinates.
fn rolling(p: &SpatialParameters<f64>, q: &[Jet; 6]) -> [[Jet; 6]; 3] {
    let c = Jet::constant;
    let (sin, cos) = (q[2].sin(), q[2].cos());
    [
        [c(0.0), c(0.0), c(-2.0 * p.s), c(1.0), c(-1.0), c(0.0)],
        [c(1.0), c(0.0), p.s * cos, -cos, c(0.0), c(0.0)],
        [c(0.0), c(1.0), p.s * sin, -sin, c(0.0), c(0.0)],
    ]
}

/// Coordinates and constrained rates of a state.
fn coordinates(model: &Spatial<f64>, x: &SpatialState<f64>) -> ([f64; 6], [f64; 6]) {
    let r = model.rate(x, [0.0; 2]);
    (
        [x[X], x[Y], x[PSI], x[THETA_R], x[THETA_L], x[PHI]],
        [r[X], r[Y], r[PSI], x[RATE_R], x[RATE_L], x[PHI_RATE]],
    )
}

fn gravity(p: &SpatialParameters<f64>) -> [f64; 3] {
    p.up().map(|n| -n)
}

proptest! {
    #[test]
    fn reduced_equals_six_coordinates_with_multipliers(
        p in parameters(), x in states(), u in prop::array::uniform2(-3.0..3.0_f64),
    ) {
        let model = Spatial::new(p);
        let points = |q: &[Jet; 6]| -> Vec<Point> {
            let [arm, right, left] = bodies(&p, q);
            let wheel = 0.5 * (1.0 - p.alpha - p.middle);
            let middle = [q[0], q[1], Jet::constant(1.0)];
            vec![(p.alpha, arm), (p.middle, middle), (wheel, right), (wheel, left)]
        };
        let spins = [
            (0.5 * p.mu, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
            (0.5 * p.mu, [0.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
            (0.5 * p.nu, [0.0, 0.0, 0.0, 1.0, 0.0, 1.0]),
            (0.5 * p.nu, [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]),
            (p.j0, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
        ];
        let system = Multibody { points: &points, spins: &spins, gravity: gravity(&p) };
        let (q, rates) = coordinates(&model, &x);
        let tau: [f64; 2] = [0, 1].map(|i| u[i] - 0.5 * p.zeta * (rates[3 + i] + rates[5]));
        let applied = [0.0, 0.0, 0.0, tau[0], tau[1], tau[0] + tau[1]];
        let (want, _) = system.constrained(&q, &rates, &applied, &|q| rolling(&p, q));
        let got = model.accelerations(&x, u);
        for (g, w) in got.iter().zip(&want[3..]) {
            prop_assert!((g - w).abs() < 1e-9 * (1.0 + w.abs()), "{got:?} {want:?}");
        }
        let energy = system.energy(&q, &rates) - 1.0_f64 * p.up()[2];
        prop_assert!((model.energy(&x) - energy).abs() < 1e-12 * (1.0 + energy.abs()));
    }

    /// Wheels as four point masses on a ring that really turns: rolling inertia, diametral inertia and
    /// gyroscopic torque all come from positions alone. Thin wheels bring j0 = mu/2.
    #[test]
    fn rings_of_points_are_the_wheels(
        p in parameters(), x in states(), u in prop::array::uniform2(-3.0..3.0_f64),
    ) {
        let p = SpatialParameters { mu: 0.7 * (1.0 - p.alpha), nu: 0.0, middle: 0.0, ..p };
        let p = SpatialParameters { j0: 0.5 * p.mu, ..p };
        let model = Spatial::new(p);
        let radius = (p.mu / (1.0 - p.alpha)).sqrt();
        let points = |q: &[Jet; 6]| -> Vec<Point> {
            let [arm, right, left] = bodies(&p, q);
            let mut points = vec![(p.alpha, arm)];
            for (centre, theta) in [(right, q[3]), (left, q[4])] {
                for quarter in 0..4 {
                    let angle = theta + Jet::constant(0.3 + f64::from(quarter) * std::f64::consts::FRAC_PI_2);
                    // Clockwise seen with the heading to the right: the top runs forward.
                    let ahead = radius * angle.sin();
                    points.push((
                        0.125 * (1.0 - p.alpha),
                        [centre[0] + ahead * q[2].cos(), centre[1] + ahead * q[2].sin(), centre[2] + radius * angle.cos()],
                    ));
                }
            }
            points
        };
        let system = Multibody { points: &points, spins: &[], gravity: gravity(&p) };
        let (q, rates) = coordinates(&model, &x);
        let tau: [f64; 2] = [0, 1].map(|i| u[i] - 0.5 * p.zeta * (rates[3 + i] + rates[5]));
        let applied = [0.0, 0.0, 0.0, tau[0], tau[1], tau[0] + tau[1]];
        let (want, _) = system.constrained(&q, &rates, &applied, &|q| rolling(&p, q));
        let got = model.accelerations(&x, u);
        for (g, w) in got.iter().zip(&want[3..]) {
            prop_assert!((g - w).abs() < 1e-9 * (1.0 + w.abs()), "{got:?} {want:?}");
        }
    }

    /// In a mirror along the heading, left and right change places, and every quantity across the heading changes its sign.
    #[test]
    fn left_and_right_are_mirror_images(
        p in parameters(), x in states(), u in prop::array::uniform2(-3.0..3.0_f64),
    ) {
        let mirror = |x: &SpatialState<f64>| -> SpatialState<f64> {
            [x[X], -x[Y], -x[PSI], x[THETA_L], x[THETA_R], x[PHI], x[RATE_L], x[RATE_R], x[PHI_RATE]]
        };
        let seen = Spatial::new(SpatialParameters { slope_y: -p.slope_y, ..p });
        let got = mirror(&seen.rate(&mirror(&x), [u[1], u[0]]));
        let want = Spatial::new(p).rate(&x, u);
        for (g, w) in got.iter().zip(want) {
            prop_assert!((g - w).abs() < 1e-11 * (1.0 + w.abs()), "{got:?} {want:?}");
        }
    }

    /// Power balance at any state: energy changes by the work of the torques alone.
    #[test]
    fn energy_changes_by_the_work_of_the_torques(
        p in parameters(), x in states(), u in prop::array::uniform2(-3.0..3.0_f64),
    ) {
        let model = Spatial::new(p);
        let rate = model.rate(&x, u);
        let tau = model.torques(&x, u);
        let power = tau[0] * (x[RATE_R] + x[PHI_RATE]) + tau[1] * (x[RATE_L] + x[PHI_RATE]);
        let h = 1e-5;
        let along = |t: f64| model.energy(&std::array::from_fn(|i| x[i] + t * rate[i]));
        let slope = (8.0 * (along(h) - along(-h)) - (along(2.0 * h) - along(-2.0 * h))) / (12.0 * h);
        prop_assert!((slope - power).abs() < 1e-8 * (1.0 + power.abs()), "{slope} {power}");
    }

    #[test]
    fn straight_up_the_fall_line_it_is_the_planar_vehicle(
        beta in -0.6..0.6_f64, nu in 0.0..0.2_f64, phi in -3.0..3.0_f64,
        rates in prop::array::uniform2(-3.0..3.0_f64), u in -6.0..6.0_f64,
    ) {
        let planar = PlanarParameters { beta, nu, ..PlanarParameters::thesis() };
        let spatial = Spatial::new(SpatialParameters::from_planar(&planar, 0.9, 0.02));
        let want = Planar::new(planar).accelerations(&[0.0, phi, rates[0], rates[1]], u);
        let x = [0.0, 0.0, 0.0, 0.0, 0.0, phi - beta, rates[0], rates[0], rates[1]];
        let got = spatial.accelerations(&x, [0.5 * u, 0.5 * u]);
        for (g, w) in got.iter().zip([want[0], want[0], want[1]]) {
            prop_assert!((g - w).abs() < 1e-11 * (1.0 + w.abs()), "{got:?} {want:?}");
        }
    }
}

/// A plant with a fixed step in the vehicle's own arithmetic, f32.
#[test]
fn f32_follows_f64() {
    let planar = PlanarParameters {
        beta: 0.05,
        nu: 0.058,
        ..PlanarParameters::thesis()
    };
    let p = SpatialParameters {
        slope_y: 0.03,
        ..SpatialParameters::from_planar(&planar, 0.9, 0.04)
    };
    let (wide, narrow) = (Spatial::new(p), Spatial::new(p.cast::<f32>()));
    let (mut a, mut b) = ([0.0; 9], [0.0_f32; 9]);
    for k in 0..4000 {
        let turn = if k < 2000 { 0.1 } else { -0.05 };
        a = rk4_step(&a, 0.005, |x| wide.rate(x, [0.5 + turn, 0.5 - turn]));
        b = rk4_step(&b, 0.005, |x| {
            narrow.rate(x, [0.5 + turn, 0.5 - turn].map(|u| u as f32))
        });
    }
    for (wide, narrow) in a.iter().zip(b) {
        assert!((wide - f64::from(narrow)).abs() < 1e-3, "{a:?} {b:?}");
    }
    assert!(a[THETA_R] > 5.0 && a[PSI].abs() > 0.1, "{a:?}");
}

/// Over a whole run: the three reduced equations against six coordinates and three multipliers, which
/// keep neither the heading nor the velocities on the constraints by construction.
#[test]
fn a_run_of_ten_agrees_with_the_multiplier_form() {
    let planar = PlanarParameters {
        beta: 0.04,
        nu: 0.03,
        ..PlanarParameters::thesis()
    };
    let p = SpatialParameters {
        slope_y: 0.1,
        ..SpatialParameters::from_planar(&planar, 1.0, 0.033)
    };
    let model = Spatial::new(p);
    let u = [0.7, 0.4];
    let share = 0.5 * (1.0 - p.alpha);
    let points = |q: &[Jet; 6]| -> Vec<Point> {
        let [arm, right, left] = bodies(&p, q);
        vec![(p.alpha, arm), (share, right), (share, left)]
    };
    let spins = [
        (0.5 * p.mu, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
        (0.5 * p.mu, [0.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
        (0.5 * p.nu, [0.0, 0.0, 0.0, 1.0, 0.0, 1.0]),
        (0.5 * p.nu, [0.0, 0.0, 0.0, 0.0, 1.0, 1.0]),
        (p.j0, [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
    ];
    let system = Multibody {
        points: &points,
        spins: &spins,
        gravity: gravity(&p),
    };
    let full_rate = |x: &[f64; 12]| -> [f64; 12] {
        let (q, rates): ([f64; 6], [f64; 6]) = (std::array::from_fn(|i| x[i]), std::array::from_fn(|i| x[6 + i]));
        let tau: [f64; 2] = [0, 1].map(|i| u[i] - 0.5 * p.zeta * (rates[3 + i] + rates[5]));
        let applied = [0.0, 0.0, 0.0, tau[0], tau[1], tau[0] + tau[1]];
        let (accelerations, _) = system.constrained(&q, &rates, &applied, &|q| rolling(&p, q));
        std::array::from_fn(|i| if i < 6 { rates[i] } else { accelerations[i - 6] })
    };
    let start = [0.0, 0.0, 0.3, 0.0, 0.0, 0.5, 0.8, 0.2, -0.4];
    let (q, rates) = coordinates(&model, &start);
    let mut full: [f64; 12] = std::array::from_fn(|i| if i < 6 { q[i] } else { rates[i - 6] });
    let mut reduced = start;
    for _ in 0..4000 {
        full = rk4_step(&full, 0.0025, full_rate);
        reduced = rk4_step(&reduced, 0.0025, |x| model.rate(x, u));
    }
    let (q, rates) = coordinates(&model, &reduced);
    for i in 0..6 {
        assert!(
            (full[i] - q[i]).abs() < 1e-9 && (full[6 + i] - rates[i]).abs() < 1e-9,
            "{i} {full:?} {q:?}"
        );
    }
    assert!(q[X].hypot(q[Y]) > 2.0 && (q[2] - 0.3).abs() > 0.5, "{q:?}");
}

/// Erratum E24: what the thin wheels' own yaw inertia adds at mu = 0.066, s = 1.
#[test]
fn thin_wheels_add_a_third_to_the_yaw_inertia_that_the_thesis_has() {
    let p = PlanarParameters::<f64>::thesis();
    let j0 = 0.5 * p.mu;
    let (masses, effective) = (1.0 - p.alpha, 1.0 - p.alpha + p.mu);
    assert!((j0 - 0.033).abs() < 1e-15 && (j0 / masses - 0.33).abs() < 5e-3 && (j0 / effective - 0.20).abs() < 5e-3);
    // When the vehicle spins with its arm hanging, the yaw acceleration falls by exactly that share.
    let spin = |j0: f64| {
        let flat = PlanarParameters { beta: 0.0, ..p };
        let model = Spatial::new(SpatialParameters::from_planar(&flat, 1.0, j0));
        model.quasi_accelerations(&[0.0; 9], [0.1, -0.1])[1]
    };
    assert!((spin(0.0) / spin(j0) - (1.0 + j0 / effective)).abs() < 1e-12);
}
