//! A vehicle's design in SI, and checks whether it can be built and driven.
//!
//! The vehicle file's ranges refuse values that no vehicle has. This module checks relations between values: it
//! computes their consequences for the vehicle, and reports combinations that are impossible (an error) or doubtful (a
//! warning).

mod demands;

use core::f64::consts::PI;

use model::control::landing::Design;
use model::control::speed_law::SpeedLaw;
use model::dynamics::planar::PlanarParameters;
use model::vehicle::{SpeedLawChoice, Vehicle};
use serde::Serialize;

use super::carrying::carrying;
use super::design_numbers::{DesignNumber, design_numbers, flown_design};
use super::equilibrium::poles;
use super::landing_poles::landing_poles;
use super::sampled::{Factors, SampledPlant};

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Severity {
    /// The value is doubtful.
    Warning,
    /// Such a vehicle cannot be built, or cannot be driven.
    Error,
}

/// A finding about a design.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DesignFinding {
    /// How bad the finding is.
    pub severity: Severity,
    /// The field to look at first.
    pub field: &'static str,
    /// The error with its numbers, and a right value.
    pub text: String,
}

/// The consequences of a vehicle file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DesignCheck {
    /// Numbers in SI, and the theory's nondimensional numbers.
    pub numbers: Vec<DesignNumber>,
    /// Poles of Eq. 3.25 with the file's own gains, on the level, in 1/s: real and imaginary part.
    pub poles_eq_3_25_per_s: Vec<[f64; 2]>,
    /// Poles of the vehicle under the landing law while it drives on the level, in 1/s: real and imaginary part, the
    /// slowest first, from a linearisation of the vehicle's own law. `None` if a pole is not finite.
    pub poles_landing_per_s: Option<Vec<[f64; 2]>>,
    /// The design poles of the landing law, in 1/s, without the effects of filter, tick and delay.
    pub poles_landing_designed_per_s: Vec<f64>,
    /// The findings.
    pub findings: Vec<DesignFinding>,
}

impl DesignCheck {
    /// The number of this name.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.numbers.iter().find(|n| n.name == name).map(|n| n.value)
    }

    /// The findings of one severity.
    pub fn of(&self, severity: Severity) -> impl Iterator<Item = &DesignFinding> {
        self.findings.iter().filter(move |finding| finding.severity == severity)
    }
}

/// Torque and back-EMF constants that differ by more than this share cannot belong to one motor: they are the same
/// constant in SI, and data sheets state each within some per cent.
const CONSTANTS_SHARE: f64 = 0.1;
/// Share of `m r^2` of a wheel with all its mass in the rim; no wheel has more inertia.
const RIM: f64 = 1.0;
/// A spoked wheel with its tyre has about 0.7 `m r^2`, a disc 0.5. Below this share the stated masses are too large or
/// the inertia is too small.
const DISC: f64 = 0.3;
/// Electrical time constant of a drive motor, ms, above which its encoder seems to contradict voltage and current:
/// three ticks.
const ELECTRICAL_MAX_MS: f64 = 3.0;
/// Largest rate that one count of an encoder may cause behind the wheel rates' filter, over the speed unit.
const COUNT_SHARE_MAX: f64 = 0.3;
/// A slope that occurs on every floor: a ramp of 1 in 12.
const RAMP_DEG: f64 = 4.8;
/// Slowest pole of the arm servo, per time unit: with a slower pole the servo is slower than the arm's own swing.
const SLOWEST_SERVO: f64 = 1.0;

/// Computes the consequences of the vehicle file and its findings.
pub fn check(vehicle: &Vehicle<f64>) -> DesignCheck {
    let numbers = design_numbers(vehicle);
    let (level, law) = own_law(vehicle);
    let per_s = 1.0 / vehicle.scales().time_s;
    let poles_eq_3_25_per_s: Vec<[f64; 2]> = poles(&level, 0.0, Some(&law))
        .iter()
        .map(|pole| pole.map(|part| part * per_s))
        .collect();
    let design = flown_design(vehicle);
    let mut checked = DesignCheck {
        numbers,
        poles_eq_3_25_per_s,
        poles_landing_per_s: landing_poles(vehicle, &SampledPlant::new(vehicle, &Factors::NONE, 0.0)),
        poles_landing_designed_per_s: designed(&design).map(|pole| -f64::from(pole) * per_s).to_vec(),
        findings: Vec::new(),
    };
    let mut inspector = Inspector {
        vehicle,
        checked: &checked,
        found: Vec::new(),
    };
    inspector.bodies();
    inspector.motors();
    inspector.drive();
    inspector.demands();
    inspector.laws();
    checked.findings = inspector.found;
    checked
}

/// Whether every motion of these poles decays.
pub fn are_stable(poles: &[[f64; 2]]) -> bool {
    poles.iter().all(|[re, _]| *re < 0.0)
}

