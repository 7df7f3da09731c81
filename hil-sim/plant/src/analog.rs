//! The board's analogue inputs: battery voltage and motor currents as the converter sees them,
//! including sensor faults.

use model::analog::{Analog, AnalogScale};
use model::board::BoardScales;
use serde::Deserialize;

use crate::noise::Noise;

/// Noise of an analogue reading, in counts.
const NOISE_COUNTS: f64 = 2.0;

/// Whether a sensor's reading follows the measured quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Following {
    /// The reading follows.
    #[default]
    Works,
    /// The sensor reads zero, whatever current flows.
    Dead,
    /// The sensor keeps the reading at which it got stuck.
    Stuck,
}

/// The fault of one analogue sensor: its reading is `gain` times the followed quantity, plus
/// `offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnalogFault {
    /// Whether the reading follows the measured quantity.
    pub following: Following,
    /// Factor; 1 for a sensor without a fault.
    pub gain: f64,
    /// Offset in A or V; 0 for a sensor without a fault.
    pub offset: f64,
}

impl Default for AnalogFault {
    fn default() -> Self {
        Self {
            following: Following::Works,
            gain: 1.0,
            offset: 0.0,
        }
    }
}

/// One faulty input.
#[derive(Debug, Clone, Copy, Default)]
struct SensorInput {
    fault: AnalogFault,
    /// The reading that a stuck sensor keeps, from its first reading on.
    kept: Option<f64>,
}

impl SensorInput {
    fn read(&mut self, value: f64) -> f64 {
        let followed = match self.fault.following {
            Following::Works => value,
            Following::Dead => 0.0,
            Following::Stuck => *self.kept.get_or_insert(value),
        };
        self.fault.gain * followed + self.fault.offset
    }
}

/// The converter and the sensors before it.
#[derive(Debug, Clone)]
pub(crate) struct AnalogConverter {
    scales: Analog<AnalogScale>,
    noise: Noise,
    /// The inputs' faults, once any sensor has failed.
    faulty: Option<Box<Analog<SensorInput>>>,
}

impl AnalogConverter {
    pub(crate) fn new(scales: &BoardScales, noise: Noise) -> Self {
        Self {
            scales: scales.analog,
            noise,
            faulty: None,
        }
    }

    /// Fails or repairs an input by its name in [`Analog`].
    pub(crate) fn set_fault(&mut self, name: &str, fault: AnalogFault) {
        if let Some(input) = self.faulty.get_or_insert_default().get_mut(name) {
            *input = SensorInput { fault, kept: None };
        }
    }

    /// One conversion, with the converter's noise, saturated at its range.
    pub(crate) fn convert(&mut self, mut values: Analog<f64>) -> Analog<u16> {
        if let Some(faulty) = &mut self.faulty {
            for (name, value) in Analog::<()>::NAMES.iter().zip(values.values()) {
                if let (Some(input), Some(read)) = (faulty.get_mut(name), values.get_mut(name)) {
                    *read = input.read(value);
                }
            }
        }
        let noises = Analog::from_values(self.noise.normals());
        let counts = values.with(&self.scales, |value, scale| scale.counts(value));
        // Rounds to the nearest count by adding half a count and truncating; a negative number
        // saturates to 0.
        counts.with(&noises, |counts, noise| (counts + NOISE_COUNTS * noise + 0.5) as u16)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::SCALES;

    /// Mean of many readings, in SI units.
    fn mean(inputs: &mut AnalogConverter, truth: Analog<f64>) -> Analog<f64> {
        let mut sums = Analog::all(0.0);
        for _ in 0..1000 {
            let read = inputs
                .convert(truth)
                .with(&SCALES.analog, |raw, scale| f64::from(scale.value(raw)));
            sums = sums.with(&read, |sum, value| sum + value / 1000.0);
        }
        sums
    }

    fn assert_reads(inputs: &mut AnalogConverter, truth: Analog<f64>, expected: Analog<f64>) {
        let found = mean(inputs, truth);
        for (found, expected) in found.values().iter().zip(expected.values()) {
            // Half a count of the currents is 1 mA.
            assert!((found - expected).abs() < 2e-3, "{found} against {expected}");
        }
    }

    fn values(left: f64, right: f64, ballast: f64, battery: f64) -> Analog<f64> {
        let mut values = Analog::all(0.0);
        values.left_current = left;
        values.right_current = right;
        values.ballast_current = ballast;
        values.battery_voltage = battery;
        values
    }

    #[test]
    fn each_sensor_fails_alone_and_is_repaired() {
        let mut inputs = AnalogConverter::new(&SCALES, Noise::new(1, 2));
        let truth = values(4.0, -6.0, 1.0, 24.0);
        assert_reads(&mut inputs, truth, truth);
        let fault = |gain, offset| AnalogFault {
            gain,
            offset,
            ..AnalogFault::default()
        };
        inputs.set_fault("left_current", fault(1.0, 5.0));
        inputs.set_fault("right_current", fault(0.5, -1.0));
        inputs.set_fault("battery_voltage", fault(1.1, 0.0));
        assert_reads(&mut inputs, truth, values(9.0, -4.0, 1.0, 26.4));
        let following = |following| AnalogFault {
            following,
            ..AnalogFault::default()
        };
        inputs.set_fault("left_current", following(Following::Dead));
        inputs.set_fault("right_current", following(Following::Stuck));
        inputs.set_fault("battery_voltage", following(Following::Works));
        assert_reads(&mut inputs, truth, values(0.0, -6.0, 1.0, 24.0));
        assert_reads(&mut inputs, values(-4.0, 2.0, 3.0, 20.0), values(0.0, -6.0, 3.0, 20.0));
        inputs.set_fault("right_current", AnalogFault::default());
        assert_reads(&mut inputs, values(-4.0, 2.0, 3.0, 20.0), values(0.0, 2.0, 3.0, 20.0));
    }

    #[test]
    fn the_converter_saturates() {
        let mut inputs = AnalogConverter::new(&SCALES, Noise::new(1, 2));
        inputs.set_fault(
            "left_current",
            AnalogFault {
                offset: 100.0,
                ..AnalogFault::default()
            },
        );
        let read = inputs.convert(values(0.0, -100.0, 0.0, 200.0));
        let ends = [read.battery_voltage, read.left_current, read.right_current];
        assert_eq!(ends, [u16::MAX, u16::MAX, 0]);
    }
}
