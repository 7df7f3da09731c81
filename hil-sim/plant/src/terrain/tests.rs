//! Compares the loci with a circle that is rolled over the profile numerically.

use super::*;

const RADIUS: f64 = 0.25;

fn ground(profile: Vec<Feature>) -> Ground {
    let terrain = Terrain::new(Plane::default(), Friction::default(), vec![], profile).unwrap();
    Ground::new(terrain, RADIUS).unwrap()
}

/// Height of the centre of a circle that rests on `profile`: the highest support over its width.
fn rolled(profile: impl Fn(f64) -> f64, x: f64) -> f64 {
    let n = 200_000;
    (0..=n)
        .map(|k| {
            let offset = RADIUS * (2.0 * f64::from(k) / f64::from(n) - 1.0);
            profile(x + offset) + (RADIUS * RADIUS - offset * offset).sqrt() - RADIUS
        })
        .fold(f64::NEG_INFINITY, f64::max)
}

/// Compares a locus with the rolled circle, and the locus's slope with its height.
fn agrees(ground: &Ground, profile: impl Fn(f64) -> f64 + Copy, places: &[f64]) {
    for &x in places {
        let path = ground.wheel(x);
        let expected = rolled(profile, x);
        assert!(
            (path.height_m - expected).abs() < 2e-6,
            "at {x}: {} against {expected}",
            path.height_m
        );
        let e = 1e-6;
        let slope = (ground.wheel(x + e).height_m - ground.wheel(x - e).height_m) / (2.0 * e);
        assert!(
            (path.slope - slope).abs() < 1e-5,
            "slope at {x}: {} against {slope}",
            path.slope
        );
    }
}

#[test]
fn a_wheel_rolls_over_a_kerb_on_the_circle_about_its_edge() {
    let up = ground(vec![Feature::Edge {
        at_m: 1.0,
        height_m: 0.075,
    }]);
    let profile = |x: f64| if x >= 1.0 { 0.075 } else { 0.0 };
    agrees(&up, profile, &[0.5, 0.8, 0.83, 0.9, 0.99, 1.01, 1.5]);
    let down = ground(vec![Feature::Edge {
        at_m: 1.0,
        height_m: -0.05,
    }]);
    let profile = |x: f64| if x > 1.0 { -0.05 } else { 0.0 };
    agrees(&down, profile, &[0.5, 0.99, 1.01, 1.1, 1.14, 1.16, 1.5]);
}

#[test]
fn a_wheel_dips_into_a_joint_and_nowhere_else() {
    let joints = ground(vec![Feature::Joints {
        from_m: 1.0,
        rail_length_m: 2.0,
        gap_m: 0.02,
        count: 3,
    }]);
    let profile = |x: f64| {
        let gap = [1.0, 3.0, 5.0].iter().any(|at| (x - at).abs() < 0.01);
        if gap { -1.0 } else { 0.0 }
    };
    agrees(&joints, profile, &[0.98, 0.995, 1.004, 2.0, 2.995, 5.003, 7.0]);
    // Sagitta of the gap's half width.
    let depth = RADIUS - (RADIUS * RADIUS - 1e-4_f64).sqrt();
    assert!((joints.wheel(3.0).height_m + depth).abs() < 1e-15);
    assert_eq!(joints.wheel(7.0), WheelPath::default(), "three joints, no fourth");
    assert_eq!(joints.wheel(-1.0), WheelPath::default());
}

#[test]
fn smooth_features_give_their_parallel_curve() {
    let sine = ground(vec![Feature::Sine {
        from_m: 0.5,
        wavelength_m: 2.0,
        height_m: 0.1,
        waves: 2,
    }]);
    let profile = |x: f64| {
        if (0.5..4.5).contains(&x) {
            0.05 * (1.0 - (core::f64::consts::PI * (x - 0.5)).cos())
        } else {
            0.0
        }
    };
    agrees(&sine, profile, &[0.2, 0.6, 1.0, 1.5, 2.0, 2.5, 3.3, 4.4, 5.0]);
    let ramp = ground(vec![Feature::Ramp {
        from_m: 1.0,
        length_m: 4.0,
        slope_rad: 0.2,
        transition_m: 0.5,
    }]);
    let top = 0.2_f64.tan() * 3.5;
    assert!((ramp.wheel(6.0).height_m - top).abs() < 1e-12);
    assert!((ramp.wheel(3.0).slope - 0.2_f64.tan()).abs() < 1e-12);
    assert_eq!(ramp.wheel(0.9).height_m, 0.0);
    // The profile itself by integrating its slope, a smooth step in and out.
    let smooth = |s: f64| s * s * (3.0 - 2.0 * s);
    let slope = |x: f64| {
        let x = x - 1.0;
        0.2_f64.tan() * smooth((x / 0.5).clamp(0.0, 1.0)) * smooth(((4.0 - x) / 0.5).clamp(0.0, 1.0))
    };
    let n = 60_000;
    let mut heights = vec![0.0; n + 1];
    let h = 6.0 / n as f64;
    for k in 0..n {
        heights[k + 1] = heights[k] + h * slope((k as f64 + 0.5) * h);
    }
    let profile = |x: f64| heights[((x / h).round() as usize).min(n)];
    for x in [1.2, 1.4, 2.0, 4.6, 4.8] {
        let (found, expected) = (ramp.wheel(x).height_m, rolled(profile, x));
        assert!((found - expected).abs() < 3e-5, "at {x}: {found} against {expected}");
    }
}

