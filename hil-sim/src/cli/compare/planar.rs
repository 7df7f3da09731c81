//! The step on the planar vehicle: every law without sensor noise, compared with the best step that a search finds.

use model::vehicle::Vehicle;
use plant::noise::Noise;
use serde::Serialize;
use theory::analysis::optimum::StepTask;
use theory::analysis::sampled::{Factors, SampledDrive, SampledPlant, SampledRow, SampledSensing};
use theory::analysis::settling::{Settling, SpeedSample};

use super::contenders::Contender;
use super::courses::steepest_rad;

/// One step.
#[derive(Debug, Clone, Serialize)]
pub struct PlanarStep {
    /// The law.
    pub law: &'static str,
    /// Settling, in time units of the vehicle and shares of the step.
    pub settling: Settling,
    /// Largest angle of the arm, deg.
    pub arm_peak_deg: f64,
    /// Largest ratio of friction to normal force: the grip that the step needs. Infinite if the wheels would leave the
    /// ground.
    pub grip_needed: f64,
    /// Whether the arm turned over.
    pub whirled: bool,
    /// Time, in time units, and speed, in speed units.
    #[serde(skip)]
    pub speed: (Vec<f64>, Vec<f64>),
}

/// The steps, and the references for them.
#[derive(Debug, Clone, Serialize)]
pub struct PlanarSteps {
    /// Slope, rad.
    pub slope_rad: f64,
    /// Final speed of the step from rest, m/s.
    pub target_m_s: f64,
    /// The vehicle's time unit, s.
    pub time_unit_s: f64,
    /// Least time from rest to rest in itself at that speed, in time units, by momentum alone; none where grip does not
    /// carry the slope.
    pub least_to_rest: Option<f64>,
    /// The steps.
    pub steps: Vec<PlanarStep>,
}

/// Slope of the thesis's step, rad; less if the vehicle cannot climb this slope with a margin.
const SLOPE_RAD: f64 = 0.0873;
const COURSE_SLOPE_SHARE: f64 = 0.5;
/// Length, in time units.
const DURATION: f64 = 80.0;
/// Largest share of the vehicle's largest speed for the step; otherwise one speed unit.
const SPEED_SHARE: f64 = 0.8;
/// Delay of a command, ticks.
const DELAY: usize = 1;

/// Drives the step.
pub fn steps(vehicle: &Vehicle<f64>, laws: &[Contender]) -> PlanarSteps {
    let scales = vehicle.scales();
    let slope_rad = SLOPE_RAD.min(COURSE_SLOPE_SHARE * steepest_rad(vehicle));
    let p = vehicle.parameters();
    let target = (SPEED_SHARE * p.control.speed_max_m_s / scales.speed_m_s).min(1.0);
    let plant = SampledPlant::new(vehicle, &Factors::NONE, slope_rad);
    let task = StepTask {
        plant,
        grip_mu: p.control.grip_mu,
        phi_max_rad: p.safety.phi_max_rad,
        target,
    };
    let drive = |told| SampledDrive {
        vehicle: told,
        plant,
        sensing: SampledSensing {
            delay: DELAY,
            noise: [0.0; 3],
        },
        targets: &[],
        duration: DURATION,
    };
    let mut steps = Vec::new();
    for law in laws {
        let targets = [(0.0, target)];
        let drive = SampledDrive {
            targets: &targets,
            ..drive(&law.told)
        };
        steps.push(measure(law.name, target, |see| drive.run(|| 0.0, see)));
    }
    // The hold voltage of the speed on this slope, switched on at once.
    let holding = (plant.zeta * target + plant.balance.mass * libm::sin(slope_rad)) / plant.torque_per_voltage;
    let open_v = scales.voltage_to_si(holding.min(plant.voltage_max)) as f32;
    steps.push(measure("open loop", target, |see| {
        drive(vehicle).run_under(|_| (open_v, 0.0), || 0.0, see);
    }));
    let mut noise = Noise::new(1, 0);
    if let Some(best) = task.best(|| noise.normal()) {
        steps.push(measure("best step found", target, |see| {
            for row in &best.rows {
                see(row);
            }
        }));
    }
    let least = task.time_to_rest();
    PlanarSteps {
        slope_rad,
        target_m_s: target * scales.speed_m_s,
        time_unit_s: scales.time_s,
        least_to_rest: least.is_finite().then_some(least),
        steps,
    }
}

/// Measures the rows that `fly` produces.
fn measure(law: &'static str, target: f64, fly: impl FnOnce(&mut dyn FnMut(&SampledRow) -> bool)) -> PlanarStep {
    let mut rows: Vec<SampledRow> = Vec::new();
    fly(&mut |row| {
        rows.push(*row);
        row.phi.abs() < WHIRLED_RAD
    });
    let most = |value: &dyn Fn(&SampledRow) -> f64| rows.iter().map(value).fold(0.0, f64::max);
    let shown = rows.iter().filter(|row| row.time <= SHOWN);
    PlanarStep {
        law,
        settling: Settling::of(
            rows.iter().map(|row| SpeedSample {
                time: row.time,
                speed: row.theta_rate,
            }),
            0.0,
            target,
        ),
        arm_peak_deg: most(&|row| row.phi.abs().to_degrees()),
        grip_needed: most(&|row| {
            if row.normal > 0.0 {
                row.friction.abs() / row.normal
            } else {
                f64::INFINITY
            }
        }),
        whirled: rows.iter().any(|row| row.phi.abs() >= WHIRLED_RAD),
        speed: (
            shown.clone().map(|row| row.time).collect(),
            shown.map(|row| row.theta_rate).collect(),
        ),
    }
}

/// The arm upside down, rad.
const WHIRLED_RAD: f64 = core::f64::consts::PI;
/// Time that the chart shows, in time units.
const SHOWN: f64 = 20.0;
