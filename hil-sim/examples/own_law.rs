//! A speed law of your own in the place of the model's, on the simulated vehicle without board and tasks:
//! `cargo run -p hil-sim --example own_law`.

use std::error::Error;

use firmware::drive_board::SCALES;
use plant::terrain::Terrain;
use plant::{BridgeState, Plant, Truth};

/// Period of the law, s.
const PERIOD_S: f64 = 0.001;

/// A speed law: called once per period with the wanted speed in m/s and the state of the vehicle, it returns
/// the voltage of both drive motors in V.
pub(crate) trait OwnLaw {
    /// The voltage for the next period.
    fn voltage(&mut self, target_m_s: f64, truth: &Truth) -> f64;
}

/// Closures are laws, too.
impl<F: FnMut(f64, &Truth) -> f64> OwnLaw for F {
    fn voltage(&mut self, target_m_s: f64, truth: &Truth) -> f64 {
        self(target_m_s, truth)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let target_m_s = 0.5;
    let speeds = fly(&mut law(), target_m_s)?;
    for (k, speed) in speeds.iter().enumerate().step_by(500) {
        println!("{:5.1} s  {speed:7.4} m/s", k as f64 * PERIOD_S);
    }
    match settling_s(&speeds, target_m_s) {
        Some(time_s) => println!("within 2 % of {target_m_s} m/s after {time_s:.2} s"),
        None => println!("{target_m_s} m/s is not reached"),
    }
    Ok(())
}

/// An example for the level: proportional and integral feedback of the speed, less the arm's angle and rate,
/// which keeps the swing small.
pub(crate) fn law() -> impl OwnLaw {
    let mut integral_m = 0.0;
    move |target_m_s: f64, truth: &Truth| {
        let error = target_m_s - truth.speed_m_s;
        integral_m += error * PERIOD_S;
        2.0 * error + 8.0 * integral_m - 20.0 * truth.phi_rad - 2.0 * truth.phi_rate_rad_s
    }
}

/// Drives the reference vehicle on the level from rest under `law`; its speed after each period, m/s.
pub(crate) fn fly(law: &mut dyn OwnLaw, target_m_s: f64) -> Result<Vec<f64>, Box<dyn Error>> {
    let vehicle = vehicle_file::reference()?;
    let mut plant = Plant::new(&vehicle, &SCALES, Terrain::slope(0.0, 0.8)?, 1)?;
    let duty_max = f64::from(SCALES.duty_max);
    let mut speeds = Vec::new();
    for _ in 0..6_000 {
        let truth = plant.truth();
        let duty = law.voltage(target_m_s, &truth) / truth.battery_v;
        let drive = BridgeState::Duty(duty.clamp(-duty_max, duty_max));
        // Left, right, and the ballast motor, which stays off: the spar hangs on its bearing.
        plant.advance(PERIOD_S, &[drive, drive, BridgeState::Open]);
        speeds.push(plant.truth().speed_m_s);
    }
    Ok(speeds)
}

/// The time after which `speeds` stay within 2 % of the target, s; `None` if they end outside.
pub(crate) fn settling_s(speeds: &[f64], target_m_s: f64) -> Option<f64> {
    let outside = |speed: &f64| (speed - target_m_s).abs() > 0.02 * target_m_s;
    let after = speeds.iter().rposition(outside).map_or(0, |k| k + 1);
    (after < speeds.len()).then_some(after as f64 * PERIOD_S)
}