/// The vehicle with all that rides on its axle, on the level, and Eq. 3.25 with the file's own gains for it.
fn own_law(vehicle: &Vehicle<f64>) -> (PlanarParameters<f64>, SpeedLaw<f64>) {
    let (mass, control) = (1.0 + vehicle.spar_mass_ratio(), &vehicle.parameters().control);
    let level = carrying(&vehicle.planar(0.0), mass);
    let law = SpeedLaw {
        feed_forward_zeta: level.zeta,
        alpha_l: level.alpha * level.l,
        kp: control.kp / mass,
        kd: control.kd / mass,
    };
    (level, law)
}

/// The poles of a design, the slowest first: landing speed, arm servo and rate observer, torque observer.
fn designed(design: &Design) -> [f32; 7] {
    let Design {
        servo,
        speed,
        torque_observer,
        rate_observer,
    } = *design;
    [
        speed,
        servo,
        servo,
        rate_observer,
        rate_observer,
        torque_observer,
        torque_observer,
    ]
}

/// Inspects a vehicle and collects the findings.
struct Inspector<'a> {
    vehicle: &'a Vehicle<f64>,
    checked: &'a DesignCheck,
    found: Vec<DesignFinding>,
}

impl Inspector<'_> {
    fn number(&self, name: &str) -> f64 {
        self.checked.number(name).unwrap_or(f64::NAN)
    }

    fn tell(&mut self, wrong: bool, severity: Severity, field: &'static str, text: String) {
        if wrong {
            self.found.push(DesignFinding { severity, field, text });
        }
    }

    /// Lengths, masses and inertias.
    fn bodies(&mut self) {
        let p = self.vehicle.parameters();
        let body = &p.body;
        let (arm, radius) = (body.arm_length_m, body.wheel_radius_m);
        self.tell(
            arm >= radius,
            Severity::Error,
            "body.arm_length_m",
            format!(
                "the arm's centre of mass hangs {arm} m below the axle, in the ground: the wheel's radius is {radius} m"
            ),
        );
        self.tell(
            arm < radius && arm > 0.9 * radius,
            Severity::Warning,
            "body.arm_length_m",
            format!(
                "only {:.0} mm of ground clearance remain below the arm's centre of mass, and the arm has a size",
                1e3 * (radius - arm)
            ),
        );
        let wheels = body.total_mass_kg - body.arm_mass_kg;
        let rim = wheels * radius * radius;
        self.tell(
        body.wheels_inertia_kg_m2 > RIM * rim,
        Severity::Error,
        "body.wheels_inertia_kg_m2",
        format!(
            "{} kg m^2 is more than wheels of {wheels:.3} kg and this radius can have, all of it in the rim: {rim:.4}",
            body.wheels_inertia_kg_m2
        ),
    );
        self.tell(
            body.wheels_inertia_kg_m2 < DISC * rim,
            Severity::Warning,
            "body.wheels_inertia_kg_m2",
            format!(
                "{} kg m^2 is little for wheels of {wheels:.3} kg: a disc has {:.4}",
                body.wheels_inertia_kg_m2,
                0.5 * rim
            ),
        );
        // In addition to the inertia of two points at the wheels' centres, a disc or a hoop has half of its axial
        // inertia about its diameter.
        let wheels_yaw = 0.5 * body.wheels_inertia_kg_m2;
        self.tell(
            body.yaw_inertia_kg_m2 < wheels_yaw,
            Severity::Warning,
            "body.yaw_inertia_kg_m2",
            format!(
                "{} kg m^2 is less than the wheels alone have about their diameters: {wheels_yaw:.4}",
                body.yaw_inertia_kg_m2
            ),
        );
        if let Some((spar, _)) = &p.spar {
            let below = spar.motor_distance_m + spar.ballast_distance_m;
            self.tell(
                below >= radius,
                Severity::Error,
                "spar.ballast_distance_m",
                format!("the ballast hangs {below} m below the axle, in the ground: the wheel's radius is {radius} m"),
            );
        }
    }

    /// The constants of the motors.
    fn motors(&mut self) {
        let p = self.vehicle.parameters();
        let motors = [
            ("drive_motor.torque_constant_n_m_per_a", Some(&p.drive_motor)),
            ("ballast_motor.torque_constant_n_m_per_a", p.ballast_motor()),
        ];
        for (field, motor) in motors {
            let Some(motor) = motor else { continue };
            let (torque, emf) = (motor.torque_constant_n_m_per_a, motor.back_emf_constant_v_s_per_rad);
            let ratio = torque / emf;
            self.tell(
            ratio > 1.0 + CONSTANTS_SHARE,
            Severity::Error,
            field,
            format!(
                "{torque} N m/A with a back-EMF of {emf} V s/rad gives {ratio:.2} times the power that it takes; the two \
                 are one constant in SI (a Kv of X rpm/V is 9.549/X)"
            ),
        );
            self.tell(
            ratio < 1.0 - CONSTANTS_SHARE,
            Severity::Warning,
            field,
            format!(
                "{torque} N m/A is {ratio:.2} of the back-EMF constant {emf} V s/rad; the two are one constant in SI"
            ),
        );
        }
    }

    /// What the vehicle can do on slopes and at speed.
    fn drive(&mut self) {
        let p = self.vehicle.parameters();
        let (battery, control) = (&p.battery, &p.control);
        let limit = self.number("static_limit_within_phi_max_deg");
        self.tell(
        limit < RAMP_DEG,
        Severity::Error,
        "body.arm_mass_kg",
        format!(
            "the arm is too light or too short to drive: it carries a slope of {limit:.1} deg, a ramp of 1 in 12 has {RAMP_DEG}"
        ),
    );
        let volts = self.number("speed_max_voltage_v");
        let [nominal, minimum] = ["speed_at_nominal_v_m_s", "speed_at_minimum_v_m_s"].map(|name| self.number(name));
        self.tell(
            control.speed_max_m_s > nominal,
            Severity::Error,
            "control.speed_max_m_s",
            format!(
                "{} m/s takes {volts:.1} V on the level, besides what the law leaves to the arm: with nominal_v {} V, \
                 {nominal:.2} m/s is the most",
                control.speed_max_m_s, battery.nominal_v,
            ),
        );
        self.tell(
            control.speed_max_m_s > minimum && control.speed_max_m_s <= nominal,
            Severity::Warning,
            "control.speed_max_m_s",
            format!(
                "{} m/s takes {volts:.1} V on the level, besides what the law leaves to the arm; an empty battery of {} V keeps \
                 {minimum:.2} m/s",
                control.speed_max_m_s, battery.minimum_v,
            ),
        );
        let motor = &p.drive_motor;
        let electrical_ms = 1e3 * motor.inductance_h / motor.resistance_ohm;
        self.tell(
            electrical_ms > ELECTRICAL_MAX_MS,
            Severity::Warning,
            "drive_motor.inductance_h",
            format!(
                "the armature's current follows its voltage within {electrical_ms:.1} ms, more than {ELECTRICAL_MAX_MS}: the check of the \
                 encoders takes it to follow at once"
            ),
        );
        let count_m_s = 1e-3 * self.number("encoder_count_mm") / p.estimator.wheel_rate_time_constant_s;
        self.tell(
            count_m_s > COUNT_SHARE_MAX * self.number("speed_unit_m_s"),
            Severity::Warning,
            "drive_motor.encoder_counts_per_rev",
            format!(
                "a count is {:.2} mm at the rim, and shows as {count_m_s:.2} m/s: too coarse to stand and creep by",
                self.number("encoder_count_mm")
            ),
        );
        let hold_a = self.number("hold_current_10_deg_a");
        self.tell(
            hold_a > p.drive_motor.current_limit_a,
            Severity::Error,
            "drive_motor.current_limit_a",
            format!(
                "holding on 10 deg takes {hold_a:.1} A of each motor, the limit is {} A",
                p.drive_motor.current_limit_a
            ),
        );
        self.tell(
            control.grip_mu > 1.0,
            Severity::Warning,
            "control.grip_mu",
            format!(
                "rubber on clean concrete has about 1, and the law plans with {}",
                control.grip_mu
            ),
        );
    }

    /// Limits and laws.
    fn laws(&mut self) {
        let p = self.vehicle.parameters();
        let control = &p.control;
        self.tell(
            p.safety.phi_max_rad > PI / 2.0,
            Severity::Warning,
            "safety.phi_max_rad",
            "beyond level the arm carries less the further it swings: the fault comes after the whirl has begun"
                .to_owned(),
        );
        let servo = f64::from(flown_design(self.vehicle).servo);
        self.tell(
        servo < SLOWEST_SERVO,
        Severity::Error,
        "estimator.wheel_rate_time_constant_s",
        format!(
            "the arm servo comes to {servo:.2} per time unit of {:.1} ms, slower than the arm swings: the tick is 1 ms, \
             the filter {} s",
            1e3 * self.number("time_unit_s"),
            p.estimator.wheel_rate_time_constant_s
        ),
    );
        let flown = self.vehicle.speed_law() == SpeedLawChoice::SwingDamped;
        let stable = self.checked.poles_landing_per_s.as_deref().is_some_and(are_stable);
        self.tell(
            !flown && !stable,
            Severity::Error,
            "control.law",
            "the landing law is unstable on this vehicle: a pole of its own is not negative".to_owned(),
        );
        self.tell(
            flown && !are_stable(&self.checked.poles_eq_3_25_per_s),
            Severity::Error,
            "control.kp",
            format!(
                "Eq. 3.25 with kp {} and kd {} is unstable on this vehicle",
                control.kp, control.kd
            ),
        );
    }
}
