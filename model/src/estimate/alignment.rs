//! Learns the arm IMU's mounting error about its x axis while the vehicle turns on the spot.
//!
//! An IMU that is mounted with an angle rho about x shows a part `rho psi'` of the yaw rate as a swing of the arm, and a
//! part `rho g` of gravity as a roll of the axle. At rest a side slope has the same effect. A whole turn on the spot
//! separates the two: the arm's angle returns to its start, and the roll of the axle over a plane averages to zero. The
//! mean swing rate over the mean yaw rate is then -rho, and the mean roll is rho. The gyro gives the first and the
//! accelerometer the second, so a bias of the accelerometer does not affect the gyro's correction. The first turn after
//! boot is uncorrected.

/// Learns the alignment of one IMU.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Alignment {
    turn: Turn,
    swing_share: f32,
    sin_roll: f32,
}

/// Sums over the present turn.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(clippy::struct_field_names)] // Every field is an angle.
struct Turn {
    turned_rad: f32,
    swung_rad: f32,
    rolled_rad: f32,
}

/// Smallest yaw rate that counts as a turn, rad/s.
const SPINS_RAD_S: f32 = 0.2;
/// Largest speed of a turn on the spot, m/s.
const ON_THE_SPOT_M_S: f32 = 0.15;
/// Largest angle that the estimator accepts, rad; a larger angle is no mounting error.
const ALIGNMENT_MAX_RAD: f32 = 0.1;

impl Alignment {
    /// Updates the sums with one tick of `dt_s`: the gyro's yaw and swing rates in rad/s, the accelerometer's sine of
    /// the axle's roll, and the speed of the wheels in m/s.
    pub fn update(&mut self, dt_s: f32, yaw_rad_s: f32, swing_rad_s: f32, sin_roll: f32, speed_m_s: f32) {
        let same_way = yaw_rad_s * self.turn.turned_rad >= 0.0;
        if yaw_rad_s.abs() < SPINS_RAD_S || speed_m_s.abs() > ON_THE_SPOT_M_S || !same_way {
            self.turn = Turn::default();
            return;
        }
        let step_rad = yaw_rad_s * dt_s;
        self.turn.turned_rad += step_rad;
        self.turn.swung_rad += swing_rad_s * dt_s;
        self.turn.rolled_rad += sin_roll * step_rad;
        if self.turn.turned_rad.abs() < 2.0 * core::f32::consts::PI {
            return;
        }
        let swing_share = self.turn.swung_rad / self.turn.turned_rad;
        let mean_sin_roll = self.turn.rolled_rad / self.turn.turned_rad;
        self.turn = Turn::default();
        if swing_share.abs() < ALIGNMENT_MAX_RAD && mean_sin_roll.abs() < ALIGNMENT_MAX_RAD {
            self.swing_share = swing_share;
            self.sin_roll = mean_sin_roll;
        }
    }

    /// The false swing rate that the gyro shows at a yaw rate of `yaw_rad_s`, rad/s.
    pub fn swing_rad_s(&self, yaw_rad_s: f32) -> f32 {
        self.swing_share * yaw_rad_s
    }

    /// The sine of the axle's roll that the accelerometer shows while the axle is level.
    pub fn sin_roll(&self) -> f32 {
        self.sin_roll
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The vehicle turns on the spot at `yaw` on a side slope, with the IMU's mounting error `rho` and a bias of its
    /// accelerometer.
    fn turned(yaw: f32, rho: f32, slope: f32, bias: f32, turns: f32) -> Alignment {
        let mut alignment = Alignment::default();
        let ticks = (turns * 2.0 * core::f32::consts::PI / yaw.abs() / 0.001) as u32;
        for k in 0..ticks {
            let heading = yaw * 0.001 * k as f32;
            // The slope along the heading varies as the heading's sine, the roll as its cosine: the arm swings with the
            // plane.
            let sin_roll = slope * heading.cos();
            let swing = -sin_roll * yaw + slope * yaw * heading.cos() - rho * yaw;
            alignment.update(0.001, yaw, swing, sin_roll + rho + bias, 0.01);
        }
        alignment
    }

    #[test]
    fn one_turn_on_any_slope_shows_how_the_imu_is_mounted() {
        for (yaw, rho, slope, bias) in [
            (1.9_f32, 0.035_f32, 0.0_f32, 0.002_f32),
            (-1.0, 0.035, 0.1, 0.0),
            (0.5, -0.02, 0.1, -0.003),
            (0.8, 0.0, 0.2, 0.0),
        ] {
            let alignment = turned(yaw, rho, slope, bias, 1.01);
            assert!((alignment.swing_rad_s(1.0) + rho).abs() < 3e-4, "{alignment:?}");
            assert!((alignment.sin_roll() - rho - bias).abs() < 3e-4, "{alignment:?}");
        }
    }

    #[test]
    fn less_than_a_turn_and_a_curve_show_nothing() {
        assert_eq!(turned(1.0, 0.035, 0.0, 0.0, 0.98).sin_roll(), 0.0);
        let mut alignment = Alignment::default();
        for _ in 0..60_000 {
            alignment.update(0.001, 1.0, -0.03, 0.03, 0.5);
        }
        assert_eq!((alignment.swing_rad_s(1.0), alignment.sin_roll()), (0.0, 0.0));
    }
}
