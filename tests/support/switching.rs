//! A motor's current within one period of the bridge's PWM; the plant's motors average over this period.
//!
//! Within an interval of the period the bridge applies +1, 0 or -1 times the supply to the motor, or it is open. With a
//! constant rate over the period the armature `L i' = V - R i - e` has the exact solution
//!
//! ```text
//! i(h) = i_inf + (i(0) - i_inf) E,   i_inf = (V - e) / R,   E = exp(-h R / L)
//! ```
//!
//! The integral over an interval is `(i_inf h) + (i(0) - i_inf) (1 - E) L / R`; the integral of the square follows in
//! the same way. In an open bridge the current continues through the diodes, against the supply, until it reaches 0. A
//! period maps the current at its beginning to the current at its end and reduces the difference of two currents at
//! least by `exp(-T R / L)`, so every initial current converges to the periodic current.

#![allow(dead_code)] // Each test binary uses part of it.

/// How the bridge produces a mean voltage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Modulation {
    /// The two diagonals alternate: +V and -V. With half of the period each, the mean is 0.
    LockedAntiPhase,
    /// The bridge alternately drives one way and brakes: +V or -V, and 0 (sign-magnitude, slow decay). The firmware
    /// uses this modulation.
    DriveBrake,
    /// The bridge alternately drives one way and is open (fast decay).
    DriveOpen,
    /// Both legs switch with their own shares of the period, aligned at their centres. Both legs low and both legs high
    /// give zero volts: two pulses per period.
    Unipolar,
    /// The same signals into a driver that is open while both are low.
    UnipolarOpen,
}

/// The state of a bridge within an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BridgeHold {
    /// The bridge applies this share of the supply.
    At(f64),
    /// No transistor conducts.
    Open,
}

/// Intervals of a period: share of the period, and state of the bridge.
pub type Stretches = [(f64, BridgeHold); 4];

impl Modulation {
    /// Every modulation.
    pub const ALL: [Self; 5] = [
        Self::LockedAntiPhase,
        Self::DriveBrake,
        Self::DriveOpen,
        Self::Unipolar,
        Self::UnipolarOpen,
    ];

