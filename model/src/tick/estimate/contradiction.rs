//! Checks the IMUs' readings against gravity, the wheels and the ballast.

use super::Estimator;
use super::motion::MeasuredMotion;
use crate::estimate::exchanged::{BodyRates, Exchanged};
use crate::estimate::facing::{Facing, INTERVAL_TICKS, Shown};
use crate::estimate::spar_facing::{SparFacing, SparShown};
use crate::estimate::tilt::TiltReading;
use crate::persistence::Persistence;
use crate::sensed::Sensed;
use crate::supervise::supervisor::Believed;
use crate::vehicle::{G, Vehicle};

/// Sine of an angle between integrated gyro and accelerometer that cannot last unless one of the two is wrong.
const CONTRADICTION: f32 = 0.7;
const CONTRADICTION_TICKS: u16 = 300;
/// Vertical component of an accelerometer, m/s^2, below which the IMU is upside down, and ticks for which this must
/// last. A fall takes the component only to 0, and nothing pulls a vehicle down at 1.5 g for that long.
const OVERTURNED_M_S2: f32 = -0.5 * G;
const OVERTURNED_TICKS: u16 = 40;
/// Cosine of the estimated angle, 80 deg, beyond which a push has thrown the arm. The accelerometer feels the push, and the
/// wheels slide or leave the ground, so neither shows gravity. Fault ArmAngle bounds the time.
const THROWN_COS: f32 = 0.17;
/// Ticks for which an IMU must feel more force along the axle than across it to count as lying on its side. The
/// number is less than that of a calibration, which arming requires, and more than half a period of a vibration of
/// 1.3 Hz or faster.
const ON_ITS_SIDE_TICKS: u16 = 400;

/// The watches of the IMUs' mountings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mountings {
    /// The watch whose turn it is.
    turn: u8,
    facing: Facing,
    exchanged: [Exchanged; 2],
    spar: Option<SparFacing>,
    apart: Persistence,
    overturned: [Persistence; 2],
    on_its_side: [Persistence; 2],
}

impl Mountings {
    /// Whether no watch runs in the next tick; the slow means are updated then.
    pub(super) fn rest_next(&self) -> bool {
        self.turn + 2 == INTERVAL_TICKS
    }

    /// The watches for `vehicle`, whose estimate of the axle's acceleration comes from a filter of
    /// `axle_time_constant_s`.
    pub(super) fn new(vehicle: &Vehicle<f32>, axle_time_constant_s: f32) -> Self {
        Self {
            turn: 0,
            facing: Facing::new(vehicle.scales().length_m, axle_time_constant_s),
            exchanged: [Exchanged::default(); 2],
            spar: SparFacing::new(vehicle),
            apart: Persistence::new(CONTRADICTION_TICKS),
            overturned: [Persistence::new(OVERTURNED_TICKS); 2],
            on_its_side: [Persistence::new(ON_ITS_SIDE_TICKS); 2],
        }
    }
}

/// Whether an IMU at rest feels more force along the axle than in the plane of the wheels.
fn on_its_side(reading: &TiltReading, force_y_m_s2: f32) -> bool {
    let TiltReading {
        force_x_m_s2: x,
        force_z_m_s2: z,
        ..
    } = *reading;
    force_y_m_s2 * force_y_m_s2 > x * x + z * z
}

