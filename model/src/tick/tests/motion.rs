//! Stage 2 along motions that are known exactly: what the sensors show follows from where the vehicle is.

use super::super::estimate::Estimator;
use super::{G, sensed_at_rest, without_spar};
use crate::dynamics::planar::{PHI, PHI_RATE, Planar, PlanarState, THETA, THETA_RATE};
use crate::estimate::Estimate;
use crate::estimate::stall::Intent;
use crate::estimate::tilt::TiltReading;
use crate::sample::TICK_S;
use crate::sensed::Sensed;
use crate::supervise::supervisor::Believed;
use crate::vehicle::Vehicle;

mod mirrored;

/// Where the vehicle is in one tick, and how it moves.
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    /// Angle of the arm from the vertical, the rate that its gyro shows, and its angular acceleration.
    phi_rad: f64,
    swing_rad_s: f64,
    swing_rad_s2: f64,
    /// Speed and acceleration of the axle along the plane, and the distance driven.
    speed_m_s: f64,
    acceleration_m_s2: f64,
    distance_m: f64,
    /// Slope along the heading, the sine of the axle's roll (left end up), and the yaw rate.
    slope_rad: f64,
    sin_roll: f64,
    yaw_rate_rad_s: f64,
}

/// Biases of the gyro: of the swing, and of the x and z axes.
const BIAS_RAD_S: [f64; 3] = [0.02, -0.01, 0.03];

/// A vehicle without a spar on a known motion.
struct Ride {
    vehicle: Vehicle<f32>,
    estimator: Estimator,
    sensed: Sensed,
    /// Angle of the IMU about its x axis.
    mounted_rad: f64,
    /// Whether the IMU is mounted with half a turn about its z axis.
    mirrored: bool,
    turned_rad: [f64; 2],
}

impl Ride {
    /// Stands at `motion` until the gyros are calibrated.
    fn from(motion: Motion) -> Self {
        Self::mounted(motion, 0.0)
    }

    /// The same with an IMU that is turned by `mounted_rad` about its x axis.
    fn mounted(motion: Motion, mounted_rad: f64) -> Self {
        let vehicle = without_spar();
        let mut ride = Self {
            vehicle,
            estimator: Estimator::new(&vehicle),
            sensed: sensed_at_rest(),
            mounted_rad,
            mirrored: false,
            turned_rad: [0.0; 2],
        };
        let rested = (0..600).fold(Estimate::default(), |_, _| ride.tick(motion, true));
        assert!(rested.calibrated);
        ride
    }

    /// Drives straight on the level, from rest to `speed_m_s` so gently that the arm stays down.
    fn at_speed(speed_m_s: f64) -> (Self, Estimate) {
        let mut ride = Self::from(Motion::default());
        let acceleration_m_s2 = 0.1;
        let ticks = (speed_m_s / acceleration_m_s2 / f64::from(TICK_S)) as u32;
        let found = (1..=ticks).fold(Estimate::default(), |_, k| {
            let speed_m_s = acceleration_m_s2 * f64::from(TICK_S) * f64::from(k);
            let motion = Motion {
                speed_m_s,
                acceleration_m_s2,
                ..Motion::default()
            };
            ride.tick(motion, false)
        });
        assert!(!found.sliding);
        (ride, found)
    }

