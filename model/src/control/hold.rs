//! Position hold: the speed that brings the vehicle back to the place where it came to rest.

use crate::bounded::Bounded;

/// Largest speed that the hold commands, m/s.
const HOLD_SPEED_M_S: f32 = 0.15;

/// Holds the place that was captured when the vehicle came to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hold {
    gain_per_s: f32,
    place_m: Option<f32>,
}

impl Hold {
    /// A hold with the given gain: speed per metre of displacement, 1/s.
    pub fn new(gain_per_s: f32) -> Self {
        Self {
            gain_per_s,
            place_m: None,
        }
    }

    /// Forgets the place.
    pub fn release(&mut self) {
        self.place_m = None;
    }

    /// The speed that the hold commands, m/s; 0 while the vehicle is driven (`target_m_s` is not 0). `slow`
    /// means that the vehicle is slow enough for the hold to capture its place.
    pub fn speed_m_s(&mut self, target_m_s: f32, distance_m: f32, slow: bool) -> f32 {
        if target_m_s != 0.0 {
            self.place_m = None;
        } else if self.place_m.is_none() && slow {
            self.place_m = Some(distance_m);
        }
        self.place_m.map_or(0.0, |place_m| {
            (self.gain_per_s * (place_m - distance_m)).bounded(-HOLD_SPEED_M_S, HOLD_SPEED_M_S)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_captures_once_slow_and_forgets_when_driven() {
        let mut hold = Hold::new(0.4);
        assert_eq!(hold.speed_m_s(0.0, 1.0, false), 0.0);
        assert_eq!(hold.speed_m_s(0.0, 2.0, true), 0.0);
        // The captured place is now 2 m, whether the vehicle is fast or slow.
        assert!((hold.speed_m_s(0.0, 2.1, false) + 0.04).abs() < 1e-6);
        assert_eq!(hold.speed_m_s(0.0, 9.0, true), -HOLD_SPEED_M_S);
        assert_eq!(hold.speed_m_s(0.5, 9.0, true), 0.0);
        assert_eq!(hold.speed_m_s(0.0, 9.0, true), 0.0);
        hold.release();
        assert_eq!(hold.speed_m_s(0.0, 5.0, false), 0.0);
    }
}
