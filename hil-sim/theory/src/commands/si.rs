//! SI values that a command prints in addition to its nondimensional numbers, if a vehicle file gives the scales.

use model::vehicle::{Scales, SparScales, Vehicle};
use serde::Serialize;

use crate::commands::taken::Taken;
use crate::commands::vehicle_argument::Source;

/// The scales of a whole vehicle; without a vehicle there are no SI values. The scales follow from radius, mass and
/// motors (3.10), (3.11). A flag that overrides a nondimensional parameter does not change them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Si(Option<Scales<f64>>);

impl Si {
    /// The scales of the vehicle that the parameters come from.
    pub fn of(source: &Source) -> Self {
        Self(source.whole_vehicle().map(Vehicle::scales))
    }

    /// The scales of a vehicle with `mass` times its own mass, whose numbers are all divided by the whole mass.
    pub fn carrying(self, mass: f64) -> Self {
        Self(self.0.map(|scales| Scales {
            torque_n_m: mass * scales.torque_n_m,
            voltage_v: mass * scales.voltage_v,
            ..scales
        }))
    }

    /// A nondimensional voltage as the voltage of both drive motors, V.
    pub fn volts(self, voltage: f64) -> Option<f64> {
        self.0.map(|scales| scales.voltage_to_si(voltage))
    }

    /// A wheel rate theta' as the speed of the axle, m/s.
    pub fn speed_m_s(self, theta_rate: f64) -> Option<f64> {
        self.0.map(|scales| theta_rate * scales.speed_m_s)
    }

    /// A time, s.
    pub fn seconds(self, time: f64) -> Option<f64> {
        self.0.map(|scales| time * scales.time_s)
    }

    /// A length over the wheel radius, m.
    pub fn metres(self, length: f64) -> Option<f64> {
        self.0.map(|scales| length * scales.length_m)
    }

    /// An angular rate, rad/s.
    pub fn rate_rad_s(self, rate: f64) -> Option<f64> {
        self.0.map(|scales| rate / scales.time_s)
    }

    /// An angle in degrees, if the output has SI values.
    pub fn degrees(self, angle: f64) -> Option<f64> {
        self.0.map(|_| angle.to_degrees())
    }

    /// Poles in 1/s.
    pub fn poles_per_s(self, poles: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
        self.0.map(|scales| per_s(poles, scales.time_s))
    }

    /// One nondimensional unit of each kind.
    pub fn units(self) -> Option<SiUnits> {
        self.0.map(|scales| SiUnits {
            time_unit_s: scales.time_s,
            speed_unit_m_s: scales.speed_m_s,
            voltage_unit_v: scales.voltage_v,
        })
    }
}

fn per_s(poles: &[[f64; 2]], time_s: f64) -> Vec<[f64; 2]> {
    poles.iter().map(|pole| pole.map(|part| part / time_s)).collect()
}

/// The scales of a whole vehicle's camera spar (ch. 7); without a spar there are no SI values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparSi(Option<SparScales<f64>>);

impl SparSi {
    /// The scales of the spar that the parameters come from.
    pub fn of(source: &Source) -> Self {
        Self(source.whole_vehicle().and_then(Vehicle::spar_scales))
    }

    /// The gains of v = -g . x as gains of the ballast motor's voltage: on two angles, V/rad, and two rates, V s/rad.
    pub fn gains_v(self, gains: [f64; 4]) -> Option<[f64; 4]> {
        let [spar, ballast, spar_rate, ballast_rate] =
            gains.map(|gain| self.0.map(|scales| scales.voltage_to_si(gain)));
        let time_s = self.0?.time_s;
        Some([spar?, ballast?, spar_rate? * time_s, ballast_rate? * time_s])
    }

    /// A voltage of the ballast motor, V.
    pub fn volts(self, voltage: f64) -> Option<f64> {
        self.0.map(|scales| scales.voltage_to_si(voltage))
    }

    /// A time, s.
    pub fn seconds(self, time: f64) -> Option<f64> {
        self.0.map(|scales| time * scales.time_s)
    }

    /// Poles in 1/s.
    pub fn poles_per_s(self, poles: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
        self.0.map(|scales| per_s(poles, scales.time_s))
    }

    /// One nondimensional unit of each kind.
    pub fn units(self) -> Option<SparSiUnits> {
        self.0.map(|scales| SparSiUnits {
            time_unit_s: scales.time_s,
            voltage_unit_v: scales.voltage_v,
        })
    }
}

/// The SI values of the spar's nondimensional units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SparSiUnits {
    /// The unit of time, s.
    time_unit_s: f64,
    /// The voltage of the ballast motor at v = 1, V.
    voltage_unit_v: f64,
}

/// A number as text, followed by its SI value.
pub fn beside(number: String, si: Option<f64>, unit: &str) -> String {
    match si {
        Some(si) => format!("{number} ({si:.3} {unit})"),
        None => number,
    }
}

/// The SI values of the nondimensional units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SiUnits {
    /// The unit of time, s.
    time_unit_s: f64,
    /// The speed of the axle at theta' = 1, m/s.
    speed_unit_m_s: f64,
    /// The voltage of both drive motors at U = 1, V.
    voltage_unit_v: f64,
}

/// A result with the units of its numbers, if known.
#[derive(Debug, Serialize)]
pub struct WithUnits<'a, R, U = SiUnits> {
    /// The result.
    #[serde(flatten)]
    pub result: &'a R,
    /// The units.
    #[serde(flatten)]
    pub units: Option<U>,
    /// The numbers that neither a flag nor the vehicle file gives, for a command that reports them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub taken: Vec<Taken>,
}
