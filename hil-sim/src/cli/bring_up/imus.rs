//! The steps of the IMUs: hanging at rest, and tilted by hand.

use std::io::Write;

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use firmware::hardware::Place;
use model::sample::ImuRaw;
use model::supervise::plausibility::REPEATED_TICKS;

use super::person::{Person, Reply};
use super::procedure::{Procedure, StepEnd};
use super::unpowered::mean;
use super::verdict::Finding;
use crate::cli::link::wire::Wire;

/// Largest error of 1 g, as a share: the part's scale and offset, and the mounting.
const GRAVITY_SHARE: f64 = 0.05;
/// Largest angle of a hanging arm or spar from the vertical, rad.
const HANGS_RAD: f64 = 0.26;
/// Largest rate of a still gyro, rad/s: beyond it the board does not calibrate.
const STILL_RAD_S: f64 = 0.1;
/// Smallest angle of a tilted arm or spar, rad: 20 degrees minus the error of a hand.
const TILT_RAD: f64 = 0.26;
/// Largest difference between gyro and accelerometer, as a share of the angle.
const TILT_SHARE: f64 = 1.0 / 3.0;

impl<W: Wire, P: Person, O: Write> Procedure<'_, W, P, O> {
    pub(super) fn at_rest(&mut self, place: Place) -> Result<Finding, StepEnd> {
        self.ask_to(hang_still(place))?;
        let rest = Rest::of(place, &self.ticks()?);
        let seen = format!(
            "{:.3} g, {:+.1} degrees, up to {:.3} rad/s, a reading repeated {} times",
            rest.g,
            rest.angle_rad.to_degrees(),
            rest.rate_rad_s,
            rest.repeated
        );
        let good = (rest.g - 1.0).abs() < GRAVITY_SHARE
            && rest.angle_rad.abs() < HANGS_RAD
            && rest.rate_rad_s < STILL_RAD_S
            && rest.repeated < usize::from(REPEATED_TICKS);
        Ok(Finding::of(good, seen))
    }

    pub(super) fn tilted_forward(&mut self, place: Place) -> Result<Finding, StepEnd> {
        self.ask_to(hang_still(place))?;
        let ticks = self.ticks()?;
        let before_rad = Rest::of(place, &ticks).angle_rad;
        let bias_rad_s = mean(ticks.iter().map(|tick| rate_rad_s(reading(place, tick))));
        let (mut turned_rad, mut last_us) = (0.0, None);
        let tilted = match place {
            Place::Arm => "Tilt the arm forward by 20 degrees or more and hold it",
            Place::Spar => "Tilt the spar's lower end forward by 20 degrees or more and hold it",
        };
        let reply = self.ask_watching(tilted, |tick| {
            let now_us = tick.sample.time_us;
            if let Some(last_us) = last_us.replace(now_us)
                && now_us > last_us
            {
                let dt_s = (now_us - last_us) as f64 * 1e-6;
                turned_rad += (rate_rad_s(reading(place, tick)) - bias_rad_s) * dt_s;
            }
        })?;
        if reply != Reply::Yes {
            return Ok(Finding::failed("not done"));
        }
        let angle_rad = Rest::of(place, &self.ticks()?).angle_rad - before_rad;
        let seen = format!(
            "accelerometer {:+.0} degrees, gyro {:+.0} degrees",
            angle_rad.to_degrees(),
            turned_rad.to_degrees()
        );
        Ok(Finding::of(
            angle_rad > TILT_RAD && (turned_rad - angle_rad).abs() < TILT_SHARE * angle_rad,
            seen,
        ))
    }
}

fn hang_still(place: Place) -> &'static str {
    match place {
        Place::Arm => "Let the arm hang still",
        Place::Spar => "Steady the spar, and let it hang still",
    }
}

/// The reading of the IMU at a place in a tick.
fn reading(place: Place, tick: &FlightRecord) -> &ImuRaw {
    match place {
        Place::Arm => &tick.sample.arm_imu.raw,
        Place::Spar => &tick.sample.spar_imu.raw,
    }
}

/// An IMU over some ticks at rest.
struct Rest {
    /// Size of the mean specific force, g.
    g: f64,
    /// Angle from the vertical in the plane of the wheels, rad, lower end forward positive.
    angle_rad: f64,
    /// Largest mean rate of an axis, rad/s.
    rate_rad_s: f64,
    /// Largest number of repetitions of one reading in a row.
    repeated: usize,
}

impl Rest {
    fn of(place: Place, ticks: &[FlightRecord]) -> Self {
        let raw = |tick| reading(place, tick);
        let axis = |of: &dyn Fn(&ImuRaw) -> i16| mean(ticks.iter().map(|tick| f64::from(of(raw(tick)))));
        let force_g: [f64; 3] =
            core::array::from_fn(|i| axis(&|raw| raw.accel[i]) / f64::from(SCALES.imu.accel_lsb_per_g));
        let rates: [f64; 3] = core::array::from_fn(|i| {
            (axis(&|raw| raw.gyro[i]) / f64::from(SCALES.imu.gyro_lsb_per_deg_s)).to_radians()
        });
        let (mut repeated, mut most) = (0, 0);
        for pair in ticks.windows(2) {
            let [before, after] = pair else { continue };
            repeated = if raw(before) == raw(after) { repeated + 1 } else { 0 };
            most = most.max(repeated);
        }
        let [x, y, z] = force_g;
        Self {
            g: (x * x + y * y + z * z).sqrt(),
            angle_rad: x.atan2(z),
            rate_rad_s: rates.iter().fold(0.0, |most, rate| rate.abs().max(most)),
            repeated: most,
        }
    }
}

/// The rate of the body under an IMU, rad/s, lower end forward positive: a forward swing is a rotation about -y.
fn rate_rad_s(raw: &ImuRaw) -> f64 {
    -(f64::from(raw.gyro[1]) / f64::from(SCALES.imu.gyro_lsb_per_deg_s)).to_radians()
}
