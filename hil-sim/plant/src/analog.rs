//! The board's analogue inputs: battery voltage and motor currents as its converter sees them, sensor
//! faults included.

use model::board::BoardScales;
use model::sample::MOTORS;
use serde::Deserialize;

use crate::noise::Noise;

/// Noise of an analogue reading, in counts.
const NOISE_COUNTS: f64 = 2.0;
/// Inputs: the motors' currents, then the battery's voltage.
const INPUTS: usize = MOTORS + 1;
/// Index of the battery's voltage.
pub const BATTERY: usize = MOTORS;

/// Whether a sensor follows what it measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Following {
    /// It does.
    #[default]
    Works,
    /// It reads zero, whatever flows.
    Dead,
    /// It keeps what it read when it got stuck.
    Stuck,
}

/// What is wrong with one analogue sensor: it reads `gain` times what it follows, plus `offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnalogFault {
    /// Whether it follows what it measures.
    pub following: Following,
    /// Factor, 1 for a sound sensor.
    pub gain: f64,
    /// In A or V, 0 for a sound sensor.
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
struct Input {
    fault: AnalogFault,
    /// What a stuck sensor keeps, from its first reading on.
    kept: Option<f64>,
}

impl Input {
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
pub(crate) struct AnalogInputs {
    scales: BoardScales,
    noise: Noise,
    /// Once any sensor has failed.
    faulty: Option<Box<[Input; INPUTS]>>,
}

impl AnalogInputs {
    pub(crate) fn new(scales: &BoardScales, noise: Noise) -> Self {
        Self {
            scales: *scales,
            noise,
            faulty: None,
        }
    }

    /// Fails or repairs the input `index`: a motor's current, or [`BATTERY`].
    pub(crate) fn set_fault(&mut self, index: usize, fault: AnalogFault) {
        if let Some(input) = self.faulty.get_or_insert_default().get_mut(index) {
            *input = Input { fault, kept: None };
        }
    }

    /// One conversion, with the converter's noise, saturated at its range.
    pub(crate) fn convert(&mut self, mut battery_v: f64, mut current_a: [f64; MOTORS]) -> (u16, [u16; MOTORS]) {
        if let Some(faulty) = &mut self.faulty {
            for (current, input) in current_a.iter_mut().zip(faulty.iter_mut()) {
                *current = input.read(*current);
            }
            battery_v = faulty[BATTERY].read(battery_v);
        }
        let mut count = |value: f64| (value + NOISE_COUNTS * self.noise.normal()).round() as u16;
        let battery = count(battery_v / f64::from(self.scales.battery_v_per_count));
        let current = current_a.map(|current| {
            count(f64::from(self.scales.current_zero_count) + current / f64::from(self.scales.current_a_per_count))
        });
        (battery, current)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::SCALES;

    /// Mean of many readings in A and V: battery, then currents.
    fn mean(inputs: &mut AnalogInputs, battery_v: f64, current_a: [f64; MOTORS]) -> [f64; INPUTS] {
        let mut sums = [0.0; INPUTS];
        for _ in 0..1000 {
            let (battery, current) = inputs.convert(battery_v, current_a);
            for (sum, count) in sums.iter_mut().zip(current) {
                let zeroed = f64::from(count) - f64::from(SCALES.current_zero_count);
                *sum += zeroed * f64::from(SCALES.current_a_per_count) / 1000.0;
            }
            sums[BATTERY] += f64::from(battery) * f64::from(SCALES.battery_v_per_count) / 1000.0;
        }
        sums
    }

    fn assert_reads(inputs: &mut AnalogInputs, truth: [f64; INPUTS], expected: [f64; INPUTS]) {
        let [a, b, c, battery_v] = truth;
        let found = mean(inputs, battery_v, [a, b, c]);
        for (found, expected) in found.iter().zip(expected) {
            // Half a count of the currents is 0.9 mA.
            assert!((found - expected).abs() < 2e-3, "{found} against {expected}");
        }
    }

    #[test]
    fn each_sensor_fails_alone_and_is_repaired() {
        let mut inputs = AnalogInputs::new(&SCALES, Noise::new(1, 2));
        let truth = [4.0, -6.0, 1.0, 24.0];
        assert_reads(&mut inputs, truth, truth);
        let fault = |gain, offset| AnalogFault {
            gain,
            offset,
            ..AnalogFault::default()
        };
        inputs.set_fault(0, fault(1.0, 5.0));
        inputs.set_fault(1, fault(0.5, -1.0));
        inputs.set_fault(BATTERY, fault(1.1, 0.0));
        assert_reads(&mut inputs, truth, [9.0, -4.0, 1.0, 26.4]);
        let following = |following| AnalogFault {
            following,
            ..AnalogFault::default()
        };
        inputs.set_fault(0, following(Following::Dead));
        inputs.set_fault(1, following(Following::Stuck));
        inputs.set_fault(BATTERY, following(Following::Works));
        assert_reads(&mut inputs, truth, [0.0, -6.0, 1.0, 24.0]);
        assert_reads(&mut inputs, [-4.0, 2.0, 3.0, 20.0], [0.0, -6.0, 3.0, 20.0]);
        inputs.set_fault(1, AnalogFault::default());
        assert_reads(&mut inputs, [-4.0, 2.0, 3.0, 20.0], [0.0, 2.0, 3.0, 20.0]);
    }

    #[test]
    fn the_converter_saturates() {
        let mut inputs = AnalogInputs::new(&SCALES, Noise::new(1, 2));
        inputs.set_fault(
            0,
            AnalogFault {
                offset: 100.0,
                ..AnalogFault::default()
            },
        );
        let (battery, current) = inputs.convert(200.0, [0.0, -100.0, 0.0]);
        assert_eq!((battery, current[0], current[1]), (u16::MAX, u16::MAX, 0));
    }
}
