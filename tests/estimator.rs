//! The estimator against the truth under accelerations of 0.3 g, with the noise of the data sheets.

use model::vehicle::{GRAVITY_M_S2, Vehicle};
use virtual_board::scenario::{self, Scenario, VirtualBackend, metrics};

mod support;
use support::reference;

/// The reference vehicle, allowed to accelerate by 0.3 g.
fn sprinter() -> Vehicle<f64> {
    let mut parameters = *reference().parameters();
    parameters.control.acceleration_max_m_s2 = 0.3 * GRAVITY_M_S2;
    Vehicle::new(parameters).expect("valid")
}

const SPRINTS: &str = "
title = 'Sprints of 0.3 g forward and back'
duration_s = 24.0
[[step]]
at_s = 2.0
action = 'arm'
[[step]]
at_s = 4.0
action = 'drive'
speed_m_s = 2.4
[[step]]
at_s = 9.0
action = 'drive'
speed_m_s = -2.4
[[step]]
at_s = 15.0
action = 'drive'
speed_m_s = 2.4
[[step]]
at_s = 20.0
action = 'drive'
";

#[test]
fn under_0_3_g_the_arm_is_known_within_2_5_degrees() {
    for seed in 1..=6 {
        let mut scenario = Scenario::parse("sprints", SPRINTS).expect("valid");
        scenario.seed = seed;
        let vehicle = sprinter();
        let plant = scenario.plant(&vehicle).expect("drivable");
        let mut backend = VirtualBackend::boot(&vehicle, plant).expect("boots");
        let outcome = scenario::run(&scenario, &mut backend, |_| {}).expect("a valid plant");
        let rows = &outcome.trace.rows;
        // The axle's true acceleration over 100 ms.
        let hardest = rows
            .windows(11)
            .map(|w| ((w[10].truth.speed_m_s - w[0].truth.speed_m_s) / (w[10].truth.time_s - w[0].truth.time_s)).abs())
            .fold(0.0, f64::max);
        assert!(
            hardest > 0.27 * GRAVITY_M_S2,
            "seed {seed}: the vehicle accelerates by {hardest} m/s^2 at most"
        );
        let values = metrics::measure(&outcome);
        let value = |name: &str| values.iter().find(|m| m.name == name).expect(name).value;
        let (rms, peak) = (
            value("phi_estimate_error_rms_deg"),
            value("phi_estimate_error_peak_deg"),
        );
        assert!(value("armed_s") > 21.0, "seed {seed}: {:?}", outcome.log);
        assert!(peak < 2.5 && peak > 0.01, "seed {seed}: peak {peak} deg");
        assert!(rms < 1.0 && rms > 0.005, "seed {seed}: rms {rms} deg");
        println!("seed {seed}: {hardest:.2} m/s^2, phi known within {rms:.3} deg rms, {peak:.3} deg peak");
    }
}
