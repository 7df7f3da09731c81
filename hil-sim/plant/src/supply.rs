//! The battery over a run: its voltage falls with its charge, its contact opens and closes, and below a
//! certain voltage the board does not run.

use serde::Deserialize;

use crate::battery::Battery;
use crate::ranges::{SettingsError, within};

/// A battery with a charge.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BatterySettings {
    /// Charge that a full battery gives, in A h, 0.001 to 1000.
    pub capacity_ah: f64,
    /// Charge at the start, as a share of the capacity, 0 to 1.
    #[serde(default = "full")]
    pub charge: f64,
    /// Open-circuit voltage over the charge: pairs of share (ascending, 0 to 1) and voltage (0 to 100
    /// V), linear between the pairs and constant beyond.
    pub open_circuit_v: Vec<[f64; 2]>,
}

const fn full() -> f64 {
    1.0
}

/// Largest number of pairs of a curve.
const CURVE_MAX: usize = 100;

impl BatterySettings {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value out of its range, or an invalid curve.
    pub fn check(&self) -> Result<(), SettingsError> {
        within("plant.battery.capacity_ah", self.capacity_ah, 0.001, 1000.0)?;
        within("plant.battery.charge", self.charge, 0.0, 1.0)?;
        if self.open_circuit_v.is_empty() || self.open_circuit_v.len() > CURVE_MAX {
            return Err(SettingsError::Curve("it has 1 to 100 pairs"));
        }
        for (i, [charge, volts]) in self.open_circuit_v.iter().enumerate() {
            within(format!("plant.battery.open_circuit_v[{i}][0]"), *charge, 0.0, 1.0)?;
            within(format!("plant.battery.open_circuit_v[{i}][1]"), *volts, 0.0, 100.0)?;
        }
        if self.open_circuit_v.windows(2).any(|pair| pair[0][0] >= pair[1][0]) {
            return Err(SettingsError::Curve("the charge must rise from pair to pair"));
        }
        Ok(())
    }

    /// Open-circuit voltage at a charge.
    fn volts_at(&self, charge: f64) -> f64 {
        let mut below: Option<[f64; 2]> = None;
        for &[at, volts] in &self.open_circuit_v {
            if charge <= at {
                return match below {
                    None => volts,
                    Some([from, least]) => least + (volts - least) * (charge - from) / (at - from),
                };
            }
            below = Some([at, volts]);
        }
        below.map_or(0.0, |[_, volts]| volts)
    }
}

/// The slow state of the battery, updated once per call of the plant.
#[derive(Debug, Clone, Default)]
pub(crate) struct Supply {
    charged: Option<Box<BatterySettings>>,
    /// The battery while its contact is open.
    apart: Option<Battery>,
    brown_out_v: f64,
}

/// Seconds of an hour: A h in A s.
const HOUR_S: f64 = 3600.0;

impl Supply {
    pub(crate) fn new(charged: Option<&BatterySettings>, brown_out_v: f64) -> Self {
        Self {
            charged: charged.cloned().map(Box::new),
            apart: None,
            brown_out_v,
        }
    }

    /// Reduces the charge by the current of `dt_s` seconds and sets the resulting open-circuit voltage.
    pub(crate) fn follow(&mut self, dt_s: f64, current_a: f64, battery: &mut Battery) {
        if let Some(charged) = &mut self.charged {
            let used = current_a * dt_s / (HOUR_S * charged.capacity_ah);
            charged.charge = (charged.charge - used).clamp(0.0, 1.0);
            self.apart.as_mut().unwrap_or(battery).open_circuit_v = charged.volts_at(charged.charge);
        }
    }

    /// The charge as a share of the capacity, of a battery that has one.
    #[cfg(test)]
    pub(crate) fn charge(&self) -> Option<f64> {
        self.charged.as_ref().map(|charged| charged.charge)
    }

    /// Sets the open-circuit voltage from now on, whatever the charge.
    pub(crate) fn set_open_circuit_v(&mut self, volts: f64, battery: &mut Battery) {
        self.charged = None;
        self.apart.as_mut().unwrap_or(battery).open_circuit_v = volts;
    }