    /// One tick later the vehicle is where `motion` says.
    fn tick(&mut self, motion: Motion, disarmed: bool) -> Estimate {
        let body = self.vehicle.parameters().body;
        let (r, d) = (f64::from(body.wheel_radius_m), f64::from(body.half_track_m));
        let radius = f64::from(self.vehicle.parameters().imu.arm_radius_m);
        let Motion {
            phi_rad,
            swing_rad_s,
            slope_rad,
            yaw_rate_rad_s: yaw,
            acceleration_m_s2: a,
            ..
        } = motion;
        let (sin, cos) = phi_rad.sin_cos();
        let g = f64::from(G);
        let relative = motion.speed_m_s / r + swing_rad_s;
        let difference = yaw * d / r;
        self.sensed.relative_rate_rad_s = [(relative - difference) as f32, (relative + difference) as f32, 0.0];
        let turned = [self.turned(motion, -1.0), self.turned(motion, 1.0)];
        for ((advance, count), (now, before)) in self
            .sensed
            .relative_advance_rad
            .iter_mut()
            .zip(&mut self.sensed.encoder_counts)
            .zip(turned.iter().zip(self.turned_rad))
        {
            *advance = (now - before) as f32;
            *count = (now * 7007.0) as i64;
        }
        self.turned_rad = turned;
        let [swing_bias, x_bias, z_bias] = BIAS_RAD_S;
        let turn = yaw * yaw * sin;
        // Turned about its x axis, the IMU shows some yaw as swing and some weight as a side force.
        let askew = self.mounted_rad;
        self.sensed.arm = TiltReading {
            rate_rad_s: (swing_rad_s - askew * yaw + swing_bias) as f32,
            force_x_m_s2: (g * sin + a * (slope_rad - phi_rad).cos() + radius * (motion.swing_rad_s2 - turn * cos))
                as f32,
            force_z_m_s2: (g * cos
                + a * (slope_rad - phi_rad).sin()
                + radius * (swing_rad_s * swing_rad_s + turn * sin)) as f32,
        };
        let normal = phi_rad - slope_rad;
        // Gravity along the axle, the acceleration across the heading in a turn, and the swinging IMU's Coriolis acceleration.
        let ahead_m_s = radius * normal.cos() * swing_rad_s;
        self.sensed.arm_force_y_m_s2 =
            (g * (motion.sin_roll + askew) + (motion.speed_m_s + 2.0 * ahead_m_s) * yaw) as f32;
        self.sensed.arm_gyro_xz_rad_s = [
            (yaw * normal.sin() + x_bias) as f32,
            (yaw * normal.cos() + z_bias) as f32,
        ];
        if self.mirrored {
            let [x_rad_s, _] = &mut self.sensed.arm_gyro_xz_rad_s;
            let arm = &mut self.sensed.arm;
            for value in [
                &mut arm.rate_rad_s,
                &mut arm.force_x_m_s2,
                &mut self.sensed.arm_force_y_m_s2,
                x_rad_s,
            ] {
                *value = -*value;
            }
        }
        let speed_m_s = motion.speed_m_s as f32;
        let intent = Intent {
            target_m_s: speed_m_s,
            reference_m_s: speed_m_s,
            ..Intent::default()
        };
        self.estimator.step(&self.sensed, Believed::ALL, disarmed, intent)
    }

    /// Angle of a wheel relative to the arm, apart from a constant: the right wheel's for the side 1, the left wheel's for -1.
    fn turned(&self, motion: Motion, side: f64) -> f64 {
        let body = self.vehicle.parameters().body;
        let (r, d) = (f64::from(body.wheel_radius_m), f64::from(body.half_track_m));
        let last = self.turned_rad[usize::from(side > 0.0)];
        let rate = motion.speed_m_s / r + motion.swing_rad_s + side * motion.yaw_rate_rad_s * d / r;
        last + rate * f64::from(TICK_S)
    }
}

fn near(what: &str, found: f32, expected: f64, tolerance: f64) {
    let error = f64::from(found) - expected;
    assert!(error.abs() < tolerance, "{what}: {found} instead of {expected}");
}

