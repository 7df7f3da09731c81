//! What a motor's current does within one period of the bridge's PWM, which the plant's motors average over.
//!
//! Within a stretch of the period the bridge holds +1, 0 or -1 times the supply at the motor, or it is open. With the rate
//! constant over the period the armature `L i' = V - R i - e` has the exact solution
//!
//! ```text
//! i(h) = i_inf + (i(0) - i_inf) E,   i_inf = (V - e) / R,   E = exp(-h R / L)
//! ```
//!
//! The integral of a stretch is `(i_inf h) + (i(0) - i_inf) (1 - E) L / R`; that of the square follows alike. In an open
//! bridge the current flows on through the diodes, against the supply, until it has gone; then none flows. A period maps the
//! current at its begin to the one at its end, and shrinks the distance of two currents at least by `exp(-T R / L)`: so the
//! periodic current is what any current becomes.

/// How the bridge makes a mean voltage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Modulation {
    /// The two diagonals in turn: +V and -V. At half of the period each, the mean is 0.
    LockedAntiPhase,
    /// Drive one way and brake in turn: +V or -V, and 0 (sign-magnitude, slow decay). What the firmware does.
    DriveBrake,
    /// Drive one way and leave open in turn (fast decay).
    DriveOpen,
    /// Both legs switch, each with its own share of the period, aligned at their centres, on half-bridges of which both low
    /// are zero volts as both high are: two pulses a period.
    Unipolar,
    /// The same lines into a driver that is open at both low.
    UnipolarOpen,
}

/// What a bridge does with its motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BridgeHold {
    /// Holds it at this share of the supply.
    At(f64),
    /// No transistor conducts.
    Open,
}

/// Stretches of a period: share of the period, and state of the bridge.
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

    /// The stretches of a period for a duty of -1 to 1.
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

/// The current of one period, once every period is like the one before.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::struct_field_names)] // The unit ends each name.
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

/// What a period does to a current.
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

    /// The periodic current of drive and brake, so long after the middle of the brake, which may be negative and within the
    /// brake: what a converter reads that samples there.
    pub fn braking_a(&self, duty: f64, back_emf_v: f64, after_s: f64) -> f64 {
        let stretches = Modulation::DriveBrake.stretches(duty);
        let start_a = self.periodic_start_a(&stretches, back_emf_v);
        let (drive, brake) = (duty.abs(), (1.0 - duty.abs()) / (2.0 * self.pwm_hz) + after_s);
        let share = brake * self.pwm_hz;
        let until = [(drive, BridgeHold::At(duty.signum())), (share, BridgeHold::At(0.0))];
        self.period(&until, back_emf_v, start_a).current_a
    }

    /// The current at the begin of a period, once every period is like the one before.
    fn periodic_start_a(&self, stretches: &Stretches, back_emf_v: f64) -> f64 {
        // So many time constants leave nothing of the first current that a double could hold.
        let periods = (40.0 * self.inductance_h / self.resistance_ohm * self.pwm_hz).ceil();
        let mut start_a = 0.0;
        for _ in 0..periods as u64 {
            start_a = self.period(stretches, back_emf_v, start_a).current_a;
        }
        start_a
    }

    /// One period that begins with a current, or the first stretches of one.
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
                    // What is left after the current has gone is a rounding error.
                    if period.current_a.signum() * diodes_v > 0.0 {
                        period.current_a = 0.0;
                    }
                }
            }
        }
        period
    }

    /// Time after which a current under a voltage that opposes it has gone.
    fn gone_after_s(&self, current_a: f64, voltage_v: f64) -> f64 {
        let settled_a = voltage_v / self.resistance_ohm;
        libm::log1p(-current_a / settled_a) * self.inductance_h / self.resistance_ohm
    }

    /// Lets the current flow for a time under what the supply leaves of the back-EMF.
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
