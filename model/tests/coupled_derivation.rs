//! The closed forms of the camera spar and of the coupled vehicle against point masses.
mod multibody;

use model::dynamics::camera::{Camera, CameraParameters};
use model::dynamics::coupled::{Bearing, Coupled, CoupledParameters};
use model::dynamics::planar::{Planar, PlanarParameters};
use multibody::{Jet, Multibody, Point};
use proptest::prelude::*;

/// The spar's three masses about a pivot, at an angle from the vertical and a ballast angle.
fn spar(pivot: [Jet; 3], lengths: [f64; 3], masses: [f64; 3], spar: Jet, ballast: Jet) -> Vec<Point> {
    let hang = |from: [Jet; 3], length: f64, angle: Jet| {
        [from[0] + length * angle.sin(), from[1] - length * angle.cos(), from[2]]
    };
    let motor = hang(pivot, lengths[1], spar);
    let weight = hang(motor, lengths[2], spar + ballast);
    let camera = hang(pivot, -lengths[0], spar);
    vec![(masses[0], camera), (masses[1], motor), (masses[2], weight)]
}

proptest! {
    #[test]
    fn camera_equals_point_masses(
        lm in 0.05..0.6_f64, lr in 0.05..0.6_f64, mm in 0.0..5.0_f64, mr in 0.2..6.0_f64,
        q in prop::array::uniform4(-3.0..3.0_f64), v in -20.0..20.0_f64,
        base in prop::array::uniform2(-0.8..0.8_f64),
    ) {
        let parameters = CameraParameters { lm, lr, mm, mr, zeta: 0.31, xi: 1.7 };
        let got = Camera::new(parameters).accelerations(&q, v, base);
        // An accelerating base acts as gravity less the acceleration of the base.
        let points = |x: &[Jet; 2]| spar([Jet::constant(0.0); 3], [1.0, lm, lr], [1.0, mm, mr], x[0], x[1]);
        let system = Multibody { points: &points, spins: &[], gravity: [-base[0], -1.0 - base[1], 0.0] };
        let want = system.accelerations(
            &[q[0], q[1]], &[q[2], q[3]], &[-parameters.zeta * q[2], v - parameters.xi * q[3]]);
        for (g, w) in got.iter().zip(want) {
            prop_assert!((g - w).abs() < 1e-9 * (1.0 + w.abs()), "{got:?} {want:?}");
        }
    }

    #[test]
    fn coupled_equals_point_masses(
        l in 0.3..1.3_f64, alpha in 0.3..0.95_f64, mu in 0.0..0.3_f64, nu in 0.0..0.2_f64, beta in -0.6..0.6_f64,
        lp in 0.4..2.0_f64, kc in 0.01..0.5_f64, q in prop::array::uniform8(-3.0..3.0_f64),
        u in -6.0..6.0_f64, v in -2.0..2.0_f64, which in 0..3_usize,
    ) {
        let planar = PlanarParameters { l, alpha, zeta: 1.9, mu, nu, beta };
        let camera = CameraParameters { lm: 0.21, lr: 0.13, mm: 2.0, mr: 5.0, zeta: 0.4, xi: 1.3 };
        let bearing = [Bearing::Inertial, Bearing::Arm, Bearing::Axle][which];
        let p = CoupledParameters::with_camera(planar, &camera, lp, kc, bearing);
        let model = Coupled::new(p);
        let got = model.accelerations(&q, u, v);
        let (sin, cos) = beta.sin_cos();
        let points = |x: &[Jet; 4]| {
            let axle = [cos * x[0], sin * x[0], Jet::constant(0.0)];
            let arm = [axle[0] + l * x[1].sin(), axle[1] - l * x[1].cos(), axle[2]];
            let mut points = vec![(1.0 - alpha, axle), (alpha, arm)];
            points.extend(spar(axle, [p.lp, p.lm, p.lr], [p.kc, p.km, p.kr], x[2], x[3]));
            points
        };
        let system = Multibody {
            points: &points,
            spins: &[(mu, [1.0, 0.0, 0.0, 0.0]), (nu, [1.0, 1.0, 0.0, 0.0])],
            gravity: [0.0, -1.0, 0.0],
        };
        let [place, rates]: [[f64; 4]; 2] = [std::array::from_fn(|i| q[i]), std::array::from_fn(|i| q[4 + i])];
        let tau = u - planar.zeta * (rates[0] + rates[1]);
        // The damper's torque acts on the bearing's relative turn. It is the gradient of the dissipation function.
        let turn = [[0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 1.0, 0.0], [1.0, 0.0, 1.0, 0.0]][which];
        let relative: f64 = (0..4).map(|i| turn[i] * rates[i]).sum();
        let motors = [tau, tau, 0.0, v - p.xi_c * rates[3]];
        let applied = std::array::from_fn(|i| motors[i] - p.zeta_c * relative * turn[i]);
        let want = system.accelerations(&place, &rates, &applied);
        for (g, w) in got.iter().zip(want) {
            prop_assert!((g - w).abs() < 1e-9 * (1.0 + w.abs()), "{got:?} {want:?}");
        }
        let energy = system.energy(&place, &rates);
        prop_assert!((model.energy(&q) - energy).abs() < 1e-12 * (1.0 + energy.abs()));
        prop_assert!((model.bearing_rate(&q) - relative).abs() < 1e-14);
    }

    #[test]
    fn without_a_spar_the_vehicle_is_the_planar_one(
        beta in -0.6..0.6_f64, nu in 0.0..0.2_f64, q in prop::array::uniform8(-2.0..2.0_f64), u in -6.0..6.0_f64,
    ) {
        let planar = PlanarParameters { beta, nu, ..PlanarParameters::thesis() };
        let p = CoupledParameters::with_camera(planar, &CameraParameters::thesis(), 1.0, 1e-12, Bearing::Arm);
        let got = Coupled::new(p).accelerations(&q, u, 0.0);
        let want = Planar::new(planar).accelerations(&[q[0], q[1], q[4], q[5]], u);
        prop_assert!((got[0] - want[0]).abs() < 1e-8 && (got[1] - want[1]).abs() < 1e-8);
    }

    #[test]
    fn the_spar_on_the_vehicle_is_the_spar_of_chapter_7_scaled(
        lp in 0.4..2.0_f64, kc in 0.01..0.5_f64, q in prop::array::uniform8(-2.0..2.0_f64), v7 in -9.0..9.0_f64,
    ) {
        // Equal accelerations of the axle; time runs sqrt(lp) times slower in ch. 7's units.
        let camera = CameraParameters::thesis();
        let planar = PlanarParameters::thesis();
        let p = CoupledParameters::with_camera(planar, &camera, lp, kc, Bearing::Inertial);
        let v8 = kc * lp * v7;
        let a = Coupled::new(p).accelerations(&q, 0.7, v8);
        let slow = lp.sqrt();
        let base = [a[0] * planar.beta.cos(), a[0] * planar.beta.sin()];
        let b = Camera::new(camera).accelerations(&[q[2], q[3], slow * q[6], slow * q[7]], v7, base);
        for (coupled, alone) in [(a[2], b[0]), (a[3], b[1])] {
            prop_assert!((coupled * lp - alone).abs() < 1e-8 * (1.0 + alone.abs()), "{a:?} {b:?}");
        }
        // The same law, evaluated in either system of units.
        let gains = [-92.0, 6.8, -49.0, -6.5];
        let [g8, x7, x8] = [p.gains_in_vehicle_units(gains), [q[2], q[3], slow * q[6], slow * q[7]], [q[2], q[3], q[6], q[7]]];
        let dot = |g: [f64; 4], x: [f64; 4]| -> f64 { (0..4).map(|i| g[i] * x[i]).sum() };
        prop_assert!((dot(g8, x8) - kc * lp * dot(gains, x7)).abs() < 1e-11);
    }

    /// In a mirror, a drive uphill is a backward drive downhill.
    #[test]
    fn the_coupled_vehicle_has_a_mirror_image(
        beta in -0.6..0.6_f64, nu in 0.0..0.2_f64, kc in 0.01..0.5_f64, q in prop::array::uniform8(-3.0..3.0_f64),
        u in -6.0..6.0_f64, v in -2.0..2.0_f64, which in 0..3_usize,
    ) {
        let bearing = [Bearing::Inertial, Bearing::Arm, Bearing::Axle][which];
        let on = |beta| {
            let planar = PlanarParameters { beta, nu, ..PlanarParameters::thesis() };
            Coupled::new(CoupledParameters::with_camera(planar, &CameraParameters::thesis(), 1.3, kc, bearing))
        };
        let got = on(-beta).rate(&q.map(|x| -x), -u, -v);
        let want = on(beta).rate(&q, u, v);
        for (g, w) in got.iter().zip(want) {
            prop_assert!((g + w).abs() < 1e-10 * (1.0 + w.abs()), "{got:?} {want:?}");
        }
    }
}