/// A vehicle obeys the equations of motion up and down a slope, under a voltage that swings its arm. The estimates of arm, slope,
/// speed and distance are those of the equations.
#[test]
fn arm_slope_speed_and_way_are_followed_along_the_equations_of_motion() {
    for slope_rad in [0.0_f64, 0.15, -0.1] {
        let planar = Planar::new(without_spar().planar(slope_rad as f32).cast::<f64>());
        let scales = without_spar().scales();
        let (time_s, r) = (f64::from(scales.time_s), f64::from(scales.length_m));
        let p = *planar.parameters();
        let mut x: PlanarState<f64> = [0.0, (slope_rad.sin() / (p.alpha * p.l)).asin(), 0.0, 0.0];
        let motion = |x: &PlanarState<f64>, u: f64| {
            let [theta2, phi2] = planar.accelerations(x, u);
            Motion {
                phi_rad: x[PHI],
                swing_rad_s: x[PHI_RATE] / time_s,
                swing_rad_s2: phi2 / (time_s * time_s),
                speed_m_s: r * x[THETA_RATE] / time_s,
                acceleration_m_s2: r * theta2 / (time_s * time_s),
                distance_m: r * x[THETA],
                slope_rad,
                ..Motion::default()
            }
        };
        let mut ride = Ride::from(motion(&x, slope_rad.sin()));
        let mut fastest: f64 = 0.0;
        for k in 0..4000 {
            // Forward at first, then to and fro.
            let u = slope_rad.sin() + 0.6 * (0.002 * f64::from(k)).sin() + 0.3;
            x = planar.rk4(&x, u, f64::from(TICK_S) / time_s);
            let motion = motion(&x, u);
            let found = ride.tick(motion, false);
            fastest = fastest.max(motion.speed_m_s.abs());
            near("phi", found.phi_rad, motion.phi_rad, 0.012);
            near("phi rate", found.phi_rate_rad_s, motion.swing_rad_s, 2e-4);
            near("theta rate", found.theta_rate_rad_s, motion.speed_m_s / r, 2e-4);
            near("speed", found.speed_m_s, motion.speed_m_s, 1e-4);
            near("slope", found.slope_rad, slope_rad, 0.012);
            near("sine of the slope", found.sin_slope, slope_rad.sin(), 0.012);
            near("way", found.distance_m, motion.distance_m, 0.004);
            near("x", found.x_m, motion.distance_m, 0.004);
            near("y", found.y_m, 0.0, 0.004);
            assert!(!found.sliding && !found.stalled && !found.contradicted, "{found:?}");
            assert!(found.is_finite());
        }
        assert!(fastest > 0.4, "{fastest} m/s");
        let (sin, cos) = ride.estimator.sines().phi;
        let phi_rad = f64::from(libm::atan2f(sin, cos));
        assert!((phi_rad - x[PHI]).abs() < 0.012, "{phi_rad}");
        assert!((sin * sin + cos * cos - 1.0).abs() < 1e-5);
    }
}

/// On a circle, the estimates of heading and position follow the vehicle. The side force is that of the turn, so the estimate of
/// the roll stays 0.
#[test]
fn a_circle_is_followed_to_its_end() {
    for yaw_rate_rad_s in [0.5, -0.5] {
        let (mut ride, start) = Ride::at_speed(1.0);
        let motion = Motion {
            speed_m_s: 1.0,
            yaw_rate_rad_s,
            ..Motion::default()
        };
        for k in 1..=8000 {
            let found = ride.tick(motion, false);
            let heading = yaw_rate_rad_s * f64::from(TICK_S) * f64::from(k);
            near("heading", found.heading_rad, heading, 2e-3);
            near("yaw rate", found.yaw_rate_rad_s, yaw_rate_rad_s, 1e-3);
            near("x", found.x_m - start.x_m, heading.sin() / yaw_rate_rad_s, 5e-3);
            near("y", found.y_m, (1.0 - heading.cos()) / yaw_rate_rad_s, 5e-3);
            near(
                "distance",
                found.distance_m - start.distance_m,
                f64::from(TICK_S) * f64::from(k),
                2e-3,
            );
            near("slope", found.slope_rad, 0.0, 5e-3);
            near("phi", found.phi_rad, 0.0, 5e-3);
            assert!(!found.sliding, "{k}");
        }
    }
}

