//! Pushes on slopes that throw the arm beyond its largest angle: the vehicle brings it back and drives on.

use model::supervise::arming::Mode;
use model::supervise::codes::{Fault, FaultSet};
use model::vehicle::Vehicle;
use virtual_board::scenario::DriveOutcome;
use virtual_board::scenario::trace::TraceRow;

mod support;
use support::flights::{first, last};
use support::generated::shown;
use support::reference;
use support::slopes::{changed, drive, from, most, small};

/// When the push comes, s, and the length of a drive.
const PUSHED_S: f64 = 8.0;
const LENGTH_S: f64 = 20.0;
/// The speed at which the vehicle returns to its place at most, and the noise of a steady drive, m/s.
const STEADY_M_S: f64 = 0.2;

/// A push at the axle of a vehicle that drives, up the slope positive.
#[derive(Debug, Clone, Copy)]
struct Push {
    slope_deg: f64,
    newtons: f64,
    for_s: f64,
    speed_m_s: f64,
}

impl Push {
    fn fly(&self, vehicle: &Vehicle<f64>, tables: &str) -> DriveOutcome {
        let Self {
            slope_deg,
            newtons,
            for_s,
            speed_m_s,
        } = *self;
        let steps = format!(
            "{{ at_s = 5.0, action = 'drive', speed_m_s = {speed_m_s:?} }},
             {{ at_s = {PUSHED_S:?}, action = 'push', on = 'axle', forward_n = {newtons:?}, for_s = {for_s:?} }}"
        );
        drive(vehicle, LENGTH_S, slope_deg, tables, &steps)
    }

    /// Asserts that no fault opens the bridges and that the vehicle drives on as commanded, in the time and on the way that the
    /// push's speed explains. The law brakes with 0.9 of `grip_mu` less what the slope takes of it; before that, the observer has
    /// to forget the push that it took for a slope and the arm has to swing round, in 1.5 s. The result: the drive, and the latest time after
    /// the push at which the vehicle was not as fast as commanded, s.
    fn assert_back(&self, vehicle: &Vehicle<f64>, tables: &str) -> (DriveOutcome, f64) {
        let outcome = self.fly(vehicle, tables);
        let story = format!("{self:?} {tables:?}");
        let end = last(&outcome);
        assert_eq!(
            (end.status.mode, end.status.faults),
            (Mode::Armed, FaultSet::EMPTY),
            "{story}"
        );
        let way = self.newtons.signum();
        let pushed = from(&outcome, PUSHED_S);
        let before = &pushed[0];
        let gained_m_s = most(pushed, |row| way * (row.truth.speed_m_s - self.speed_m_s));
        let slope = self.slope_deg.to_radians();
        let grip = 0.9 * vehicle.parameters().control.grip_mu;
        let braking_m_s2 = 9.81 * (grip * slope.cos() + way * slope.sin()).min(2.0 / 9.81);
        let astray = |row: &&TraceRow| (row.truth.speed_m_s - self.speed_m_s).abs() > STEADY_M_S;
        let back_s = pushed
            .iter()
            .rev()
            .find(astray)
            .map_or(0.0, |row| row.time_s() - PUSHED_S - self.for_s);
        // Later, a vehicle that stands returns to its place.
        let meanwhile = &pushed[..pushed.partition_point(|row| row.time_s() <= PUSHED_S + self.for_s + back_s)];
        let further_m = most(meanwhile, |row| {
            way * (row.truth.x_m - before.truth.x_m - self.speed_m_s * (row.time_s() - PUSHED_S))
        });
        // A vehicle that is 20 % off takes up to 1 / 0.8 of the time and the way.
        let off = if tables.contains("plant") { 1.25 } else { 1.0 };
        let most_s = off * (3.0 + gained_m_s / braking_m_s2);
        let most_m = off * (gained_m_s * (self.for_s + 1.5) + 0.5 * gained_m_s * gained_m_s / braking_m_s2);
        println!(
            "{story}: {gained_m_s:.2} m/s, back after {back_s:.2} of {most_s:.2} s, {further_m:.2} of {most_m:.2} m"
        );
        assert!(back_s < most_s, "{story}: {back_s} of {most_s} s");
        assert!(further_m < most_m, "{story}: {further_m} of {most_m} m");
        (outcome, back_s)
    }
}

/// The speed of a vehicle that its motors turn without load at their largest voltage, m/s.
fn no_load_m_s(vehicle: &Vehicle<f64>) -> f64 {
    let p = vehicle.parameters();
    let per_rad = p.drive_motor.back_emf_constant_v_s_per_rad * p.drive_motor.gear_ratio;
    0.94 * p.battery.nominal_v / per_rad * p.body.wheel_radius_m
}

