//! The compared laws, as vehicle files that differ in the firmware's law.

use model::vehicle::{SpeedLawChoice, Vehicle, VehicleParameters};

/// A law, as the firmware's vehicle file selects it.
#[derive(Debug, Clone)]
pub struct Contender {
    /// Its name.
    pub name: &'static str,
    /// How the law is set.
    pub how: String,
    /// The firmware's vehicle; the simulated vehicle may be another.
    pub told: Vehicle<f64>,
}

/// Change from the file's parameters to a contender's parameters.
type Change = fn(&mut VehicleParameters<f64>);

/// Name, setting as text, and change.
const CONTENDERS: [(&str, &str, Change); 4] = [
    (
        "Eq. 3.25 alone",
        "law = \"eq-3.25\" without swing damping, integral, hold and ramp",
        |p| {
            p.control.law = EQ_3_25;
            p.control.swing_gain = 0.0;
            p.control.ki = 0.0;
            p.control.hold_kp_per_s = 0.0;
            p.control.comfort_s = 0.0;
            p.control.acceleration_max_m_s2 = STEP_M_S2;
        },
    ),
    (
        "Eq. 3.25, swing damped",
        "law = \"eq-3.25\" as the file has it: the law before the landing law",
        |p| p.control.law = EQ_3_25,
    ),
    (
        "landing, no governor",
        "law = \"landing\" with grip_mu set to 2, an arm that may turn to 3.1 rad, and no ramp",
        |p| {
            p.control.law = LANDING;
            p.control.grip_mu = 2.0;
            p.control.comfort_s = 0.0;
            p.control.acceleration_max_m_s2 = STEP_M_S2;
            p.safety.phi_max_rad = 3.1;
        },
    ),
    ("landing", "law = \"landing\" as the file has it", |p| {
        p.control.law = LANDING;
    }),
];

/// Number of Eq. 3.25 in the parameter.
const EQ_3_25: f64 = SpeedLawChoice::SwingDamped as u8 as f64;
const LANDING: f64 = SpeedLawChoice::Landing as u8 as f64;
/// The thesis's kp divided by the total damping of its vehicle: 0.8 / 2.2.
const KP_SHARE: f64 = 0.8 / 2.2;
/// A speed ramp so steep that it is a step, m/s^2.
const STEP_M_S2: f64 = 20.0;

/// The laws for a file's vehicle, in the order of the table.
///
/// # Errors
/// The name of a law that does not fit the vehicle, and the reason.
pub fn contenders(vehicle: &Vehicle<f64>) -> Result<Vec<Contender>, String> {
    CONTENDERS
        .iter()
        .map(|(name, how, change)| {
            let mut parameters = *vehicle.parameters();
            change(&mut parameters);
            let mut how = (*how).to_owned();
            let zeta = vehicle.planar(0.0).zeta;
            if parameters.control.law == EQ_3_25 && parameters.control.kp >= zeta {
                // A file that selects the landing law need not contain a kp with which Eq. 3.25 is stable.
                let (own, stable) = (parameters.control.kp, KP_SHARE * zeta);
                how = format!("{how}, kp {stable:.2}: with its own, {own}, Eq. 3.25 is unstable");
                parameters.control.kp = stable;
            }
            let told = Vehicle::new(parameters).map_err(|error| format!("{name}: {error}"))?;
            Ok(Contender { name, how, told })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// If Eq. 3.25 is unstable with the file's kp, the comparison uses another kp, and the table says so.
    #[test]
    fn eq_3_25_flies_with_a_kp_that_is_stable() {
        let reference = vehicle_file::reference().expect("good");
        for law in contenders(&reference).expect("good") {
            assert!(!law.how.contains("unstable"), "{}", law.how);
            assert_eq!(law.told.parameters().control.kp.to_bits(), 0.8_f64.to_bits());
        }
        let mut parameters = *reference.parameters();
        parameters.drive_motor.resistance_ohm *= 10.0;
        let little_damped = Vehicle::new(parameters).expect("the landing law flies it");
        let zeta = little_damped.planar(0.0).zeta;
        assert!(zeta < 0.8, "{zeta}");
        for law in contenders(&little_damped).expect("good") {
            let own = law.told.speed_law() == SpeedLawChoice::Landing;
            let kp = law.told.parameters().control.kp;
            assert_eq!(
                law.how.contains("with its own, 0.8, Eq. 3.25 is unstable"),
                !own,
                "{}",
                law.how
            );
            assert!(own || (kp > 0.0 && kp < zeta), "{kp}");
        }
    }
}
