//! Dead reckoning on the plane: (6.12) and (6.15), with the heading from gyro and wheels.

/// Position on the plane in m, from the start: x along the first heading, y to its left.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(clippy::struct_field_names)] // Every field is a length.
pub struct Odometry {
    x_m: f32,
    y_m: f32,
    /// Rounding error of the last additions (Kahan): in f32 a millisecond's advance is small
    /// against a kilometre.
    carry_x_m: f32,
    carry_y_m: f32,
    distance_m: f32,
    carry_distance_m: f32,
}

impl Odometry {
    /// Advances by the axle's travel `advance_m` at `heading_rad` (the mean over the advance), and by `left_m` to the left of it,
    /// which only wheels that slide do.
    ///
    /// ```
    /// use model::estimate::odometry::Odometry;
    /// let mut odometry = Odometry::default();
    /// // A quarter turn to the left on a circle of 1 m.
    /// for k in 0..1000 {
    ///     let heading = (k as f32 + 0.5) / 1000.0 * core::f32::consts::FRAC_PI_2;
    ///     odometry.advance(core::f32::consts::FRAC_PI_2 / 1000.0, 0.0, heading);
    /// }
    /// assert!((odometry.x_m() - 1.0).abs() < 1e-5 && (odometry.y_m() - 1.0).abs() < 1e-5);
    /// ```
    pub fn advance(&mut self, advance_m: f32, left_m: f32, heading_rad: f32) {
        let (sin, cos) = libm::sincosf(heading_rad);
        add(&mut self.x_m, &mut self.carry_x_m, advance_m * cos - left_m * sin);
        add(&mut self.y_m, &mut self.carry_y_m, advance_m * sin + left_m * cos);
        add(&mut self.distance_m, &mut self.carry_distance_m, advance_m);
    }

    /// Position along the first heading.
    pub fn x_m(&self) -> f32 {
        self.x_m
    }

    /// Position to the left of the first heading.
    pub fn y_m(&self) -> f32 {
        self.y_m
    }

    /// Distance driven, forward positive.
    pub fn distance_m(&self) -> f32 {
        self.distance_m
    }
}

/// Adds with Kahan's compensation.
fn add(sum: &mut f32, carry: &mut f32, term: f32) {
    let term = term - *carry;
    let next = *sum + term;
    *carry = (next - *sum) - term;
    *sum = next;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kilometre_in_millimetres_is_a_kilometre() {
        let mut odometry = Odometry::default();
        for _ in 0..1_000_000 {
            odometry.advance(0.001, 0.0, 0.0);
        }
        assert!((odometry.x_m() - 1000.0).abs() < 0.002, "{}", odometry.x_m());
        assert!((odometry.distance_m() - 1000.0).abs() < 0.002);
        assert_eq!(odometry.y_m(), 0.0);
    }
}
