//! Drives over one kerb or ledge, and what is asked of them.

use model::dynamics::camera::CameraParameters;
use model::supervise::arming::Mode;
use model::supervise::codes::{FaultSet, Limit};
use model::vehicle::GRAVITY_M_S2;
use virtual_board::scenario::trace::TraceRow;

use super::reference;
use super::slopes::{drive, from, most};

/// The spar's largest tilt where a ballast can keep it level, deg.
pub const LEVEL_DEG: f64 = 2.0;
/// The largest angle of the ballast by which it can, rad: there it has 0.4 of its lever left.
pub const NEEDED_MAX_RAD: f64 = 1.15;
/// Speed over the command that is allowed behind an obstacle, m/s.
const OVERSPEED_M_S: f64 = 0.5;
/// The same beyond what the fall from a ledge gives by itself: to brake, the arm swings back, which pushes the wheels
/// forward first.
const PUSH_M_S: f64 = 0.2;
/// Where the kerb stands, m.
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

/// The largest angle to which a ballast would have to swing to keep the spar level through the axle's true motion, from a
/// second before the spar's largest tilt on: the spar's equation (7.12) with the spar at rest, solved for the ballast. A
/// ballast that would have to swing beyond a quarter turn cannot keep it level, whatever its motor gives.
pub fn needed_rad(rows: &[TraceRow], camera: &CameraParameters<f64>, slope_deg: f64, time_s: f64) -> f64 {
    let c = camera.coefficients();
    let worst = (0..rows.len())
        .max_by(|a, b| rows[*a].truth.spar_rad.abs().total_cmp(&rows[*b].truth.spar_rad.abs()))
        .expect("rows");
    let first = worst.saturating_sub(100);
    let (mut angle, mut rate) = (
        rows[first].truth.ballast_rad,
        rows[first].truth.ballast_rate_rad_s * time_s,
    );
    let (sin_slope, cos_slope) = slope_deg.to_radians().sin_cos();
    let mut needed = 0.0_f64;
    for pair in rows[first..(worst + 20).min(rows.len())].windows(2) {
        let a = (pair[1].truth.speed_m_s - pair[0].truth.speed_m_s) / 0.01 / GRAVITY_M_S2;
        let arm_rate = pair[0].truth.phi_rate_rad_s * time_s;
        for _ in 0..10 {
            let h = 0.001 / time_s;
            let (sin, cos) = angle.sin_cos();
            let weight = (1.0 + a * sin_slope) * sin + a * cos_slope * cos;
            let pull = c.m3 * sin * rate * rate - c.k1 * a * cos_slope - c.k2 * weight + camera.zeta * arm_rate;
            rate += h * pull / (c.m2 + c.m3 * cos);
            angle += h * rate;
            needed = needed.max(angle.abs());
            if needed > core::f64::consts::FRAC_PI_2 {
                return needed;
            }
        }
    }
    needed
}

/// Drives the reference vehicle at `speed_m_s` up a slope of `slope_deg` over a step of `height_m`, and tells what is wrong
/// with it: nothing, if the vehicle comes over it or stops before it and says so, without a fault, no more than 0.5 m/s
/// too fast, but for what the fall over a ledge gives by itself, and with its spar as level as a ballast can keep it.
pub fn complaints(speed_m_s: f64, height_m: f64, slope_deg: f64) -> Vec<String> {
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
    // The axle falls on an arc about the ledge's edge, and further down with the slope until the wheel meets the ground.
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
    ask(
        fastest_falling_m_s <= OVERSPEED_M_S.max(fallen_m_s - speed_m_s + PUSH_M_S),
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
    let needed = needed_rad(rows, &camera, slope_deg, scales.time_s);
    ask(
        spar_deg <= LEVEL_DEG || needed > NEEDED_MAX_RAD,
        format!(
            "spar {spar_deg:.1} deg after a blow of {blow_m_s:.2} m/s, which asks for {needed:.2} rad of the ballast"
        ),
    );
    complaints
}
