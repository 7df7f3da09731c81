//! The speed laws on the full plant.

use firmware::drive_board::SCALES;
use model::control::equilibrium::Equilibrium;
use model::vehicle::{GRAVITY_M_S2, Vehicle};
use plant::Plant;
use virtual_board::scenario::trace::Row;
use virtual_board::scenario::{self, DriveOutcome, Scenario, VirtualBackend};

mod support;
use support::reference;

fn drive(vehicle: &Vehicle<f64>, text: &str) -> DriveOutcome {
    let scenario = Scenario::parse("a scenario of this test", text).expect("valid");
    let plant = Plant::new(vehicle, &SCALES, scenario.terrain.clone(), scenario.seed).expect("drivable");
    let mut backend = VirtualBackend::boot(vehicle, plant).expect("boots");
    scenario::run(&scenario, &mut backend, |_| {}).expect("the plant stays valid")
}

/// In a steady ramp the arm stands where the equilibrium says that it must, and the vehicle knows it: the angle
/// commanded, the angle estimated and the true angle agree.
#[test]
fn in_a_steady_ramp_the_arm_is_where_it_is_commanded_to_be() {
    let vehicle = reference();
    let planar = vehicle.planar(0.0);
    let equilibrium = Equilibrium {
        alpha_l: planar.alpha * planar.l,
        mass: 1.0 + vehicle.spar_mass_ratio(),
        mu: planar.mu,
    };
    for slope_deg in [0.0_f64, 5.0, -5.0] {
        let text = format!(
            "title = 'ramp'
            duration_s = 23.3
            chocked_until_armed = true
            [terrain.plane]
            slope_x_rad = {}
            [[step]]
            at_s = 2.0
            action = 'arm'
            [[step]]
            at_s = 10.0
            action = 'drive'
            speed_m_s = -2.4
            [[step]]
            at_s = 18.0
            action = 'drive'
            speed_m_s = 2.4",
            slope_deg.to_radians()
        );
        let outcome = drive(&vehicle, &text);
        // Means over the last second of the ramp, because the sensors are noisy; and over a second at rest before, for
        // the angle by which this IMU's accelerometer is off.
        let rows = &outcome.trace.rows;
        let (rest, ramp) = (&rows[850..950], &rows[rows.len() - 100..]);
        let mean = |rows: &[Row], value: &dyn Fn(&Row) -> f64| rows.iter().map(value).sum::<f64>() / rows.len() as f64;
        let error_deg = |row: &Row| (f64::from(row.status.estimate.phi_rad) - row.truth.phi_rad).to_degrees();
        let offset_deg = mean(rest, &error_deg);
        let (first, last) = (ramp[0].status, ramp[ramp.len() - 1].status);
        let acceleration_m_s2 = f64::from(last.speed_reference_m_s - first.speed_reference_m_s)
            / ((last.time_us - first.time_us) as f64 * 1e-6);
        assert!((acceleration_m_s2 - 0.8).abs() < 0.01, "{acceleration_m_s2}");
        let commanded_deg = mean(ramp, &|row| {
            let sin = f64::from(row.status.estimate.sin_slope);
            let arm = equilibrium.arm(acceleration_m_s2 / GRAVITY_M_S2, sin, (1.0 - sin * sin).sqrt());
            arm.sin.asin().to_degrees()
        });
        let estimated_deg = mean(ramp, &|row| f64::from(row.status.estimate.phi_rad).to_degrees());
        let true_deg = mean(ramp, &|row| row.truth.phi_rad.to_degrees()) + offset_deg;
        println!(
            "{slope_deg} deg: offset {offset_deg:.3}, commanded {commanded_deg:.3}, estimated {estimated_deg:.3}, true {true_deg:.3} deg"
        );
        for other in [estimated_deg, true_deg] {
            assert!(
                (commanded_deg - other).abs() < 0.05,
                "{slope_deg}: {commanded_deg} {estimated_deg} {true_deg}"
            );
        }
    }
}