/// Pushes that make the vehicle a little faster than its motors can turn: until it has slowed down they have no torque to hold the
/// arm, which swings up to 120 deg. The barrier and the arm's weight bring it back, up and down slopes of up to 25 deg, forward and
/// backward, and the vehicle drives on as commanded without a fault.
#[test]
fn an_arm_thrown_beyond_its_largest_angle_comes_back_and_the_vehicle_drives_on() {
    let (mut furthest_rad, mut latest_s) = (0.0_f64, 0.0_f64);
    for (slope_deg, newtons, for_s, speed_m_s) in [
        (0.0, 300.0, 0.3, 0.0),
        (0.0, 200.0, 0.3, 2.0),
        (5.0, 250.0, 0.3, 1.0),
        (10.0, 300.0, 0.3, 0.0),
        (15.0, 300.0, 0.3, 0.0),
        (20.0, 300.0, 0.3, 1.0),
        (-5.0, 250.0, 0.3, 0.0),
        (-10.0, 200.0, 0.3, 1.0),
        (-15.0, 150.0, 0.3, 2.0),
        (-20.0, 200.0, 0.3, 0.0),
        (-25.0, 200.0, 0.3, 0.0),
    ] {
        for (way, seed) in [(1.0, 1), (-1.0, 2)] {
            let push = Push {
                slope_deg: way * slope_deg,
                newtons: way * newtons,
                for_s,
                speed_m_s: way * speed_m_s,
            };
            let (outcome, back_s) = push.assert_back(&reference(), &format!("seed = {seed}"));
            let arm_rad = most(from(&outcome, PUSHED_S), |row| row.truth.phi_rad.abs());
            assert!(arm_rad > 1.42, "{push:?}: {arm_rad} rad");
            furthest_rad = furthest_rad.max(arm_rad);
            latest_s = latest_s.max(back_s);
        }
    }
    shown(
        "pushed on slopes of up to 25 deg, so that the arm swings beyond 80 deg",
        &format!(
            "comes back from {:.0} deg at most; no fault; as commanded within {latest_s:.1} s of the push",
            furthest_rad.to_degrees()
        ),
    );
}

/// Differences between the simulated vehicle and its file, in TOML: play of the gears, and masses, lengths and motors 20 % off.
const PLANTS: [&str; 5] = [
    "",
    "plant.left = { backlash_deg = 1.0, gear_stiffness_n_m_per_rad = 3000.0 }
     plant.right = { backlash_deg = 1.0, gear_stiffness_n_m_per_rad = 3000.0 }",
    "plant.vehicle = { body = { total_mass_kg = 16.3, arm_mass_kg = 14.7 } }",
    "plant.vehicle = { body = { arm_length_m = 0.17 } }",
    "plant.vehicle = { drive_motor = { torque_constant_n_m_per_a = 0.025, resistance_ohm = 0.38 } }",
];

/// Every push after which the motors can still turn as fast as the wheels: of the reference vehicle, also without its spar, with
/// play and 20 % off, and of the small vehicle.
#[test]
fn a_push_within_the_motors_speed_ends_at_the_command() {
    let (mut drives, mut latest_s) = (0, 0.0_f64);
    let bare = changed(|p| p.spar = None);
    for (vehicle, plants, kilograms) in [
        (reference(), &PLANTS[..], 13.6),
        (bare, &PLANTS[..1], 13.6),
        (small(), &PLANTS[..2], 3.0),
    ] {
        for (n, plant) in plants.iter().enumerate() {
            for (k, slope_deg) in [-25.0, -20.0, -10.0, -5.0, 5.0, 10.0, 20.0, 25.0]
                .into_iter()
                .enumerate()
            {
                if n > 0 && k % 2 == n % 2 {
                    continue;
                }
                if plant.contains("arm_length_m") && f64::abs(slope_deg) > 20.0 {
                    // With a shorter arm it hardly stands on 25 deg.
                    continue;
                }
                for (gain_m_s, for_s) in [(0.3, 0.1), (1.8, 0.3), (-0.3, 0.1), (-1.8, 0.3)] {
                    // Up 25 deg the vehicle gains its speed slowly; there it stands.
                    let speed_m_s = if f64::abs(slope_deg) > 20.0 {
                        0.0
                    } else {
                        [0.0, 0.3, -0.5][(n + k) % 3]
                    };
                    let push = Push {
                        slope_deg,
                        newtons: kilograms * gain_m_s / for_s,
                        for_s,
                        speed_m_s,
                    };
                    let (outcome, back_s) = push.assert_back(&vehicle, &format!("seed = {}\n{plant}", 1 + k % 3));
                    let fastest_m_s = most(from(&outcome, PUSHED_S), |row| row.truth.speed_m_s.abs());
                    assert!(fastest_m_s < no_load_m_s(&vehicle), "{push:?}: {fastest_m_s} m/s");
                    latest_s = latest_s.max(back_s);
                    drives += 1;
                }
            }
        }
    }
    shown(
        "pushed on slopes of 5 to 25 deg, up and down, within the motors' speed",
        &format!("no fault in {drives} drives of both vehicles; as commanded within {latest_s:.1} s of the push"),
    );
}

/// Pushes down a slope after which the vehicle is by far faster than its motors can turn. No motor can hold the arm: it turns over.
/// The status reports ArmAngle and the bridges open before the arm has turned over.
#[test]
fn an_arm_that_cannot_come_back_is_told_and_the_bridges_open() {
    for (slope_deg, newtons, speed_m_s) in [(-10.0, 300.0, 1.0), (20.0, -300.0, 0.0), (-25.0, 300.0, 0.0)] {
        let push = Push {
            slope_deg,
            newtons,
            for_s: 0.3,
            speed_m_s,
        };
        let outcome = push.fly(&reference(), "");
        let told = |row: &TraceRow| row.status.faults.contains(Fault::ArmAngle);
        let told_s = first(&outcome, PUSHED_S, told).expect("told");
        let row = &from(&outcome, PUSHED_S + told_s)[0];
        let fastest_m_s = most(from(&outcome, PUSHED_S), |row| row.truth.speed_m_s.abs());
        println!("{push:?}: told after {told_s:.2} s at {:.2} rad", row.truth.phi_rad);
        assert!(fastest_m_s > no_load_m_s(&reference()), "{push:?}");
        assert!(!row.bridges_on && row.status.mode == Mode::Disarmed, "{push:?}");
        assert!(told_s < 1.3 && row.truth.phi_rad.abs() < 2.8, "{push:?}: {told_s} s");
    }
}
