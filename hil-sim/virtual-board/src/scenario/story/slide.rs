//! Why the wheels slid: how they turned against the ground, and what needed more grip than the ground gives.

use plant::Truth;

use super::sight::Sight;

/// Speed below which the vehicle counts as not yet driving, m/s.
const DRIVES_M_S: f64 = 0.05;
/// Share of the slip along the wheel below which the force along the wheel does not show the whole friction.
const ALONG_SHARE_MIN: f64 = 0.2;

/// The contact that slides fastest at one instant.
#[derive(Debug, Clone, Copy)]
pub(super) struct SlidingContact {
    /// Speed of the wheel's contact over the ground: along the heading and to the left, m/s.
    along_m_s: f64,
    side_m_s: f64,
    /// Speed of the vehicle, m/s.
    speed_m_s: f64,
    /// Force of the ground along the heading, N.
    force_n: f64,
    /// Friction over load; `None` if the run does not show it.
    pub(super) grip: Option<f64>,
    /// Slope of the path under the wheels, rad.
    slope_rad: f64,
}

impl SlidingContact {
    pub(super) fn of(truth: &Truth) -> Option<Self> {
        let slip = |wheel: usize| truth.slip_m_s[wheel];
        let wheel = (0..2)
            .filter(|wheel| truth.sliding[*wheel])
            .max_by(|a, b| slip(*a).abs().total_cmp(&slip(*b).abs()))?;
        let (along_m_s, side_m_s) = (slip(wheel), truth.side_speed_m_s);
        // Friction acts against the slip, so the slip's direction gives the friction's share along the
        // heading.
        let share = along_m_s.abs() / along_m_s.hypot(side_m_s);
        let (force_n, load_n) = (truth.longitudinal_n[wheel], truth.normal_n[wheel]);
        Some(Self {
            along_m_s,
            side_m_s,
            speed_m_s: truth.speed_m_s,
            force_n,
            grip: (share > ALONG_SHARE_MIN && load_n > 0.0).then(|| force_n.abs() / (load_n * share)),
            slope_rad: truth.slope_rad,
        })
    }

    fn speed_over_ground_m_s(&self) -> f64 {
        self.along_m_s.hypot(self.side_m_s)
    }

    /// The wheel's motion relative to the ground, in words.
    fn motion(&self) -> &'static str {
        let rim_m_s = self.speed_m_s - self.along_m_s;
        if self.side_m_s.abs() > self.along_m_s.abs() {
            "sideways"
        } else if rim_m_s * self.speed_m_s < 0.0 {
            "turning against the vehicle's motion"
        } else if rim_m_s.abs() > self.speed_m_s.abs() {
            "turning faster than the vehicle drives"
        } else {
            "turning slower than the vehicle drives"
        }
    }

    /// The cause that needed more grip than the ground gives, in words.
    fn cause(&self) -> String {
        let Some(grip) = self.grip else {
            return "the motion sideways asks for more grip than the ground gives".to_owned();
        };
        let (slope, asked) = (self.slope_rad.abs().to_degrees(), self.slope_rad.abs().tan());
        if asked > grip {
            return format!(
                "the ground gives a grip of {grip:.2}, and its slope of {slope:.1} deg asks for {asked:.2}"
            );
        }
        let asks = if self.speed_m_s.abs() < DRIVES_M_S {
            "driving off"
        } else if self.force_n * self.speed_m_s > 0.0 {
            "speeding up"
        } else {
            "braking"
        };
        format!("the ground gives a grip of {grip:.2} on {slope:.1} deg, and {asks} asks for more")
    }
}

/// The observations of a slide.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SlideWitness {
    wheels: [bool; 2],
    first: Option<SlidingContact>,
    fastest: Option<SlidingContact>,
}

impl SlideWitness {
    pub(super) fn see(&mut self, sight: Sight<'_>) {
        let Some((truth, contact)) = sight.truth.and_then(|truth| Some((truth, SlidingContact::of(truth)?))) else {
            return;
        };
        for (slid, slides) in self.wheels.iter_mut().zip(truth.sliding) {
            *slid |= slides;
        }
        self.first.get_or_insert(contact);
        let reached_m_s = self.fastest.map_or(-1.0, |fastest| fastest.speed_over_ground_m_s());
        if contact.speed_over_ground_m_s() > reached_m_s {
            self.fastest = Some(contact);
        }
    }

    /// The slide in a sentence.
    pub(super) fn told(&self) -> String {
        let (Some(first), Some(fastest)) = (self.first, self.fastest) else {
            return "the wheels slide, as the vehicle finds: they turn otherwise than it moves".to_owned();
        };
        let who = match self.wheels {
            [true, true] => "both wheels slide",
            [true, false] => "the left wheel slides",
            _ => "the right wheel slides",
        };
        format!(
            "{who} at up to {:.2} m/s, {}, at {:.2} m/s: {}",
            fastest.speed_over_ground_m_s(),
            fastest.motion(),
            fastest.speed_m_s,
            first.cause()
        )
    }
}
