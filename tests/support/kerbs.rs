//! Drives over one kerb or ledge, and the requirements on them.

use model::dynamics::camera::CameraParameters;
use model::supervise::arming::Mode;
use model::supervise::codes::{FaultSet, Limit};
use model::vehicle::GRAVITY_M_S2;
use virtual_board::scenario::trace::TraceRow;

use super::reference;
use super::slopes::{drive, from, most};

/// The smallest blow that no ballast can compensate, m/s: a ballast that keeps the spar level through it swings to a quarter turn,
/// where it has no lever left.
pub const BLOW_MAX_M_S: f64 = 1.02;
/// The spar's angle from which the controller catches the spar, deg.
const CATCH_DEG: f64 = 11.46;
/// Speed over the command that is allowed behind an obstacle, m/s.
const OVERSPEED_M_S: f64 = 0.5;
/// Speed beyond the speed that the fall from a ledge gives by itself, m/s: to brake, the arm swings back, which first pushes the
/// wheels forward.
const PUSH_M_S: f64 = 0.2;
/// Place of the kerb, m.
const KERB_M: f64 = 3.0;

/// The largest change of the axle's speed within a quarter period of the ballast, m/s.
pub fn blow_m_s(rows: &[TraceRow], camera: &CameraParameters<f64>, time_s: f64) -> f64 {
    let c = camera.coefficients();
    let quarter_s = core::f64::consts::FRAC_PI_2 * ((c.m2 + c.m3) / c.k2).sqrt() * time_s;
    let ticks = (quarter_s / 0.01).round() as usize;
    rows.windows(ticks + 1)
        .map(|w| (w[ticks].truth.speed_m_s - w[0].truth.speed_m_s).abs())
        .fold(0.0, f64::max)
}

/// The largest tilt of the spar that an unforeseen blow may cause, deg. The regulator is linear up to the angle from which the
/// controller catches the spar, so the tilt is at most that angle's share by the blow. A blow beyond `BLOW_MAX_M_S` has no bound.
pub fn unforeseen_deg(blow_m_s: f64) -> f64 {
    if blow_m_s > BLOW_MAX_M_S {
        f64::INFINITY
    } else {
        (CATCH_DEG * blow_m_s / BLOW_MAX_M_S).max(2.0)
    }
}

/// The result of a drive over a kerb or ledge.
pub struct KerbDrive {
    /// What is wrong with the drive.
    pub complaints: Vec<String>,
    /// Largest speed over the command outside the fall, m/s.
    pub excess_m_s: f64,
    /// Largest speed during the fall, less the speed allowed there, m/s; negative if the vehicle is slower.
    pub falling_excess_m_s: f64,
    /// Whether the drive ends behind the kerb.
    pub comes_over: bool,
}

/// Drives the reference vehicle at `speed_m_s` up a slope of `slope_deg` over a step of `height_m`. There is no complaint if the
/// vehicle drives over the step, or stops before it and reports that, without a fault, at most 0.5 m/s too fast apart from the speed
/// that the fall over a ledge gives by itself, and with its spar within the tilt that the blow allows.
pub fn drive_over(speed_m_s: f64, height_m: f64, slope_deg: f64) -> KerbDrive {
    let vehicle = reference();
    let kerb = format!("terrain.profile = [{{ kind = 'step', at_m = {KERB_M:?}, height_m = {height_m:?} }}]");
    let steps = format!("{{ at_s = 6.0, action = 'drive', speed_m_s = {speed_m_s:?} }}");
    let outcome = drive(&vehicle, 10.0 + 3.2 / speed_m_s, slope_deg, &kerb, &steps);
    let rows = from(&outcome, 6.0);
    let last = &rows[rows.len() - 1];
    let story = format!("{speed_m_s} m/s, {:.0} mm on {slope_deg} deg", 1000.0 * height_m);
    let mut complaints = Vec::new();
    let mut ask = |good: bool, what: String| {
        if !good {
            complaints.push(format!("{story}: {what}"));
        }
    };

    if last.status.mode != Mode::Armed || last.status.faults != FaultSet::EMPTY {
        ask(false, format!("{:?}, {}", last.status.mode, last.status.faults));
    }
    // The axle falls on an arc about the ledge's edge, and down the slope until the wheel meets the ground.
    let drop_m = (-height_m).max(0.0);
    let falls_m = (drop_m * (2.0 * vehicle.parameters().body.wheel_radius_m - drop_m)).sqrt();
    let slope_m = falls_m * (-slope_deg).to_radians().sin().max(0.0);
    let inertia = 1.0 + vehicle.planar(0.0).mu / (1.0 + vehicle.spar_mass_ratio());
    let fallen_m_s = (speed_m_s.powi(2) + 2.0 * GRAVITY_M_S2 * (drop_m + slope_m) / inertia).sqrt();
    let excess_m_s = |row: &TraceRow| row.truth.speed_m_s - speed_m_s;
    let falling = |row: &TraceRow| (KERB_M..KERB_M + falls_m + 0.02).contains(&row.truth.x_m);
    let (mut fastest_m_s, mut fastest_falling_m_s) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
    for row in rows {
        let fastest = if falling(row) {
            &mut fastest_falling_m_s
        } else {
            &mut fastest_m_s
        };
        *fastest = fastest.max(excess_m_s(row));
    }
    ask(fastest_m_s <= OVERSPEED_M_S, format!("{fastest_m_s:.2} m/s too fast"));
    let allowed_falling_m_s = OVERSPEED_M_S.max(fallen_m_s - speed_m_s + PUSH_M_S);
    ask(
        fastest_falling_m_s <= allowed_falling_m_s,
        format!("{fastest_falling_m_s:.2} m/s too fast in its fall"),
    );
    let told = rows[rows.len() - 50..]
        .iter()
        .any(|row| row.status.limits.contains(Limit::Stall));
    let place_m = last.truth.x_m;
    ask(
        place_m > KERB_M + 0.3 || (place_m > KERB_M - 0.3 && told),
        format!("it ends at {place_m:.2} m, stall told: {told}"),
    );
    let (camera, scales) = (
        vehicle.camera().expect("a spar"),
        vehicle.spar_scales().expect("a spar"),
    );
    let blow_m_s = blow_m_s(rows, &camera, scales.time_s);
    let spar_deg = most(rows, |row| row.truth.spar_rad.abs()).to_degrees();
    ask(
        spar_deg <= unforeseen_deg(blow_m_s),
        format!("spar {spar_deg:.1} deg after a blow of {blow_m_s:.2} m/s"),
    );
    KerbDrive {
        complaints,
        excess_m_s: fastest_m_s,
        falling_excess_m_s: fastest_falling_m_s - allowed_falling_m_s,
        comes_over: place_m > KERB_M + 0.3,
    }
}
