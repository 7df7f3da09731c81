//! Compares the plant's shorter solution for a vehicle that rolls on a plane with the general solution.

use super::*;

#[test]
fn rolling_on_a_plane_is_solved_as_anything_else_is() {
    for vehicle in [reference_vehicle(), bare_vehicle()] {
        let ground = ground(0.02, 0.04, 0.8, 0.25);
        let mut rolling = Body::new(&vehicle, &ground);
        rolling.inertia_mut().radius_difference = 0.002;
        let mut general = rolling.clone();
        // A push without a force makes the step use the general solution.
        general.set_push(Some(Push {
            on: PushedBody::Axle,
            forward_n: 0.0,
            left_n: 0.0,
            up_n: 0.0,
        }));
        for k in 0..4000 {
            let time = 5e-4 * f64::from(k);
            let torques = [2.0 + 0.5 * libm::sin(3.0 * time), 1.8, 0.1 * libm::sin(5.0 * time)];
            let joints = torques.map(|constant_n_m| JointTorque {
                constant_n_m,
                damping_n_m_s: 0.2,
                limit_n_m: 2.4,
                coulomb_n_m: 0.05,
            });
            for body in [&mut rolling, &mut general] {
                body.step(5e-4, &ground, &joints);
            }
            for i in 0..SPEEDS {
                // The ground of the general solution yields by a tenth of a micrometre per second.
                let (found, expected) = (rolling.speed()[i], general.speed()[i]);
                assert!(
                    (found - expected).abs() < 1e-6,
                    "{time} s, speed {i}: {found}, {expected}"
                );
            }
            let normals = [&rolling, &general].map(|body| body.wheels().map(|wheel| wheel.normal_n));
            // The vehicle's 17 kg start this motion within one substep: 3 mN at each wheel.
            assert!((normals[0][0] - normals[1][0]).abs() < 4e-3, "{time} s: {normals:?}");
        }
        assert_ne!(rolling.speed(), general.speed(), "both bodies use one solution");
        assert!(rolling.position()[FORWARD] > 0.5 && rolling.position()[YAW].abs() > 0.02);
        assert!(rolling.wheels().iter().all(|wheel| !wheel.sliding));
    }
}
