//! What a motor's current does within one period of the bridge's PWM, which [`super::motor`] averages over.
//!
//! Within a stretch of the period the bridge holds +1, 0 or -1 times the supply at the motor. With the rate constant over
//! the period the armature `L i' = V - R i - e` has the exact solution
//!
//! ```text
//! i(h) = i_inf + (i(0) - i_inf) E,   i_inf = (V - e) / R,   E = exp(-h R / L)
//! ```
//!
//! so a period maps the current at its begin linearly to the one at its end, and the periodic current is the map's fixed
//! point. The integral of a stretch is `(i_inf h) + (i(0) - i_inf) (1 - E) L / R`; that of the square follows alike.

/// How the bridge makes a mean voltage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Modulation {
    /// The two diagonals in turn: +V and -V. At half of the period each, the mean is 0.
    LockedAntiPhase,
    /// One leg switches, the other one says the direction: +V or -V, and 0.
    SignMagnitude,
    /// Both legs switch, each with its own share of the period, aligned at their centres: two pulses a period.
    Unipolar,
}

impl Modulation {
    /// Every modulation.
    pub const ALL: [Self; 3] = [Self::LockedAntiPhase, Self::SignMagnitude, Self::Unipolar];

    /// The modulation in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::LockedAntiPhase => "locked anti-phase",
            Self::SignMagnitude => "sign-magnitude",
            Self::Unipolar => "unipolar, two legs",
        }
    }

    /// The stretches of a period for a duty of -1 to 1: share of the period, and voltage as a share of the supply.
    fn stretches(self, duty: f64) -> [(f64, f64); 4] {
        let (size, sign) = (duty.abs(), duty.signum());
        match self {
            Self::LockedAntiPhase => [
                (f64::midpoint(1.0, duty), 1.0),
                (f64::midpoint(1.0, -duty), -1.0),
                (0.0, 0.0),
                (0.0, 0.0),
            ],
            Self::SignMagnitude => [(size, sign), (1.0 - size, 0.0), (0.0, 0.0), (0.0, 0.0)],
            Self::Unipolar => {
                let (pulse, pause) = (size / 2.0, (1.0 - size) / 2.0);
                [(pulse, sign), (pause, 0.0), (pulse, sign), (pause, 0.0)]
            }
        }
    }
}

/// A motor on a switching bridge, at a constant rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwitchedMotor {
    /// Resistance of armature, leads and bridge in Ohm, > 0.
    pub resistance_ohm: f64,
    /// Inductance of the armature in H, > 0.
    pub inductance_h: f64,
    /// Supply in V.
    pub supply_v: f64,
    /// Frequency of the PWM in Hz, > 0.
    pub pwm_hz: f64,
}

/// The current of one period, once every period is like the one before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodicCurrent {
    /// Mean, which makes the torque, in A.
    pub mean_a: f64,
    /// Largest less smallest, in A: what a sensor that converts at any instant may be off by.
    pub ripple_a: f64,
    /// Root of the mean square, in A.
    pub rms_a: f64,
}

impl PeriodicCurrent {
    /// Heat that the ripple alone makes in a resistance of so many Ohm, in W.
    pub fn ripple_heat_w(&self, resistance_ohm: f64) -> f64 {
        resistance_ohm * (self.rms_a * self.rms_a - self.mean_a * self.mean_a)
    }
}