/// The vehicle turns on the spot on a slope: the slope along the heading rises and falls once, the arm follows, and the axle
/// rolls. None of these motions counts as a turn of the wheels.
#[test]
fn turning_on_a_slope_changes_the_slope_along_the_heading() {
    for yaw_rate_rad_s in [0.4, -0.4] {
        let steepest = 0.1_f64.sin();
        let planar = without_spar().planar(0.0);
        let weight = f64::from(planar.alpha * planar.l);
        let at = |heading: f64, yaw_rate_rad_s: f64| {
            let slope_rad = (steepest * heading.cos()).asin();
            let sin_roll = -steepest * heading.sin();
            let sin_phi = steepest * heading.cos() / weight;
            // The arm keeps its balance. Its gyro turns with the plane, and shows less than the arm's turn.
            let phi_rate = -steepest * heading.sin() / weight / (1.0 - sin_phi * sin_phi).sqrt() * yaw_rate_rad_s;
            Motion {
                phi_rad: sin_phi.asin(),
                swing_rad_s: phi_rate - sin_roll * yaw_rate_rad_s,
                slope_rad,
                sin_roll,
                yaw_rate_rad_s,
                ..Motion::default()
            }
        };
        let mut ride = Ride::from(at(0.0, 0.0));
        for k in 1..=16_000 {
            let heading = yaw_rate_rad_s * f64::from(TICK_S) * f64::from(k);
            let motion = at(heading, yaw_rate_rad_s);
            let found = ride.tick(motion, false);
            near("heading", found.heading_rad, heading, 4e-3);
            near("slope", found.slope_rad, motion.slope_rad, 4e-3);
            near("phi", found.phi_rad, motion.phi_rad, 4e-3);
            near("x", found.x_m, 0.0, 5e-3);
            near("y", found.y_m, 0.0, 5e-3);
            assert!(!found.sliding && !found.contradicted, "{k}");
        }
    }
}

/// An IMU is mounted askew by 2 degrees, so that it shows a swing while the vehicle turns. From the second turn on the spot, the
/// estimator takes no distance from that swing.
#[test]
fn an_imu_mounted_askew_is_known_after_a_turn() {
    for yaw_rate_rad_s in [1.0, -1.0] {
        let mut ride = Ride::mounted(Motion::default(), 0.035);
        let motion = Motion {
            yaw_rate_rad_s,
            ..Motion::default()
        };
        let turn_ticks = 6284;
        let first = (0..turn_ticks + 10).fold(Estimate::default(), |_, _| ride.tick(motion, false));
        let second = (0..turn_ticks).fold(Estimate::default(), |_, _| ride.tick(motion, false));
        let crept_m = [first.distance_m, second.distance_m - first.distance_m].map(f32::abs);
        assert!(crept_m[0] > 0.04 && crept_m[1] < 1e-3, "{crept_m:?}");
        near("phi rate", second.phi_rate_rad_s, 0.0, 1e-3);
        near("slope", second.slope_rad, 0.0, 0.01);
    }
}

/// While the wheels slide, speed and distance follow the accelerometer.
#[test]
fn a_slide_is_told_and_its_way_is_the_accelerometers() {
    let rolling = Motion {
        speed_m_s: 1.0,
        ..Motion::default()
    };
    let (mut ride, before) = Ride::at_speed(1.0);
    // The wheels turn on; the vehicle is braked at 1 m/s^2.
    let mut found = before;
    let mut told_after = None;
    for k in 1..=800 {
        found = ride.tick(
            Motion {
                acceleration_m_s2: -1.0,
                ..rolling
            },
            false,
        );
        near("the wheels' rate", found.theta_rate_rad_s, 4.0, 5e-3);
        if found.sliding && told_after.is_none() {
            told_after = Some(k);
        }
    }
    assert!(told_after.is_some_and(|k| (150..250).contains(&k)), "{told_after:?}");
    near("speed", found.speed_m_s, 0.2, 0.12);
    // Until the estimator reported the slide, the wheels counted.
    let way_m = f64::from(found.distance_m - before.distance_m);
    assert!((0.45..0.65).contains(&way_m), "{way_m}");
}
