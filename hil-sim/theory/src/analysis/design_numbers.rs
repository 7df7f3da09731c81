//! The consequences of a vehicle file in SI and in the numbers of the theory.

use core::f64::consts::{PI, TAU};

use model::control::landing::{Design, SUPPLY_RESERVE, SUPPLY_SHARE};
use model::control::steering::STEERING_SHARE;
use model::sample::TICK_US;
use model::vehicle::{GRAVITY_M_S2, MotorParameters, SpeedLawChoice, TurningDrive, Vehicle};
use serde::Serialize;

use super::carrying::carrying;
use super::critical::{Direction, critical};
use super::input::Input;
use super::let_go::steepest_let_go;
use super::slip::slip_limit;

/// Slope for which the hold voltage is reported.
const HOLD_DEG: f64 = 10.0;

/// A number that follows from the file.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DesignNumber {
    /// Name of the number, unit included.
    pub name: &'static str,
    /// Value of the number; NaN if it does not exist.
    pub value: f64,
    /// Meaning of the number.
    pub meaning: &'static str,
}

/// The landing law's gains at the vehicle's tick.
pub fn flown_design(vehicle: &Vehicle<f64>) -> Design {
    Design::of(vehicle, f64::from(TICK_US) * 1e-6)
}

/// Torque constant at the gearbox's output, N m/A.
fn output_constant(motor: &MotorParameters<f64>) -> f64 {
    motor.torque_constant_n_m_per_a * motor.gear_ratio
}

/// The bounds of steering.
struct SteeringLimits {
    /// Yaw rate on the spot beyond which the hanging arm swings with growing amplitude, rad/s (erratum E26).
    spin_rad_s: f64,
    /// Yaw rate on the spot that steering's share of `nominal_v` sustains against back-EMF and bearings, rad/s.
    voltage_rad_s: f64,
    /// Yaw rate at `speed_max_m_s` whose centripetal force `grip_mu` gives, rad/s.
    grip_rad_s: f64,
    /// Yaw acceleration on the spot with both wheels at the limit of `grip_mu`, rad/s^2.
    grip_rad_s2: f64,
    /// Yaw acceleration on the spot with both motors at `current_limit_a`, rad/s^2.
    current_rad_s2: f64,
}

impl SteeringLimits {
    fn new(vehicle: &Vehicle<f64>) -> Self {
        let p = vehicle.parameters();
        let (body, motor, control) = (&p.body, &p.drive_motor, &p.control);
        let (track, radius) = (body.half_track_m, body.wheel_radius_m);
        // In a turn on the spot each wheel turns by half the track over its radius times the axle's turn, and its motor
        // overcomes half of the bearings' drag.
        let constant = output_constant(motor);
        let volts_per_rad_s = track / radius
            * (motor.back_emf_constant_v_s_per_rad * motor.gear_ratio
                + 0.5 * body.bearing_damping_n_m_s * motor.resistance_ohm / constant);
        let inertia = TurningDrive::new(p).inertia_kg_m2;
        let mass = 1.0 + vehicle.spar_mass_ratio();
        let weight = mass * body.total_mass_kg * GRAVITY_M_S2;
        let spin = vehicle.spatial(0.0, 0.0).carrying(mass).spin_stability_limit();
        Self {
            spin_rad_s: spin.map_or(f64::NAN, |limit| limit / vehicle.scales().time_s),
            voltage_rad_s: f64::from(STEERING_SHARE) * p.battery.nominal_v / volts_per_rad_s,
            grip_rad_s: control.grip_mu * GRAVITY_M_S2 / control.speed_max_m_s,
            grip_rad_s2: control.grip_mu * weight * track / inertia,
            current_rad_s2: 2.0 * motor.current_limit_a * constant * track / (radius * inertia),
        }
    }
}

