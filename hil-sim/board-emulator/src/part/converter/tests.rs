//! The ripple at the converter's samples, against an integral of the voltage.

use super::super::waveform::PwmShape;
use super::*;

/// The bridges' timer at 200 MHz and 20 kHz, up and down, with one pair of lines.
fn waveform(in1: u64, in2: u64) -> PwmWaveform {
    let mut waveform = PwmWaveform::default();
    waveform.set_clock(200_000_000);
    let shape = PwmShape {
        runs: true,
        up_and_down: true,
        top: 5_000,
        compare: [in1, in2, 0, 0, 0, 0],
        high_below: [true; 6],
        enabled: true,
        ..PwmShape::default()
    };
    waveform.reshape(0, shape, true);
    waveform
}

/// A current slope of 1 A per us under the whole supply, at 1 mV per A.
const SOURCE: RippleSource = RippleSource {
    timer: 0,
    lines: [0, 1],
    slope_uv_per_us: 1_000,
};

/// The ripple at every us of a period.
fn ripple(in1: u64, in2: u64) -> Vec<i64> {
    let waveforms = [waveform(in1, in2), PwmWaveform::default()];
    (0..50).map(|us| SOURCE.at(&waveforms, 1_000 * us)).collect()
}

/// The same ripple, integrated step by step from the voltage across the motor, minus its mean.
fn integrated(in1: u64, in2: u64) -> Vec<f64> {
    const STEP_NS: u64 = 10;
    let waveform = waveform(in1, in2);
    let mean = (in1 as f64 - in2 as f64) / 5_000.0;
    let high = |channel, at: u64| {
        // The line is high while the counter, at this distance from its zero, is below the compare
        // value.
        let from_zero = at.min(50_000 - at);
        2 * from_zero < waveform.high_ns(channel).expect("it runs")
    };
    let mut current = 0.0;
    let mut currents = Vec::new();
    for at in (0..50_000).step_by(STEP_NS as usize) {
        currents.push(current);
        let volts = f64::from(u8::from(high(0, at))) - f64::from(u8::from(high(1, at)));
        current += (volts - mean) * STEP_NS as f64;
    }
    let average = currents.iter().sum::<f64>() / currents.len() as f64;
    currents.iter().step_by(100).map(|current| current - average).collect()
}

#[test]
fn the_closed_form_is_the_integral_of_the_voltage() {
    for (in1, in2) in [
        (5_000, 2_500),
        (2_500, 5_000),
        (5_000, 4_500),
        (300, 5_000),
        (5_000, 5_000),
    ] {
        for (us, (found, expected)) in ripple(in1, in2).iter().zip(integrated(in1, in2)).enumerate() {
            // Tolerance: a step of the integral, and the closed form's resolution of 1 uV.
            assert!(
                (*found as f64 - expected).abs() < 25.0,
                "{in1}, {in2} at {us} us: {found}, not {expected}"
            );
        }
    }
}

#[test]
fn the_mean_flows_in_the_middle_of_the_brake() {
    let half = ripple(5_000, 2_500);
    assert_eq!(half[0], 0, "the counter's zero");
    assert_eq!(half[25], 0, "its top");
    // Half of the ripple, at the edges: half the supply for a quarter of the period.
    let extremes = (half.iter().min().copied(), half.iter().max().copied());
    assert_eq!(extremes, (Some(-6_000), Some(6_000)), "at whole us; 6,250 at the edges");
}

#[test]
fn an_open_bridge_has_no_ripple() {
    let mut waveforms = [waveform(5_000, 2_500), PwmWaveform::default()];
    let shape = PwmShape {
        enabled: false,
        ..*waveforms[0].shape()
    };
    waveforms[0].reshape(0, shape, false);
    assert!((0..50).all(|us| SOURCE.at(&waveforms, 1_000 * us) == 0));
}
