//! The steering loop: steps of the yaw rate, drives that differ from left to right, ground that does.

use model::supervise::arming::Mode;
use model::supervise::codes::FaultSet;
use virtual_board::scenario::trace::TraceRow;

mod support;
use support::flights::{fly, last};
use support::generated::shown;
use support::reference;
use support::slopes::{drive, from, most};

/// Yaw rate of the steps, rad/s, and the acceleration on the way there, rad/s^2, as the reference file has it.
const STEP_RAD_S: f64 = 1.5;
const ACCELERATION_RAD_S2: f64 = 4.0;

/// Time from the first of `rows` until the yaw rate stays within 2 % of the step of `aim_rad_s`, s.
fn settles_s(rows: &[TraceRow], aim_rad_s: f64) -> f64 {
    let off = |row: &TraceRow| (row.truth.yaw_rate_rad_s - aim_rad_s).abs() > 0.02 * STEP_RAD_S;
    let late = rows.iter().rposition(off).map_or(0, |late| late + 1);
    0.01 * late as f64
}

/// Steps of the yaw rate to 1.5 rad/s and back to none, on the spot and driving, to both sides: with drives as the file says,
/// with motors that differ by 20 % from it, one each way, and with wheels whose radii differ by 10 %. The ramp takes
/// 0.375 s, so that less is a mistake; the yaw rate settles within 0.1 s of its end, and overshoots by 2 % at most.
#[test]
fn steps_of_the_yaw_rate_land_without_overshoot_whatever_the_drives() {
    let ramp_s = STEP_RAD_S / ACCELERATION_RAD_S2;
    let [mut worst_over, mut latest_s] = [0.0_f64; 2];
    for (name, drives) in [
        ("sound", ""),
        (
            "torque constants",
            "plant.left = { torque_constant_factor = 0.8 }\nplant.right = { torque_constant_factor = 1.2 }",
        ),
        (
            "resistances",
            "plant.left = { resistance_factor = 1.2 }\nplant.right = { resistance_factor = 0.8 }",
        ),
        (
            "back-EMF",
            "plant.left = { back_emf_factor = 0.8 }\nplant.right = { back_emf_factor = 1.2 }",
        ),
        (
            "friction",
            "plant.left = { friction_factor = 4.0 }\nplant.right = { friction_factor = 0.0 }",
        ),
        (
            "radii",
            "plant.left = { wheel_radius_factor = 0.95 }\nplant.right = { wheel_radius_factor = 1.05 }",
        ),
    ] {
        for (speed_m_s, yaw_rad_s) in [(0.0, STEP_RAD_S), (1.0, -STEP_RAD_S)] {
            let steps = format!(
                "{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?} }},
                 {{ at_s = 7.0, action = 'drive', speed_m_s = {speed_m_s:?}, yaw_rate_rad_s = {yaw_rad_s:?} }},
                 {{ at_s = 10.0, action = 'drive', speed_m_s = {speed_m_s:?} }}"
            );
            let outcome = fly(13.0, 1, drives, &steps);
            let (straight, back) = (from(&outcome, 4.0), from(&outcome, 10.0));
            let turn = from(&outcome, 7.0);
            let straight = &straight[..straight.len() - turn.len()];
            let turn = &turn[..turn.len() - back.len()];
            let way = f64::signum(yaw_rad_s);
            let over = most(turn, |row| way * row.truth.yaw_rate_rad_s / STEP_RAD_S - 1.0);
            let under = most(back, |row| -way * row.truth.yaw_rate_rad_s / STEP_RAD_S);
            let (to_s, from_s) = (settles_s(turn, yaw_rad_s), settles_s(back, 0.0));
            let off_deg = most(straight, |row| row.truth.heading_rad.abs()).to_degrees();
            let story = format!("{name}, {speed_m_s} m/s, {yaw_rad_s} rad/s");
            println!(
                "{story}: over {over:.4} and {under:.4}, settles in {to_s:.2} and {from_s:.2} s; {off_deg:.2} deg off before"
            );
            assert!(over <= 0.02 && under <= 0.02, "{story}: {over} {under}");
            for settles in [to_s, from_s] {
                assert!(
                    settles > 0.9 * ramp_s && settles <= ramp_s + 0.1,
                    "{story}: {settles} s"
                );
            }
            // Over its own length that is a hundredth of the track.
            assert!(off_deg < 0.6, "{story}: {off_deg} deg");
            let status = last(&outcome).status;
            assert_eq!((status.mode, status.faults), (Mode::Armed, FaultSet::EMPTY), "{story}");
            worst_over = worst_over.max(over).max(under);
            latest_s = latest_s.max(to_s).max(from_s);
        }
    }
    shown(
        "steps of the yaw rate",
        &format!(
            "settles within {latest_s:.2} s, of which its ramp takes {ramp_s:.2} s; overshoot {:.1} %",
            100.0 * worst_over
        ),
    );
}

/// One wheel on ice and one on rubber, level and on 5 deg: the vehicle keeps its heading to 2 deg while it speeds up and
/// stops, which over its own length is 17 mm, a quarter of a rail's head; and comes back to 0.5 deg. To keep it, the wheel on
/// ice must spin by up to 2.8 m/s, whose back-EMF, 7.3 V of difference, takes an integral of the yaw rate of
/// 7.3 V / `yaw_ki_v_per_rad`, or 4.2 deg, less what the heading hold asks for. Uphill on 5 deg, ice of 0.1 leaves the pair
/// 0.12 m/s^2 without a moment about the vertical.
#[test]
fn split_friction_keeps_the_heading() {
    let [mut most_deg, mut last_deg] = [0.0_f64; 2];
    for (left, right, slope_deg, reaches_m_s) in [
        (0.1, 0.9, 0.0, 1.4),
        (0.9, 0.1, 0.0, 1.4),
        (0.2, 0.8, 5.0, 1.4),
        (0.8, 0.2, -5.0, 1.4),
        (0.1, 0.9, 5.0, 0.4),
        (0.9, 0.1, -5.0, 1.4),
    ] {
        let ground = format!("terrain.friction = {{ left = {left:?}, right = {right:?} }}");
        let steps = "{ at_s = 6.0, action = 'drive', speed_m_s = 1.5 }, { at_s = 11.0, action = 'drive' }";
        let outcome = drive(&reference(), 16.0, slope_deg, &ground, steps);
        let off_deg = |row: &TraceRow| row.truth.heading_rad.to_degrees().abs();
        let (worst_deg, end_deg) = (most(&outcome.trace.rows, off_deg), most(from(&outcome, 15.0), off_deg));
        let fastest_m_s = most(&outcome.trace.rows, |row| row.truth.speed_m_s);
        let story = format!("friction {left} and {right} on {slope_deg} deg");
        println!("{story}: {worst_deg:.2} deg, at the end {end_deg:.2} deg");
        assert!(fastest_m_s > reaches_m_s, "{story}: it drives: {fastest_m_s} m/s");
        assert!(
            worst_deg <= 2.0 && end_deg <= 0.5,
            "{story}: {worst_deg} deg, {end_deg} deg"
        );
        let last = last(&outcome).status;
        assert_eq!((last.mode, last.faults), (Mode::Armed, FaultSet::EMPTY), "{story}");
        most_deg = most_deg.max(worst_deg);
        last_deg = last_deg.max(end_deg);
    }
    shown(
        "friction of 0.1 and 0.9",
        &format!(
            "heading within {most_deg:.1} deg while it speeds up to 1.5 m/s and stops, then back to {last_deg:.2} deg"
        ),
    );
}