#[test]
fn up_is_as_the_thesis_has_it() {
    let plane = Plane {
        slope_x_rad: 0.2,
        slope_y_rad: 0.1,
    };
    let terrain = Terrain::new(plane, Friction::default(), vec![], vec![]).unwrap();
    let up = Ground::new(terrain, RADIUS).unwrap().up_m_s2();
    let g = GRAVITY_M_S2;
    let (b, c) = (0.2_f64, 0.1_f64);
    let expected = [b.sin(), -c.sin() * b.cos(), c.cos() * b.cos()].map(|n| g * n);
    for (u, e) in up.iter().zip(expected) {
        assert!((u - e).abs() < 1e-14);
    }
    let length = up.iter().map(|u| u * u).sum::<f64>().sqrt();
    assert!((length - g).abs() < 1e-12);
}

#[test]
fn the_last_patch_that_covers_a_place_wins() {
    let patch = |from_m, to_m, left, right| Patch {
        from_m,
        to_m,
        left,
        right,
    };
    let patches = vec![patch(0.0, 10.0, 0.4, 0.5), patch(2.0, 3.0, 0.2, 0.1)];
    let terrain = Terrain::new(Plane::default(), Friction::default(), patches, vec![]).unwrap();
    let at = |x| {
        let f = terrain.friction_at(x);
        (f.left, f.right)
    };
    assert_eq!(at(-0.1), (0.8, 0.8));
    assert_eq!(at(1.0), (0.4, 0.5));
    assert_eq!(at(2.0), (0.2, 0.1));
    assert_eq!(at(3.0), (0.4, 0.5));
    assert_eq!(at(10.0), (0.8, 0.8));
}

#[test]
fn bad_terrains_are_refused_with_the_field_and_what_is_allowed() {
    let refused = |text: &str| toml::from_str::<Terrain>(text).unwrap_err().to_string();
    let message = refused("[plane]\nslope_x_rad = nan");
    assert!(
        message.contains("plane.slope_x_rad = NaN: allowed is -1.2 to 1.2"),
        "{message}"
    );
    let message = refused("[plane]\nslope = 0.1");
    assert!(message.contains("unknown field `slope`"), "{message}");
    let message = refused("[[patch]]\nfrom_m = 2.0\nto_m = 1.0\nleft = 0.1\nright = 0.1");
    assert!(
        message.contains("patch[0]: to_m = 1 must be greater than from_m = 2"),
        "{message}"
    );
    let message = refused("[[profile]]\nkind = \"wall\"");
    assert!(message.contains("unknown variant `wall`"), "{message}");
    let message = refused("[[profile]]\nkind = \"sine\"\nfrom_m = 0.0\nwavelength_m = -1.0\nheight_m = 0.1\nwaves = 1");
    assert!(message.contains("profile[0].wavelength_m = -1"), "{message}");
    let message = refused("[[profile]]\nkind = \"step\"\nat_m = 1.0");
    assert!(message.contains("profile[0].height_m is missing"), "{message}");
    let message = refused("[[profile]]\nkind = \"step\"\nat_m = 1.0\nheight_m = 0.01\nwaves = 2");
    assert!(
        message.contains("profile[0].waves: a feature of this kind"),
        "{message}"
    );
    let message = refused("[friction]\nleft = -0.1");
    assert!(message.contains("friction.left = -0.1: allowed is 0 to 5"), "{message}");

    // Checks that depend on the wheel are made when the wheel is known.
    let of = |text: &str| {
        Ground::new(toml::from_str(text).unwrap(), RADIUS)
            .unwrap_err()
            .to_string()
    };
    let message = of("[[profile]]\nkind = \"step\"\nat_m = 1.0\nheight_m = 0.08");
    assert!(
        message.contains("profile[0].height_m = 0.08: allowed is -0.075 to 0.075 for wheels of 0.25 m radius"),
        "{message}"
    );
    let message = of("[[profile]]\nkind = \"sine\"\nfrom_m = 0.0\nwavelength_m = 0.5\nheight_m = 0.1\nwaves = 1");
    assert!(
        message.contains("sharpest hollow has radius 0.1267 m, the wheel 0.25 m"),
        "{message}"
    );
}