    /// Opens or closes the battery's contact. While the contact is open, nothing supplies board and
    /// motors.
    pub(crate) fn set_connected(&mut self, connected: bool, battery: &mut Battery) {
        match (connected, self.apart) {
            (true, Some(apart)) => {
                *battery = apart;
                self.apart = None;
            }
            (false, None) => {
                self.apart = Some(*battery);
                battery.open_circuit_v = 0.0;
                battery.idle_a = 0.0;
            }
            _ => {}
        }
    }

    /// Whether the battery's contact is closed.
    pub(crate) fn connected(&self) -> bool {
        self.apart.is_none()
    }

    /// Whether the board runs at this battery voltage.
    pub(crate) fn powers_board(&self, battery_v: f64) -> bool {
        self.connected() && battery_v >= self.brown_out_v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> BatterySettings {
        BatterySettings {
            capacity_ah: 2.0,
            charge: 1.0,
            open_circuit_v: vec![[0.0, 18.0], [0.1, 22.0], [1.0, 25.0]],
        }
    }

    fn battery() -> Battery {
        Battery {
            open_circuit_v: 25.0,
            resistance_ohm: 0.06,
            idle_a: 0.2,
        }
    }

    #[test]
    fn the_curve_is_straight_between_its_pairs_and_level_beyond() {
        let settings = BatterySettings {
            open_circuit_v: vec![[0.1, 22.0], [0.6, 24.0], [0.9, 25.0]],
            ..settings()
        };
        for (charge, volts) in [
            (0.0, 22.0),
            (0.1, 22.0),
            (0.35, 23.0),
            (0.6, 24.0),
            (0.75, 24.5),
            (1.0, 25.0),
        ] {
            assert!((settings.volts_at(charge) - volts).abs() < 1e-12, "{charge}");
        }
    }

    #[test]
    fn an_hour_at_one_ampere_takes_one_ampere_hour() {
        let (mut supply, mut battery) = (Supply::new(Some(&settings()), 0.0), battery());
        for _ in 0..3_600 {
            supply.follow(1.0, 1.0, &mut battery);
        }
        assert!((supply.charge().expect("charged") - 0.5).abs() < 1e-9);
        // Linear between (0.1, 22) and (1, 25).
        assert!((battery.open_circuit_v - (22.0 + 3.0 * 0.4 / 0.9)).abs() < 1e-9);
        // Returned current increases the charge again, up to the capacity.
        supply.follow(7200.0, -2.0, &mut battery);
        assert_eq!((supply.charge(), battery.open_circuit_v), (Some(1.0), 25.0));
        supply.follow(1e6, 1.0, &mut battery);
        assert_eq!((supply.charge(), battery.open_circuit_v), (Some(0.0), 18.0));
    }

    #[test]
    fn a_contact_that_opens_leaves_nothing_and_gives_it_back() {
        let (mut supply, mut battery) = (Supply::new(None, 15.0), battery());
        assert!(supply.powers_board(15.0) && !supply.powers_board(14.99));
        supply.set_connected(false, &mut battery);
        assert!(!supply.powers_board(25.0));
        assert_eq!((battery.open_circuit_v, battery.idle_a), (0.0, 0.0));
        supply.set_connected(false, &mut battery);
        supply.set_open_circuit_v(20.0, &mut battery);
        assert_eq!(battery.open_circuit_v, 0.0, "drained while apart");
        supply.set_connected(true, &mut battery);
        assert_eq!((battery.open_circuit_v, battery.idle_a), (20.0, 0.2));
    }

    #[test]
    fn curves_that_are_none_are_refused() {
        for (curve, part) in [
            (vec![], "1 to 100 pairs"),
            (vec![[0.5, 20.0], [0.5, 21.0]], "must rise"),
            (
                vec![[0.0, 20.0], [1.1, 21.0]],
                "open_circuit_v[1][0] = 1.1: allowed is 0 to 1",
            ),
            (vec![[0.0, f64::NAN]], "open_circuit_v[0][1] = NaN: allowed is 0 to 100"),
        ] {
            let settings = BatterySettings {
                open_circuit_v: curve,
                ..settings()
            };
            let message = settings.check().expect_err("no curve").to_string();
            assert!(message.contains(part), "{message}");
        }
    }
}
