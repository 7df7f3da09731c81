//! Standing, and driving on worn gears: where little torque is needed, the law is slower.
//!
//! The gears have play. About zero torque the rotors turn freely within it, and their encoders show a motion of the wheels
//! that is none. A fast law drives the rotors from flank to flank: with 1 deg of play, until the vehicle creeps away, or
//! drives at twice the speed told. With a share of its poles the loop through the play has less gain than keeps it going.

/// Share of the poles while the vehicle stands. Simulated with play of 0.3 to 1.5 deg, 0.6 to 0.7 come to rest; with 0.5
/// and with 0.9 the arm swings on.
pub(super) const STANDING_PACE: f32 = 0.65;
/// The same while the vehicle drives at the speed told on gears that have chattered. Simulated with play of 0.3 to 1.5 deg, 0.05
/// to 2.2 m/s, straight and in turns: with 0.83 no drive runs too fast, with 1 a third of them does.
const DRIVING_PACE: f32 = 0.8;
/// Largest torque, nondimensional, with which the gears' flanks may part: 4 deg of slope. Beyond, the weight holds
/// them together.
const LIGHT_TORQUE_MAX: f32 = 0.1;
/// Landing speed and reference, phi', and distance of the sine of the arm's angle from its equilibrium, within which the
/// vehicle stands.
const STANDING_SPEED_MAX: f32 = 0.15;
const STANDING_RATE_MAX: f32 = 0.3;
const STANDING_SIN_MAX: f32 = 0.12;

/// Share of these bounds just after the start: a vehicle that is let go on a slope stands only for a moment.
const STARTING_SHARE: f32 = 0.15;

/// How far from standing the vehicle is, nondimensional.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unrest {
    /// The vehicle is commanded to stand, nothing is in its way, and no turn loads its gears.
    pub(super) told: bool,
    /// The vehicle drives on worn gears at the speed told, nothing is in its way, and its wheels grip.
    pub(super) cruises: bool,
    /// The law has just started.
    pub(super) starting: bool,
    /// The reference, which brings the vehicle back to its place, and the landing speed.
    pub(super) reference: f32,
    pub(super) landing: f32,
    /// phi', and the sine of the arm's angle less that of its equilibrium.
    pub(super) phi_rate: f32,
    pub(super) sin_phi_off: f32,
    /// The torque that the stand takes.
    pub(super) torque: f32,
}

impl Unrest {
    /// The share of its poles that the law takes.
    pub(super) fn pace(&self) -> f32 {
        let light = self.torque.abs() < LIGHT_TORQUE_MAX;
        let share = if self.starting { STARTING_SHARE } else { 1.0 };
        let stands = self.told
            && light
            && self.reference.abs() < share * STANDING_SPEED_MAX
            && self.landing.abs() < share * STANDING_SPEED_MAX
            && self.phi_rate.abs() < share * STANDING_RATE_MAX
            && self.sin_phi_off.abs() < share * STANDING_SIN_MAX;
        if stands {
            STANDING_PACE
        } else if self.cruises && light {
            DRIVING_PACE
        } else {
            1.0
        }
    }
}
