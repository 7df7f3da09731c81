//! Whether something blocks the vehicle: it is told to drive, and its wheels do not turn.
//!
//! Against a wall the forces balance as on a steep hill, and no sensor tells the two apart. What does is that the ground
//! under the wheels cannot change its slope while they stand: the slope of the moment in which the vehicle got stuck
//! stays right until it has moved on.

/// Watches for an obstacle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stall {
    stuck_ticks: u16,
    /// Where the vehicle got stuck, once it has for long enough, m.
    stuck_at_m: Option<f32>,
    told: bool,
}

/// What one tick changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// The vehicle goes where it is told.
    Free,
    /// The wheels have just stopped turning, or not begun to.
    Hesitates,
    /// Something blocks the vehicle.
    Stuck,
}

/// Reference below which the vehicle is not told to drive, m/s.
const TOLD_M_S: f32 = 0.05;
/// Share of the reference below which the wheels do not turn.
const MOVES_SHARE: f32 = 0.15;
/// Ticks for which the wheels must not turn: longer than the arm takes to swing out at a start.
const STUCK_TICKS: u16 = 700;
/// Distance from the obstacle after which the vehicle is free of it, m.
const FREE_M: f32 = 0.04;

impl Stall {
    /// Takes one tick: the governed reference and the speed of the wheels, m/s, and the distance driven, m.
    pub fn update(&mut self, reference_m_s: f32, speed_m_s: f32, distance_m: f32) -> Progress {
        let told = reference_m_s.abs() > TOLD_M_S;
        let ahead_m_s = if reference_m_s < 0.0 { -speed_m_s } else { speed_m_s };
        let stands = told && ahead_m_s < MOVES_SHARE * reference_m_s.abs();
        self.stuck_ticks = if stands { self.stuck_ticks.saturating_add(1) } else { 0 };
        self.told = told;
        if self.stuck_at_m.is_none() && self.stuck_ticks >= STUCK_TICKS {
            self.stuck_at_m = Some(distance_m);
        }
        if self.stuck_at_m.is_some_and(|at_m| (distance_m - at_m).abs() > FREE_M) {
            self.stuck_at_m = None;
            self.stuck_ticks = 0;
        }
        if self.stuck_at_m.is_some() {
            Progress::Stuck
        } else if stands {
            Progress::Hesitates
        } else {
            Progress::Free
        }
    }

    /// Forgets the obstacle.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// The vehicle is stuck and told to drive all the same.
    pub fn stalls(&self) -> bool {
        self.told && self.stuck_at_m.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_stuck_until_it_has_moved_away() {
        for reference in [0.1_f32, -0.3, 2.5] {
            let mut stall = Stall::default();
            for k in 1..STUCK_TICKS {
                assert_eq!(stall.update(reference, 0.0, 1.0), Progress::Hesitates, "{k}");
            }
            assert_eq!(stall.update(reference, 0.0, 1.0), Progress::Stuck);
            assert!(stall.stalls());
            // Told to stop, the vehicle stalls no more, but the obstacle is still there.
            for _ in 0..5000 {
                assert_eq!(stall.update(0.0, 0.0, 1.0), Progress::Stuck);
                assert!(!stall.stalls());
            }
            assert_eq!(stall.update(-reference, -0.2 * reference, 0.97), Progress::Stuck);
            assert_eq!(stall.update(-reference, -0.2 * reference, 0.95), Progress::Free);
        }
    }

    #[test]
    fn a_vehicle_that_follows_its_command_late_does_not_stall() {
        let mut stall = Stall::default();
        for k in 0..5000_u16 {
            let reference = (f32::from(k) * 0.0008).min(1.0);
            let speed = (f32::from(k.saturating_sub(600)) * 0.0008).min(1.0);
            assert_ne!(stall.update(reference, speed, 0.0), Progress::Stuck);
        }
        assert_eq!(stall.update(0.0, 0.0, 0.0), Progress::Free);
    }
}
