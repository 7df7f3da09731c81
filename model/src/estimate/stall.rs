//! Detects an obstacle that blocks the vehicle: the vehicle is commanded to drive, but its wheels do not turn.
//!
//! Against a wall the forces balance as on a steep hill, and no sensor distinguishes the two. But the slope of the
//! ground cannot change while the wheels stand: the slope at which the vehicle got stuck stays right until the vehicle
//! has moved on. As long as the vehicle is commanded to push on, the laws may still treat the obstacle like a hill;
//! this is how the vehicle climbs a kerb.

/// Watches for an obstacle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Stall {
    stuck_ticks: u16,
    /// Place where the vehicle got stuck, once it has been stuck for long enough, m.
    stuck_at_m: Option<f32>,
    /// Whether the vehicle got stuck while driving forward.
    forward: bool,
    pushes: bool,
}

/// The command to the speed law, and the law's findings.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Intent {
    /// The commanded speed, m/s: 0 in a controlled stop.
    pub target_m_s: f32,
    /// The governed reference on its way to that speed, m/s.
    pub reference_m_s: f32,
    /// Whether the law has found that the vehicle makes no progress, for example because it bounces off an obstacle.
    pub stuck: bool,
    /// Change of the slope's sine that the law's observers found; `None` from a law without observers.
    pub slope_lesson: Option<f32>,
}

/// The result of one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// The vehicle drives as commanded.
    Free,
    /// The wheels have just stopped turning, or have not begun to turn.
    Hesitates,
    /// An obstacle blocks the vehicle.
    Stuck,
}

/// Reference below which the vehicle counts as commanded to stand, m/s.
const TOLD_M_S: f32 = 0.05;
/// Share of the reference below which the wheels count as not turning.
const MOVES_SHARE: f32 = 0.15;
/// Ticks for which the wheels must not turn: longer than the arm takes to swing out at a start.
const STUCK_TICKS: u16 = 700;
/// Distance from the obstacle at which the vehicle counts as free, m.
const FREE_M: f32 = 0.04;

impl Stall {
    /// Updates the watch with one tick: the command to the law, the speed of the wheels, m/s, and the distance driven,
    /// m.
    pub fn update(&mut self, intent: Intent, speed_m_s: f32, distance_m: f32) -> Progress {
        let Intent {
            target_m_s,
            reference_m_s,
            stuck,
            ..
        } = intent;
        let told = reference_m_s.abs() > TOLD_M_S;
        let stands = told && speed_m_s.abs() < MOVES_SHARE * reference_m_s.abs();
        self.stuck_ticks = if stands { self.stuck_ticks.saturating_add(1) } else { 0 };
        if self.stuck_at_m.is_none() && (self.stuck_ticks >= STUCK_TICKS || stuck) {
            self.stuck_at_m = Some(distance_m);
            self.forward = if stuck { target_m_s > 0.0 } else { reference_m_s > 0.0 };
        }
        if self.stuck_at_m.is_some_and(|at_m| (distance_m - at_m).abs() > FREE_M) {
            self.stuck_at_m = None;
            self.stuck_ticks = 0;
        }
        let ahead_m_s = if self.forward { target_m_s } else { -target_m_s };
        self.pushes = self.stuck_at_m.is_some() && ahead_m_s > 0.0;
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

    /// Whether an obstacle blocks the vehicle, whatever is commanded.
    pub fn is_stuck(&self) -> bool {
        self.stuck_at_m.is_some()
    }

    /// Whether the vehicle is stuck and commanded to push on.
    pub fn stalls(&self) -> bool {
        self.pushes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(speed_m_s: f32) -> Intent {
        Intent {
            target_m_s: speed_m_s,
            reference_m_s: speed_m_s,
            stuck: false,
            slope_lesson: None,
        }
    }

    #[test]
    fn it_is_stuck_until_it_has_moved_away() {
        for reference in [0.1_f32, -0.3, 2.5] {
            let mut stall = Stall::default();
            for k in 1..STUCK_TICKS {
                assert_eq!(stall.update(told(reference), 0.0, 1.0), Progress::Hesitates, "{k}");
            }
            assert_eq!(stall.update(told(reference), 0.0, 1.0), Progress::Stuck);
            assert!(stall.stalls());
            // A vehicle that is commanded to stop or to back off no longer stalls, although its reference still
            // decays. The obstacle is still there.
            for _ in 0..5000 {
                assert_eq!(stall.update(told(0.0), 0.0, 1.0), Progress::Stuck);
                assert!(!stall.stalls());
            }
            assert_eq!(stall.update(told(-reference), -0.2 * reference, 0.97), Progress::Stuck);
            assert_eq!(stall.update(told(-reference), -0.2 * reference, 0.95), Progress::Free);
        }
    }

    /// A bounce is no progress: the law's finding counts at once.
    #[test]
    fn a_vehicle_that_bounces_is_stuck_when_the_law_finds_it_so() {
        let mut stall = Stall::default();
        let bouncing = Intent {
            stuck: true,
            ..told(0.3)
        };
        assert_eq!(stall.update(told(0.3), -0.2, 1.0), Progress::Free);
        assert_eq!(stall.update(bouncing, -0.2, 1.0), Progress::Stuck);
        assert!(stall.stalls());
        assert_eq!(stall.update(told(0.3), 0.2, 1.05), Progress::Free);
    }

    #[test]
    fn a_vehicle_that_follows_its_command_late_does_not_stall() {
        let mut stall = Stall::default();
        for k in 0..5000_u16 {
            let reference = (f32::from(k) * 0.0008).min(1.0);
            let speed = (f32::from(k.saturating_sub(600)) * 0.0008).min(1.0);
            assert_ne!(stall.update(told(reference), speed, 0.0), Progress::Stuck);
        }
        assert_eq!(stall.update(told(0.0), 0.0, 0.0), Progress::Free);
    }
}
