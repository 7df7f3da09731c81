//! The ground's surface for the side view, from the path of a wheel's centre over it.

use plant::terrain::Ground;

/// Points of the outline.
pub const POINTS: usize = 121;
/// Length of the outline ahead of the axle and behind it, in radii.
const REACH: f64 = 6.0;
/// Positions of the wheel that may touch a point of the surface, on either side.
const PLACES: i32 = 24;

/// Heights of the surface above the bare plane at [`POINTS`] places along the heading, m, the axle above the middle one.
/// The wheel's circle touches the surface from above, so the surface at a place is the lowest point of all circles
/// there.
pub fn outline(ground: &Ground, x_m: f64, heading_rad: f64, radius_m: f64) -> Vec<f32> {
    let along = heading_rad.cos();
    let spacing = 2.0 * REACH * radius_m / (POINTS - 1) as f64;
    (0..POINTS)
        .map(|point| {
            let ahead = (point as f64 - (POINTS / 2) as f64) * spacing;
            height(ground, x_m + ahead * along, radius_m) as f32
        })
        .collect()
}

/// Height of the surface at `x_m`.
fn height(ground: &Ground, x_m: f64, radius_m: f64) -> f64 {
    (-PLACES..=PLACES)
        .map(|place| {
            let beside = f64::from(place) / f64::from(PLACES);
            let rim = radius_m * (1.0 - (1.0 - beside * beside).max(0.0).sqrt());
            ground.wheel(x_m + beside * radius_m).height_m + rim
        })
        .fold(f64::INFINITY, f64::min)
}

/// Distance between two points of the outline, m.
pub fn spacing_m(radius_m: f64) -> f64 {
    2.0 * REACH * radius_m / (POINTS - 1) as f64
}

#[cfg(test)]
mod tests {
    use plant::terrain::{Feature, Friction, Plane, Terrain};

    use super::*;

    #[test]
    fn a_kerb_stands_where_it_is_and_the_plane_is_flat() {
        let (plane, friction) = (Plane::default(), Friction::default());
        let kerb = Feature::Edge {
            at_m: 3.0,
            height_m: 0.05,
        };
        let terrain = Terrain::new(plane, friction, Vec::new(), vec![kerb]).expect("good");
        let ground = Ground::new(terrain, 0.25).expect("good");
        assert!(height(&ground, 1.0, 0.25).abs() < 1e-9);
        assert!((height(&ground, 4.0, 0.25) - 0.05).abs() < 1e-9);
        assert!(height(&ground, 3.02, 0.25) > 0.04, "the kerb's edge is steep");
        let outline = outline(&ground, 3.0, 0.0, 0.25);
        assert_eq!(outline.len(), POINTS);
        assert!(outline[0].abs() < 1e-6 && (outline[POINTS - 1] - 0.05).abs() < 1e-6);
    }
}