/// Every number.
#[allow(clippy::too_many_lines)] // A table: a row for each number.
pub fn design_numbers(vehicle: &Vehicle<f64>) -> Vec<DesignNumber> {
    let p = vehicle.parameters();
    let (body, motor, battery, control) = (&p.body, &p.drive_motor, &p.battery, &p.control);
    let (level, scales) = (vehicle.planar(0.0), vehicle.scales());
    let mass = 1.0 + vehicle.spar_mass_ratio();
    let al = level.alpha * level.l;
    let static_limit = |sin_phi: f64| (al * sin_phi / mass).min(1.0).asin().to_degrees();
    let within_phi_max = p.safety.phi_max_rad.min(PI / 2.0);
    let traction = control.grip_mu.atan().to_degrees();
    let hold_torque = mass * scales.torque_n_m * HOLD_DEG.to_radians().sin();
    let constant = output_constant(motor);
    let hold_a = hold_torque / (2.0 * constant);
    // The voltage that holds the vehicle on a slope is proportional to the slope's sine.
    let hold_v =
        |slope_deg: f64| hold_a * motor.resistance_ohm * slope_deg.to_radians().sin() / HOLD_DEG.to_radians().sin();
    // The slope that a constant current holds indefinitely.
    let held_slope_deg = |current_a: f64| {
        let sine = current_a / hold_a * HOLD_DEG.to_radians().sin();
        sine.min(1.0).asin().to_degrees()
    };
    let no_load = battery.nominal_v / (motor.back_emf_constant_v_s_per_rad * motor.gear_ratio) * body.wheel_radius_m;
    // In steady motion on the level the joint turns at the wheel's rate, and U = zeta theta'.
    let speed_volts = |speed_m_s: f64| level.zeta * speed_m_s / scales.speed_m_s * scales.voltage_v;
    let reserve_v = match vehicle.speed_law() {
        SpeedLawChoice::Landing => f64::from(SUPPLY_RESERVE) * scales.voltage_v,
        SpeedLawChoice::SwingDamped => 0.0,
    };
    let speed_at = |supply_v: f64| ((f64::from(SUPPLY_SHARE) * supply_v - reserve_v) / speed_volts(1.0)).max(0.0);
    let whole_inertia = mass + level.mu;
    let (sin_max, cos_max) = (within_phi_max.sin(), within_phi_max.cos());
    let by_arm = al * sin_max / (whole_inertia - al * cos_max) * GRAVITY_M_S2;
    let torque_limit = 2.0 * motor.current_limit_a * constant;
    let by_current = torque_limit / (whole_inertia * body.total_mass_kg * body.wheel_radius_m);
    let start = [0.0; 3];
    // Everything on the axle adds weight and inertia.
    let (loaded, unit_v) = (carrying(&level, mass), mass * scales.voltage_v);
    let whirl = critical(&loaded, &Input::voltage_step(&loaded, 0.0), start, Direction::Forward);
    let whirl_v = whirl.ok().flatten().map_or(f64::NAN, |c| c.value * unit_v);
    let slip = slip_limit(&loaded, control.grip_mu).ok();
    let slip_v = { slip.and_then(|s| s.critical_voltage) }.map_or(f64::NAN, |u| u * unit_v);
    let let_go = steepest_let_go(&loaded).unwrap_or(f64::NAN);
    let swing_hz = (al / (al * level.l + level.nu)).sqrt() / (TAU * scales.time_s);
    let tick = f64::from(TICK_US) * 1e-6 / scales.time_s;
    let servo = f64::from(flown_design(vehicle).servo);
    let counts_per_m = motor.encoder_counts_per_rev * motor.gear_ratio / (TAU * body.wheel_radius_m);
    let steering = SteeringLimits::new(vehicle);
    let number = |name, value, meaning| DesignNumber { name, value, meaning };
    vec![
        number("mass_kg", mass * body.total_mass_kg, "whole mass, spar included"),
        number("alpha", level.alpha, "arm's share of the mass without the spar"),
        number("l", level.l, "arm's length over the wheel's radius"),
        number("mu", level.mu, "inertia of the wheels"),
        number("nu", level.nu, "inertia of the rotors"),
        number("zeta", level.zeta, "damping, back-EMF included"),
        number("time_unit_s", scales.time_s, "time unit of the theory"),
        number("speed_unit_m_s", scales.speed_m_s, "speed unit"),
        number("voltage_unit_v", scales.voltage_v, "voltage unit: U = 1"),
        number("torque_unit_n_m", scales.torque_n_m, "torque unit"),
        number(
            "static_limit_deg",
            static_limit(1.0),
            "slope that the level arm carries",
        ),
        number(
            "static_limit_within_phi_max_deg",
            static_limit(sin_max),
            "slope that the arm carries within phi_max_rad",
        ),
        number(
            "static_limit_v",
            hold_v(static_limit(1.0)),
            "voltage of each motor to hold on the slope that the level arm carries",
        ),
        number("grip_limit_deg", traction, "slope that grip_mu holds"),
        number(
            "grip_limit_v",
            hold_v(traction),
            "voltage of each motor to hold on the slope that grip_mu holds",
        ),
        number(
            "hold_current_10_deg_a",
            hold_a,
            "current of each motor to hold on 10 deg",
        ),
        number(
            "hold_voltage_10_deg_v",
            hold_a * motor.resistance_ohm,
            "voltage of each motor to hold on 10 deg",
        ),
        number(
            "continuous_slope_deg",
            held_slope_deg(motor.continuous_current_a),
            "slope on which continuous_current_a holds for ever",
        ),
        number(
            "bridge_slope_deg",
            held_slope_deg(motor.bridge_continuous_a),
            "slope on which bridge_continuous_a holds for ever",
        ),
        number("no_load_speed_m_s", no_load, "speed at nominal_v without any load"),
        number(
            "speed_max_voltage_v",
            speed_volts(control.speed_max_m_s),
            "voltage to keep speed_max_m_s on the level",
        ),
        number(
            "speed_at_nominal_v_m_s",
            speed_at(battery.nominal_v),
            "speed on the level that 97 % of nominal_v keeps, less what the law leaves to the arm",
        ),
        number(
            "speed_at_minimum_v_m_s",
            speed_at(battery.minimum_v),
            "the same of minimum_v",
        ),
        number(
            "torque_limit_n_m",
            torque_limit,
            "torque of both motors at current_limit_a",
        ),
        number(
            "stall_current_a",
            battery.nominal_v / motor.resistance_ohm,
            "current of a motor that stands, at nominal_v",
        ),
        number(
            "acceleration_by_arm_m_s2",
            by_arm,
            "largest steady acceleration within phi_max_rad",
        ),
        number(
            "acceleration_by_grip_m_s2",
            control.grip_mu * GRAVITY_M_S2,
            "largest acceleration that grip_mu allows",
        ),
        number(
            "acceleration_by_current_m_s2",
            by_current,
            "largest acceleration at current_limit_a",
        ),
        number(
            "yaw_rate_by_spin_rad_s",
            steering.spin_rad_s,
            "yaw rate on the spot beyond which the hanging arm swings ever wider",
        ),
        number(
            "yaw_rate_by_voltage_rad_s",
            steering.voltage_rad_s,
            "yaw rate on the spot that half of nominal_v keeps",
        ),
        number(
            "yaw_rate_by_grip_rad_s",
            steering.grip_rad_s,
            "yaw rate at speed_max_m_s that grip_mu holds",
        ),
        number(
            "yaw_acceleration_by_grip_rad_s2",
            steering.grip_rad_s2,
            "largest yaw acceleration on the spot that grip_mu allows",
        ),
        number(
            "yaw_acceleration_by_current_rad_s2",
            steering.current_rad_s2,
            "largest yaw acceleration on the spot at current_limit_a",
        ),
        number(
            "whirl_step_v",
            whirl_v,
            "smallest voltage step from rest that turns the arm over, on the level",
        ),
        number(
            "slip_step_v",
            slip_v,
            "largest voltage step from rest that grip_mu holds, on the level",
        ),
        number(
            "whirl_slope_deg",
            let_go.to_degrees(),
            "steepest slope on which the voltage that holds, put on with the arm hanging, does not turn it over",
        ),
        number(
            "whirl_slope_v",
            hold_v(let_go.to_degrees()),
            "that voltage, of each motor",
        ),
        number("arm_swing_hz", swing_hz, "frequency of the arm's free swing"),
        number("tick_time_units", tick, "the tick in time units"),
        number(
            "servo_hz",
            servo / (TAU * scales.time_s),
            "double pole of the landing law's arm servo",
        ),
        number("encoder_count_mm", 1e3 / counts_per_m, "way of a count at the rim"),
        number(
            "encoder_rate_hz",
            counts_per_m * control.speed_max_m_s,
            "counts per second at speed_max_m_s",
        ),
        number(
            "yaw_kp_v_s_per_rad",
            control.yaw_kp_v_s_per_rad,
            "gain of the yaw loop, given or by rule",
        ),
        number(
            "yaw_ki_v_per_rad",
            control.yaw_ki_v_per_rad,
            "integral gain of the yaw loop, given or by rule",
        ),
        number(
            "heading_kp_per_s",
            control.heading_kp_per_s,
            "gain of the heading hold, given or by rule",
        ),
        number(
            "hold_kp_per_s",
            control.hold_kp_per_s,
            "gain of the position hold, given or left out",
        ),
        number(
            "ballast_voltage_max_v",
            p.ballast_motor().map_or(f64::NAN, |_| control.ballast_voltage_max_v),
            "largest voltage on the ballast motor, given or by rule",
        ),
    ]
}
