//! Detects wheels that stand still.

/// Wheel rate below which a wheel counts as standing, rad/s.
const REST_WHEEL_RAD_S: f32 = 0.03;

/// Distinguishes standing wheels, perhaps with a shaft on the edge of a count, from turning wheels.
///
/// On the edge of a count the counter goes back and forth by one with the slightest vibration, and a coarse encoder's
/// rate never settles: one count of 64 per turn behind a gearbox of 30 shows as 0.16 rad/s in the rate filter. A wheel
/// stands still while its counter stays within one count of where it was, or its rate is small.
///
/// ```
/// use model::estimate::stillness::Stillness;
/// let mut wheels = Stillness::default();
/// let edge = [0.16, 0.0];
/// wheels.stand([10, 0], edge);
/// assert!(wheels.stand([11, 0], edge) && wheels.stand([10, 0], edge) && wheels.stand([9, 0], edge));
/// // Two counts away the wheel has turned; from there it may stand again.
/// assert!(!wheels.stand([12, 0], edge) && wheels.stand([12, 0], edge));
/// // A fine encoder keeps counting while the wheel hardly turns.
/// assert!(wheels.stand([14, 0], [0.02, 0.0]) && !wheels.stand([16, 0], [0.04, 0.0]));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stillness {
    /// Count at which each wheel came to stand.
    anchors: [Option<i64>; 2],
}

impl Stillness {
    /// Updates the detector with the newest counts and rates of the left and the right wheel. Returns whether both
    /// wheels stand still.
    pub fn stand(&mut self, counts: [i64; 2], rates_rad_s: [f32; 2]) -> bool {
        let mut both = true;
        for ((anchor, count), rate) in self.anchors.iter_mut().zip(counts).zip(rates_rad_s) {
            let near = anchor.is_some_and(|anchor| count.wrapping_sub(anchor).unsigned_abs() <= 1);
            if !near {
                *anchor = Some(count);
            }
            both &= near || rate.abs() < REST_WHEEL_RAD_S;
        }
        both
    }
}