impl SwitchedMotor {
    /// The periodic current at a duty of -1 to 1 and a back-EMF in V.
    pub fn periodic(&self, modulation: Modulation, duty: f64, back_emf_v: f64) -> PeriodicCurrent {
        let tau_s = self.inductance_h / self.resistance_ohm;
        let stretches = modulation.stretches(duty).map(|(share, voltage)| {
            let seconds = share / self.pwm_hz;
            let settled_a = (voltage * self.supply_v - back_emf_v) / self.resistance_ohm;
            (seconds, settled_a, libm::exp(-seconds / tau_s))
        });
        // The whole period maps i to gain i + offset.
        let (gain, offset) = stretches
            .iter()
            .fold((1.0, 0.0), |(gain, offset), (_, settled_a, decay)| {
                (gain * decay, offset * decay + settled_a * (1.0 - decay))
            });
        let start_a = offset / (1.0 - gain);
        let mut current_a = start_a;
        let (mut least_a, mut most_a) = (start_a, start_a);
        let (mut charge, mut square) = (0.0, 0.0);
        for (seconds, settled_a, decay) in stretches {
            let lost_a = current_a - settled_a;
            charge += settled_a * seconds + lost_a * (1.0 - decay) * tau_s;
            square += settled_a * settled_a * seconds
                + 2.0 * settled_a * lost_a * (1.0 - decay) * tau_s
                + lost_a * lost_a * (1.0 - decay * decay) * tau_s / 2.0;
            current_a = settled_a + lost_a * decay;
            least_a = least_a.min(current_a);
            most_a = most_a.max(current_a);
        }
        PeriodicCurrent {
            mean_a: charge * self.pwm_hz,
            ripple_a: most_a - least_a,
            rms_a: libm::sqrt((square * self.pwm_hz).max(0.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A drive motor of the reference vehicle at a full battery.
    const DRIVE: SwitchedMotor = SwitchedMotor {
        resistance_ohm: 0.316,
        inductance_h: 80e-6,
        supply_v: 25.2,
        pwm_hz: 20_000.0,
    };

    #[test]
    fn the_mean_is_that_of_the_averaged_motor() {
        for modulation in Modulation::ALL {
            for duty in [-0.9, -0.3, 0.0, 0.5, 0.94] {
                for back_emf_v in [-10.0, 0.0, 7.0] {
                    let mean_a = DRIVE.periodic(modulation, duty, back_emf_v).mean_a;
                    let averaged_a = (duty * DRIVE.supply_v - back_emf_v) / DRIVE.resistance_ohm;
                    assert!(
                        (mean_a - averaged_a).abs() < 1e-9,
                        "{modulation:?} {duty} {back_emf_v}: {mean_a}"
                    );
                }
            }
        }
    }

    /// Without resistance the ripple is the textbook's: 2 V d (1 - d) / (L f) between the rails with d the share of the
    /// forward diagonal, V d (1 - d) / (L f) against zero, and half of that at twice the frequency at most.
    #[test]
    fn the_ripple_is_the_textbooks() {
        let motor = SwitchedMotor {
            resistance_ohm: 1e-6,
            ..DRIVE
        };
        let unit_a = motor.supply_v / (motor.inductance_h * motor.pwm_hz);
        for duty in [0.0, 0.1, 0.5, 0.94] {
            let d = f64::midpoint(1.0, duty);
            for (modulation, expected_a) in [
                (Modulation::LockedAntiPhase, 2.0 * unit_a * d * (1.0 - d)),
                (Modulation::SignMagnitude, unit_a * duty * (1.0 - duty)),
                (Modulation::Unipolar, unit_a * duty * (1.0 - duty) / 2.0),
            ] {
                let ripple_a = motor.periodic(modulation, duty, duty * motor.supply_v).ripple_a;
                assert!(
                    (ripple_a - expected_a).abs() < 1e-3 * unit_a,
                    "{modulation:?} {duty}: {ripple_a}"
                );
            }
        }
    }

    /// Against the current stepped through the period in ten thousand steps.
    #[test]
    fn mean_and_root_mean_square_are_those_of_the_stepped_current() {
        const STEPS: usize = 10_000;
        for modulation in Modulation::ALL {
            let step_s = 1.0 / (DRIVE.pwm_hz * STEPS as f64);
            let (duty, back_emf_v) = (0.4, 8.0);
            let mut current_a = 0.0;
            let (mut sum, mut square) = (0.0, 0.0);
            // After 60 periods, 12 time constants, each is like the one before.
            for _ in 0..60 {
                (sum, square) = (0.0, 0.0);
                for step in 0..STEPS {
                    let at = (step as f64 + 0.5) / STEPS as f64;
                    let mut end = 0.0;
                    let voltage = modulation
                        .stretches(duty)
                        .into_iter()
                        .find(|(share, _)| {
                            end += share;
                            at < end
                        })
                        .map_or(0.0, |(_, voltage)| voltage);
                    let slope =
                        (voltage * DRIVE.supply_v - DRIVE.resistance_ohm * current_a - back_emf_v) / DRIVE.inductance_h;
                    current_a += slope * step_s;
                    sum += current_a / STEPS as f64;
                    square += current_a * current_a / STEPS as f64;
                }
            }
            let exact = DRIVE.periodic(modulation, duty, back_emf_v);
            assert!((exact.mean_a - sum).abs() < 0.01, "{modulation:?}: {sum}");
            assert!((exact.rms_a - square.sqrt()).abs() < 0.01, "{modulation:?}: {square}");
        }
    }
}