    /// The modulation in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::LockedAntiPhase => "locked anti-phase",
            Self::DriveBrake => "drive and brake",
            Self::DriveOpen => "drive and open",
            Self::Unipolar => "unipolar, both low = 0 V",
            Self::UnipolarOpen => "unipolar, both low = open",
        }
    }

    /// The intervals of a period for a duty of -1 to 1.
    pub fn stretches(self, duty: f64) -> Stretches {
        const BRAKE: BridgeHold = BridgeHold::At(0.0);
        let (size, drive) = (duty.abs(), BridgeHold::At(duty.signum()));
        let nothing = (0.0, BRAKE);
        let (pulse, pause) = (size / 2.0, (1.0 - size) / 2.0);
        match self {
            Self::LockedAntiPhase => [
                (f64::midpoint(1.0, duty), BridgeHold::At(1.0)),
                (f64::midpoint(1.0, -duty), BridgeHold::At(-1.0)),
                nothing,
                nothing,
            ],
            Self::DriveBrake => [(size, drive), (1.0 - size, BRAKE), nothing, nothing],
            Self::DriveOpen => [(size, drive), (1.0 - size, BridgeHold::Open), nothing, nothing],
            Self::Unipolar => [(pulse, drive), (pause, BRAKE), (pulse, drive), (pause, BRAKE)],
            Self::UnipolarOpen => [
                (pulse, drive),
                (pause, BRAKE),
                (pulse, drive),
                (pause, BridgeHold::Open),
            ],
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

/// The current of one period in the periodic state.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::struct_field_names)] // The unit ends a name.
pub struct PeriodicCurrent {
    /// Mean, which determines the torque, in A.
    pub mean_a: f64,
    /// Largest less smallest current, in A: the possible error of a sensor that converts at an arbitrary instant.
    pub ripple_a: f64,
    /// Root of the mean square, in A.
    pub rms_a: f64,
}

impl PeriodicCurrent {
    /// Heat of the ripple alone in a resistance, in W.
    pub fn ripple_heat_w(&self, resistance_ohm: f64) -> f64 {
        resistance_ohm * (self.rms_a * self.rms_a - self.mean_a * self.mean_a)
    }
}

/// A current's course through a period.
#[derive(Debug, Clone, Copy)]
struct CurrentPeriod {
    current_a: f64,
    least_a: f64,
    most_a: f64,
    charge_as: f64,
    square_a2s: f64,
}

impl SwitchedMotor {
    /// The periodic current at a duty of -1 to 1 and a back-EMF in V, smaller than the supply.
    pub fn periodic(&self, modulation: Modulation, duty: f64, back_emf_v: f64) -> PeriodicCurrent {
        let stretches = modulation.stretches(duty);
        let start_a = self.periodic_start_a(&stretches, back_emf_v);
        let period = self.period(&stretches, back_emf_v, start_a);
        PeriodicCurrent {
            mean_a: period.charge_as * self.pwm_hz,
            ripple_a: period.most_a - period.least_a,
            rms_a: libm::sqrt(period.square_a2s * self.pwm_hz),
        }
    }

    /// The periodic current of drive and brake at `after_s` (which may be negative) from the middle of the braking
    /// interval and within it: the reading of a converter that samples at that instant.
    pub fn braking_a(&self, duty: f64, back_emf_v: f64, after_s: f64) -> f64 {
        let stretches = Modulation::DriveBrake.stretches(duty);
        let start_a = self.periodic_start_a(&stretches, back_emf_v);
        let (drive, brake) = (duty.abs(), (1.0 - duty.abs()) / (2.0 * self.pwm_hz) + after_s);
        let share = brake * self.pwm_hz;
        let until = [(drive, BridgeHold::At(duty.signum())), (share, BridgeHold::At(0.0))];
        self.period(&until, back_emf_v, start_a).current_a
    }

    /// The current at the beginning of a period in the periodic state.
    fn periodic_start_a(&self, stretches: &Stretches, back_emf_v: f64) -> f64 {
        // After this many time constants the initial current is below the resolution of a double.
        let periods = (40.0 * self.inductance_h / self.resistance_ohm * self.pwm_hz).ceil();
        let mut start_a = 0.0;
        for _ in 0..periods as u64 {
            start_a = self.period(stretches, back_emf_v, start_a).current_a;
        }
        start_a
    }

    /// One period, or its first intervals, starting with a current.
    fn period(&self, stretches: &[(f64, BridgeHold)], back_emf_v: f64, start_a: f64) -> CurrentPeriod {
        let mut period = CurrentPeriod {
            current_a: start_a,
            least_a: start_a,
            most_a: start_a,
            charge_as: 0.0,
            square_a2s: 0.0,
        };
        for (share, held) in stretches {
            let seconds = share / self.pwm_hz;
            match held {
                BridgeHold::At(voltage) => self.conduct(&mut period, seconds, voltage * self.supply_v - back_emf_v),
                BridgeHold::Open => {
                    let diodes_v = -period.current_a.signum() * self.supply_v - back_emf_v;
                    let gone_s = self.gone_after_s(period.current_a, diodes_v);
                    self.conduct(&mut period, seconds.min(gone_s), diodes_v);
                    // The remainder after the current has ended is a rounding error.
                    if period.current_a.signum() * diodes_v > 0.0 {
                        period.current_a = 0.0;
                    }
                }
            }
        }
        period
    }

    /// Time after which an opposing voltage has reduced a current to 0.
    fn gone_after_s(&self, current_a: f64, voltage_v: f64) -> f64 {
        let settled_a = voltage_v / self.resistance_ohm;
        libm::log1p(-current_a / settled_a) * self.inductance_h / self.resistance_ohm
    }

    /// Advances the current by a time under the voltage less the back-EMF.
    fn conduct(&self, period: &mut CurrentPeriod, seconds: f64, voltage_v: f64) {
        let tau_s = self.inductance_h / self.resistance_ohm;
        let (settled_a, decay) = (voltage_v / self.resistance_ohm, libm::exp(-seconds / tau_s));
        let lost_a = period.current_a - settled_a;
        period.charge_as += settled_a * seconds + lost_a * (1.0 - decay) * tau_s;
        period.square_a2s += settled_a * settled_a * seconds
            + 2.0 * settled_a * lost_a * (1.0 - decay) * tau_s
            + lost_a * lost_a * (1.0 - decay * decay) * tau_s / 2.0;
        period.current_a = settled_a + lost_a * decay;
        period.least_a = period.least_a.min(period.current_a);
        period.most_a = period.most_a.max(period.current_a);
    }
}
