//! Chapter 4, corrected: traction is the first limit.

use model::control::speed_law::SpeedLaw;
use model::dynamics::planar::PlanarParameters;
use theory::analysis::equilibrium::static_phi;
use theory::analysis::input::Input;
use theory::analysis::roots::root_between;
use theory::analysis::simulate::{PlanarRun, simulate};
use theory::analysis::slip::{longest_pulse, slip_limit};
use theory::analysis::waveform::Waveform;

mod support;
use support::{close, thesis};

fn run(p: &PlanarParameters<f64>, input: &Input) -> PlanarRun {
    simulate(p, input, [0.0, static_phi(p).unwrap(), 0.0, 0.0], 60.0, 0.005).unwrap()
}

/// The friction coefficient that the response to a voltage step needs.
fn required_by_step(p: &PlanarParameters<f64>, u: f64) -> f64 {
    let run = run(p, &Input::voltage_step(p, u));
    run.friction_coefficient_required.expect("the wheel does not lift")
}

/// Erratum E14.
#[test]
fn traction_limits_every_step() {
    let p = thesis(0.0873);
    let step = run(&p, &Input::voltage_step(&p, 5.02));
    close(step.friction_coefficient_required.unwrap(), 3.845, 5e-4);
    close(step.friction[0], 5.5058, 5e-5);
    close(step.normal[0], 1.4321, 5e-5);
    for (mu_s, wanted) in [(0.6, 0.575), (0.8, 0.778), (1.0, 0.987)] {
        let found = slip_limit(&p, mu_s).unwrap();
        close(found.critical_voltage.unwrap(), wanted, 6e-4);
        close(found.whirl_voltage, 5.023056271, 1e-8);
        assert!(found.slips_first);
        // From both sides.
        let u = found.critical_voltage.unwrap();
        assert!(required_by_step(&p, u - 1e-6) < mu_s && required_by_step(&p, u + 1e-6) > mu_s);
    }
    for (beta, wanted, within) in [
        (0.0, 5.99, 5e-3),
        (0.0873, 3.85, 5e-3),
        (0.3, 2.08, 5e-3),
        (0.7, 1.18, 5e-3),
    ] {
        close(
            slip_limit(&thesis(beta), 0.8)
                .unwrap()
                .mu_s_where_whirl_comes_first
                .unwrap(),
            wanted,
            within,
        );
    }
    let level = slip_limit(&thesis(0.0), 0.005).unwrap();
    close(level.critical_voltage.unwrap(), 0.00455, 5e-6);
    close(level.critical_voltage.unwrap() / level.whirl_voltage, 0.0008, 5e-5);
    // On greased steel the vehicle slides even standing on this slope.
    assert_eq!(slip_limit(&p, 0.005).unwrap().critical_voltage, None);
    // With more grip than any tyre has, whirl comes first.
    let grippy = slip_limit(&p, 4.0).unwrap();
    assert!(!grippy.slips_first && grippy.critical_voltage == Some(grippy.whirl_voltage));
    // Downhill the wheel lifts before the arm turns over: no grip is enough.
    let downhill = slip_limit(&thesis(-0.3), 4.0).unwrap();
    assert!(downhill.slips_first && downhill.mu_s_where_whirl_comes_first.is_none());
    let hop = run(&thesis(-0.3), &Input::voltage_step(&thesis(-0.3), 4.46));
    assert!(hop.lifted && hop.normal[0] < 0.0 && hop.friction_coefficient_required.is_none());
}

#[test]
fn ramps_are_kinder() {
    let p = thesis(0.0873);
    let ramp = run(&p, &Input::voltage_step(&p, 8.0).shaped(Waveform::Ramp, 5.0));
    close(ramp.friction_coefficient_required.unwrap(), 0.910, 5e-4);
    let reference = Input::reference_step(SpeedLaw::thesis(2.2, 0.72), 1.0);
    close(run(&p, &reference).friction_coefficient_required.unwrap(), 1.451, 5e-4);
    let ramped = reference.shaped(Waveform::Ramp, 5.0);
    close(run(&p, &ramped).friction_coefficient_required.unwrap(), 0.389, 5e-4);
}

/// Erratum E15: the friction that a pulse needs at its start does not depend on the pulse's length.
#[test]
fn a_short_pulse_slips_as_a_step_does() {
    let p = thesis(0.0873);
    let slips_above = root_between(
        |u| run(&p, &Input::voltage_step(&p, u)).friction[0] / run(&p, &Input::voltage_step(&p, u)).normal[0] - 0.6,
        0.1,
        2.0,
        1e-9,
    );
    close(slips_above, 0.576, 6e-4);
    // The longest pulse that does not whirl gets shorter with its voltage, but every pulse slips. The end of
    // a pulse is a step back, so pulses below the step's limit turn the arm over, too.
    let mut last = f64::INFINITY;
    for amplitude in [5.0, 6.0, 8.0, 12.0, 20.0] {
        let longest = longest_pulse(&p, amplitude).unwrap().unwrap();
        assert!(longest < last && longest > 0.0, "{amplitude}: {longest}");
        last = longest;
    }
    assert_eq!(longest_pulse(&p, 3.0).unwrap(), None);
}

/// Erratum E16: the dips of the metric are the friction's zeros, not the arm passing the normal.
#[test]
fn the_dips_are_zeros_of_the_friction() {
    let p = thesis(0.0873);
    let run = run(&p, &Input::voltage_step(&p, 4.0));
    let crossing = |values: &[f64], after: f64| {
        let k = (1..values.len())
            .find(|k| run.t[*k] > after && values[k - 1] * values[*k] <= 0.0)
            .unwrap();
        let (a, b) = (values[k - 1], values[k]);
        run.t[k - 1] + (run.t[k] - run.t[k - 1]) * a / (a - b)
    };
    close(crossing(&run.friction, 4.0), 4.943, 1e-3);
    let from_normal: Vec<f64> = run.phi.iter().map(|phi| phi - p.beta).collect();
    close(crossing(&from_normal, 4.0), 4.657, 1e-3);
}
