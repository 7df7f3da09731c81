//! Standing, and driving on worn gears: the law is slower where little torque is needed.
//!
//! Gears have play. Near zero torque the rotors turn freely within the play, and their encoders show a wheel motion that
//! does not exist. A fast law drives the rotors from flank to flank: with 1 deg of play, until the vehicle creeps away or
//! drives at twice the commanded speed. With a share of its poles the loop through the play has too little gain to
//! sustain the oscillation.

/// Share of the poles while the vehicle stands. In simulations with 0.3 to 1.5 deg of play the arm comes to rest with
/// shares of 0.6 to 0.7; with 0.5 and with 0.9 the arm keeps swinging.
pub(super) const STANDING_PACE: f32 = 0.65;
/// Share of the poles while the vehicle drives at the commanded speed on gears that have chattered. In simulations with
/// 0.3 to 1.5 deg of play at 0.05 to 2.2 m/s, straight and in turns, no run is too fast with 0.83; with 1 a third of the
/// runs are.
const DRIVING_PACE: f32 = 0.8;
/// Largest nondimensional torque with which the gears' flanks may separate: that of 4 deg of slope. At a larger torque
/// the weight keeps the flanks in contact.
const LIGHT_TORQUE_MAX: f32 = 0.1;
/// Bounds within which the vehicle stands: of the landing speed and the reference, of phi', and of the difference between
/// the sines of the arm's angle and of its equilibrium.
const STANDING_SPEED_MAX: f32 = 0.15;
const STANDING_RATE_MAX: f32 = 0.3;
const STANDING_SIN_MAX: f32 = 0.12;

/// Share of these bounds just after the start, because a vehicle released on a slope stands only for a moment.
const STARTING_SHARE: f32 = 0.15;

/// How far from standing the vehicle is, nondimensional.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unrest {
    /// The vehicle is commanded to stand, no obstacle is in its way, and no turn loads its gears.
    pub(super) told: bool,
    /// The vehicle drives on worn gears at the commanded speed, no obstacle is in its way, and its wheels grip.
    pub(super) cruises: bool,
    /// The law has just started.
    pub(super) starting: bool,
    /// The reference, which brings the vehicle back to its place, and the landing speed.
    pub(super) reference: f32,
    pub(super) landing: f32,
    /// phi', and the sine of the arm's angle less that of its equilibrium.
    pub(super) phi_rate: f32,
    pub(super) sin_phi_off: f32,
    /// The torque that standing needs.
    pub(super) torque: f32,
}

impl Unrest {
    /// The share of its poles that the law uses.
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