impl Estimator {
    /// Whether the arm IMU and the spar IMU have contradicted themselves, gravity, the wheels or the ballast for a
    /// while. The wheels count only while a motor holds or drives them, because hands may turn a disarmed vehicle
    /// upside down.
    pub(super) fn contradicts(
        &mut self,
        sensed: &Sensed,
        motion: &MeasuredMotion,
        believed: Believed,
        disarmed: bool,
    ) -> [bool; 2] {
        let watch = &mut self.mountings;
        let hangs = self.arm.cos() > THROWN_COS;
        let apart = watch
            .apart
            .update(hangs && self.arm.unfiltered_error().abs() > CONTRADICTION);
        let [arm_lies, spar_lies] = &mut watch.on_its_side;
        if disarmed {
            arm_lies.update(on_its_side(&sensed.arm, sensed.arm_force_y_m_s2));
            spar_lies.update(on_its_side(&sensed.spar, sensed.spar_force_y_m_s2));
        }
        watch.turn = if watch.turn + 1 < INTERVAL_TICKS {
            watch.turn + 1
        } else {
            0
        };
        let mut found = [apart || arm_lies.stands(), spar_lies.stands()];
        let [arm_exchanged, spar_exchanged] = &mut watch.exchanged;
        let [arm_overturned, spar_overturned] = &mut watch.overturned;
        if disarmed || !believed.arm_imu {
            arm_overturned.update(false);
            watch.facing.reset(sensed.arm_force_y_m_s2);
            arm_exchanged.reset();
        } else {
            found[0] |= arm_overturned.update(hangs && self.arm.vertical_m_s2() < OVERTURNED_M_S2);
            let relative_rad_s = motion.theta_rate_rad_s + motion.phi_rate_rad_s;
            found[0] |= match watch.turn {
                0 => watch.facing.update(&Shown {
                    relative_rad_s,
                    unexplained: self.arm.unexplained(),
                    sideways_m_s2: sensed.arm_force_y_m_s2,
                    weighs: hangs && self.weight.is_steady(),
                    slides: self.traction.slid_lately(),
                }),
                1 => {
                    let [roll_rad_s, _] = sensed.arm_gyro_xz_rad_s;
                    arm_exchanged.update(&BodyRates {
                        relative_rad_s,
                        swing_rad_s: motion.phi_rate_rad_s,
                        roll_rad_s,
                        yaw_rad_s: motion.yaw_rate_rad_s,
                    })
                }
                _ => false,
            };
        }
        let (Some(spar), Some(facing)) = (&self.spar, &mut watch.spar) else {
            return found;
        };
        if disarmed || !believed.spar_imu {
            spar_overturned.update(false);
            facing.reset();
            spar_exchanged.reset();
        } else {
            found[1] |= spar_overturned.update(spar.vertical_m_s2() < OVERTURNED_M_S2);
            let [.., ballast_rate_rad_s] = sensed.relative_rate_rad_s;
            found[1] |= match watch.turn {
                2 => facing.update(&SparShown {
                    spar_rad: spar.angle_rad(),
                    spar_rad_s2: spar.acceleration_rad_s2(),
                    ballast_rad: sensed.ballast_turned_rad + self.ballast_offset_rad,
                    ballast_rate_rad_s,
                    axle_g: motion.wheels_m_s2 * self.slope.cos() / G,
                    unexplained: self.arm.unexplained(),
                    weighs: self.weight.is_steady(),
                }),
                3 => spar_exchanged.update(&BodyRates {
                    relative_rad_s: ballast_rate_rad_s,
                    swing_rad_s: spar.rate_rad_s(),
                    roll_rad_s: sensed.spar_gyro_x_rad_s,
                    yaw_rad_s: motion.yaw_rate_rad_s,
                }),
                _ => false,
            };
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_imu_on_its_side_feels_the_weight_along_the_axle() {
        for ([x, y, z], lies) in [
            ([0.0, 9.8, 0.0], true),
            ([0.0, -9.8, 0.0], true),
            ([6.0, 7.0, 3.0], true),
            ([6.0, 7.0, 4.0], false),
            ([-6.0, 7.0, -4.0], false),
            // Upright, and on an end.
            ([0.0, 0.5, 9.8], false),
            ([-9.8, 0.5, 0.0], false),
        ] {
            let reading = TiltReading {
                rate_rad_s: 0.0,
                force_x_m_s2: x,
                force_z_m_s2: z,
            };
            assert_eq!(on_its_side(&reading, y), lies, "{x}, {y}, {z}");
        }
    }
}
