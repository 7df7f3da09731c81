//! Compares the bodies with the corrected equations of ch. 6.

use model::dynamics::spatial::{self, Spatial, SpatialParameters};

use super::*;

/// Mass that holds whatever has it upright, kg m^2: the torques of this vehicle turn it by less than 1e-7 rad in seconds.
const HELD_KG_M2: f64 = 1e9;

/// Drives `body` on a plane inclined both ways and the equations of `p`, in which the whole vehicle has `mass` times the mass of
/// wheels and arm, with the same voltages of the motors; compares them after 3 s.
fn turns_as_the_spatial_vehicle(vehicle: &Vehicle<f64>, prepare: impl Fn(&mut Body), mass: f64) {
    let p = &vehicle.parameters().body;
    let (slope_x, slope_y) = (0.06, 0.04);
    let ground = ground(slope_x, slope_y, 5.0, p.wheel_radius_m);
    let mut body = Body::new(vehicle, &ground);
    prepare(&mut body);
    let planar: PlanarParameters<f64> = vehicle.planar(0.0);
    let mass_length2 = p.total_mass_kg * p.wheel_radius_m * p.wheel_radius_m;
    let reference = SpatialParameters {
        slope_x,
        slope_y,
        ..SpatialParameters::from_planar(
            &planar,
            p.half_track_m / p.wheel_radius_m,
            p.yaw_inertia_kg_m2 / mass_length2,
        )
    };
    let reference = Spatial::new(reference.carrying(mass));
    let scales = vehicle.scales();
    let (right, left) = (9.0, 6.0);
    let u = [right, left].map(|volts| 0.5 * scales.voltage_from_si(volts) / mass);
    let joints = [motor(vehicle, left), motor(vehicle, right), NO_TORQUE[2]];
    let mut x = [0.0; 9];
    x[spatial::PHI] = body.position()[PHI];
    let h = 1e-4;
    for _ in 0..30_000 {
        body.step(h, &ground, &joints);
        x = rk4_step(&x, h / scales.time_s, |x| reference.rate(x, u));
    }
    let (q, v) = (body.position(), body.speed());
    let r = p.wheel_radius_m;
    let found = [
        q[FORWARD] / r,
        q[SIDE] / r,
        q[YAW],
        q[RIGHT],
        q[LEFT],
        q[PHI],
        scales.rate_from_si(v[RIGHT]),
        scales.rate_from_si(v[LEFT]),
        scales.rate_from_si(v[PHI]),
    ];
    for (i, (found, expected)) in found.iter().zip(&x).enumerate() {
        // Creep of the regularised contact and steps of 1e-4 s over 3 s.
        assert!((found - expected).abs() < 3e-4, "state {i}: {found} against {expected}");
    }
    assert!(
        x[spatial::PSI] > 0.5 && x[spatial::Y] > 2.0,
        "the vehicle hardly turns or drives: {x:?}"
    );
    let [left, right] = *body.wheels();
    assert!(!right.sliding && !left.sliding);
    // Total normal force of a body that hardly accelerates, within a few percent.
    let weight = mass * p.total_mass_kg * body.gravity().normal;
    assert!((right.normal_n + left.normal_n - weight).abs() < 0.05 * weight);
}

#[test]
fn turning_on_a_two_way_slope_it_is_the_spatial_vehicle() {
    turns_as_the_spatial_vehicle(&bare_vehicle(), |_| (), 1.0);
}

/// The spar and its ballast, held upright on the plane, move with the axle, and have no lever about the axis of yaw.
#[test]
fn with_its_spar_held_upright_it_is_the_spatial_vehicle_with_a_mass_over_its_axle() {
    let vehicle = reference_vehicle();
    let mass = 1.0 + vehicle.spar_mass_ratio();
    assert!(mass > 1.2);
    let held = |body: &mut Body| {
        for angle in [SPAR, BALLAST] {
            body.position[angle] = 0.0;
        }
        body.inertia.spar_second = HELD_KG_M2;
        body.inertia.ballast_second = HELD_KG_M2;
        // The bearing, pivoted on the arm, would drag at it.
        body.inertia.spar_damping = 0.0;
    };
    turns_as_the_spatial_vehicle(&vehicle, held, mass);
}
