//! Tests of the landing law.

use proptest::prelude::*;

use super::super::limits::CURRENT_SHARE;
use super::*;
use crate::vehicle::test_vehicle::reference;

/// From the barrier on, and that lies before `phi_max_rad`, a swing outward is stopped with all that the motors give,
/// also beyond grip; where there is room left, grip goes first.
#[test]
fn the_motors_stop_the_arm_before_its_largest_angle() {
    let vehicle = reference();
    let (p, scales) = (vehicle.parameters(), vehicle.scales());
    let motor = &p.drive_motor;
    let all_n_m = 2.0 * motor.current_limit_a * motor.torque_constant_n_m_per_a * motor.gear_ratio * CURRENT_SHARE;
    let all_v = scales.voltage_to_si(all_n_m / scales.torque_n_m);
    for way in [1.0, -1.0] {
        let braking_v = |phi: f32| {
            let input = SpeedInput {
                target_m_s: 0.0,
                phi_rad: way * phi,
                phi_sin_cos: libm::sincosf(way * phi),
                theta_rate_rad_s: 0.0,
                phi_rate_rad_s: way,
                slope_sin_cos: (0.0, 1.0),
                slope_turn_per_s: 0.0,
                turns: false,
                distance_m: 0.0,
                sliding_over_m_s: None,
                voltage_max_v: 1e6,
            };
            let output = LandingLaw::new(&vehicle, 0.001).step(&input);
            -way * (output.voltage_v - output.terms.feed_forward_v - output.terms.friction_v)
        };
        let before = braking_v(p.safety.phi_max_rad - 0.04);
        assert!((before / all_v - 1.0).abs() < 1e-4, "{before} V of {all_v} V");
        let inside = braking_v(p.safety.phi_max_rad - 0.5);
        assert!(inside < 0.9 * all_v, "{inside} V of {all_v} V");
    }
}

proptest! {
    /// The terms add up to the voltage before its limit, in the first tick and after the observers have moved.
    #[test]
    fn the_terms_sum_to_the_voltage_before_its_limit(
        target_m_s in -3.0_f32..3.0, phi_rad in -1.2_f32..1.2, theta_rate_rad_s in -12.0_f32..12.0,
        phi_rate_rad_s in -6.0_f32..6.0, sin_slope in -0.3_f32..0.3, ticks in 1_usize..400,
    ) {
        let mut law = LandingLaw::new(&reference(), 0.001);
        let mut input = SpeedInput {
            target_m_s, phi_rad, phi_sin_cos: libm::sincosf(phi_rad), theta_rate_rad_s, phi_rate_rad_s,
            slope_sin_cos: (sin_slope, square_root::sqrtf(1.0 - sin_slope * sin_slope)), slope_turn_per_s: 0.0, turns: false,
            distance_m: 0.0, sliding_over_m_s: None, voltage_max_v: 1e6,
        };
        for _ in 1..ticks {
            law.step(&input);
        }
        let free = law.step(&input);
        let terms = free.terms;
        let size: f32 = terms.voltages_v().iter().map(|term| term.abs()).sum();
        prop_assert!((terms.sum_v() - free.voltage_v).abs() <= 1e-5 * (1.0 + size), "{terms:?} {}", free.voltage_v);
        input.voltage_max_v = 3.0;
        prop_assert!(law.step(&input).voltage_v.abs() <= 3.0);
    }
}

/// An input at rest on a slope.
fn at_rest(sin_slope: f32, target_m_s: f32) -> SpeedInput {
    SpeedInput {
        target_m_s,
        phi_rad: 0.0,
        phi_sin_cos: (0.0, 1.0),
        theta_rate_rad_s: 0.0,
        phi_rate_rad_s: 0.0,
        slope_sin_cos: (sin_slope, square_root::sqrtf(1.0 - sin_slope * sin_slope)),
        slope_turn_per_s: 0.0,
        turns: false,
        distance_m: 0.0,
        sliding_over_m_s: None,
        voltage_max_v: 24.0,
    }
}

#[test]
fn beyond_the_slopes_limit_no_command_leads_further_up() {
    let target = |sin_slope: f32, target_m_s: f32| {
        let mut law = LandingLaw::new(&reference(), 0.001);
        let input = at_rest(sin_slope, target_m_s);
        law.step(&input);
        let voltage_max = law.scales.voltage_from_si(input.voltage_max_v);
        let wheel_rate = law.rate_observer.wheel_rate();
        let target = law.target(&input, sin_slope, voltage_max, wheel_rate);
        (law.slope_limited(), target * law.scales.speed_m_s)
    };
    for way in [1.0, -1.0] {
        assert_eq!(target(0.62 * way, way), (true, 0.0), "uphill");
        for (sin_slope, target_m_s, limited) in [(0.62, -1.0, true), (0.1, 1.0, false), (0.1, -1.0, false)] {
            let (is_limited, found_m_s) = target(sin_slope * way, target_m_s * way);
            assert_eq!(is_limited, limited);
            assert!((found_m_s - target_m_s * way).abs() < 1e-5, "{found_m_s} m/s");
        }
    }
}

#[test]
fn the_speed_stays_below_what_the_supply_can_keep() {
    let vehicle = reference();
    let (scales, zeta) = (vehicle.scales(), vehicle.planar(0.0).zeta);
    let wheel_radius_m = vehicle.parameters().body.wheel_radius_m;
    for voltage_max_v in [6.0, 9.0] {
        let keeps_m_s = scales.voltage_from_si(voltage_max_v) / zeta * scales.speed_m_s;
        assert!(keeps_m_s < vehicle.parameters().control.speed_max_m_s, "{keeps_m_s}");
        let mut law = LandingLaw::new(&vehicle, 0.001);
        // The wheels follow the reference.
        for _ in 0..10_000 {
            let mut input = at_rest(0.0, 10.0);
            input.theta_rate_rad_s = law.reference_m_s() / wheel_radius_m;
            input.voltage_max_v = voltage_max_v;
            law.step(&input);
        }
        let found = law.reference_m_s();
        assert!(
            found > 0.5 * keeps_m_s && found < keeps_m_s,
            "{found} of {keeps_m_s} m/s"
        );
    }
}
