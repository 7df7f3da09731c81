//! Bounds a value without any possibility of a panic.

/// Bounds a value to a range.
///
/// `f32::clamp` panics if its bounds are out of order or NaN. `f32::min` leaves the sign of zero open, so two processors
/// may return different bits. Control code uses `bounded` instead.
pub trait Bounded {
    /// `low` for a value below the range, `high` for one above it, else the value itself; `low` if the bounds are out of
    /// order. NaN stays NaN; the check before the bridges rejects it.
    #[must_use]
    fn bounded(self, low: Self, high: Self) -> Self;
}

impl Bounded for f32 {
    #[inline]
    fn bounded(self, low: Self, high: Self) -> Self {
        // Two separate selections instead of an if-else chain: each compiles to one instruction on the host.
        let below = if self > high { high } else { self };
        if below < low { low } else { below }
    }
}

#[cfg(test)]
mod tests {
    use super::Bounded;

    #[test]
    fn it_bounds_and_never_panics() {
        assert_eq!(5.0_f32.bounded(-1.0, 1.0), 1.0);
        assert_eq!((-5.0_f32).bounded(-1.0, 1.0), -1.0);
        assert_eq!(0.5_f32.bounded(-1.0, 1.0), 0.5);
        assert!(f32::NAN.bounded(-1.0, 1.0).is_nan());
        // With bounds that are out of order or NaN, the function returns a value and does not panic.
        for value in [-2.0_f32, 0.0, 2.0] {
            assert_eq!(value.bounded(1.0, -1.0), 1.0);
        }
        assert_eq!(0.0_f32.bounded(f32::NAN, f32::NAN), 0.0);
    }
}
