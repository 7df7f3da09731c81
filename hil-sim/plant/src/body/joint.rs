//! The torque law of a motor at its joint.

use super::contact::LinearInOne;

/// Branch of a motor's law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Branch {
    Linear,
    Upper,
    Lower,
}

/// A motor's torque at its joint within one substep: `constant - damping * mean rate` within its limit, and dry
/// friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointTorque {
    /// Torque at rate zero, in N m at the gearbox output.
    pub constant_n_m: f64,
    /// Slope against the mean rate over the substep, in N m s/rad.
    pub damping_n_m_s: f64,
    /// Largest torque in either direction, in N m, at which the bridge chops.
    pub limit_n_m: f64,
    /// Coulomb friction at the output, in N m.
    pub coulomb_n_m: f64,
}

impl JointTorque {
    /// No motor.
    pub const NONE: Self = Self {
        constant_n_m: 0.0,
        damping_n_m_s: 0.0,
        limit_n_m: f64::INFINITY,
        coulomb_n_m: 0.0,
    };

    /// The law's branch at a mean rate: the linear branch, or a constant torque at a limit.
    #[inline]
    pub(super) fn branch(&self, mean_rate: f64) -> Branch {
        let torque = self.constant_n_m - self.damping_n_m_s * mean_rate;
        if torque.abs() <= self.limit_n_m {
            Branch::Linear
        } else if torque > 0.0 {
            Branch::Upper
        } else {
            Branch::Lower
        }
    }

    /// The branch to try after a solution on `branch` gave a mean rate. A rate that passes from one limit beyond
    /// the other has crossed the linear branch, so the linear branch is next. Otherwise a stiff law would jump from
    /// limit to limit for ever.
    pub(super) fn next_branch(&self, branch: Branch, mean_rate: f64) -> Branch {
        match (branch, self.branch(mean_rate)) {
            (Branch::Upper, Branch::Lower) | (Branch::Lower, Branch::Upper) => Branch::Linear,
            (_, found) => found,
        }
    }

    /// Constant and damping of a branch.
    pub(super) fn on(&self, branch: Branch) -> (f64, f64) {
        match branch {
            Branch::Linear => (self.constant_n_m, self.damping_n_m_s),
            Branch::Upper => (self.limit_n_m, 0.0),
            Branch::Lower => (-self.limit_n_m, 0.0),
        }
    }
}

/// A motor's joint within a substep: the motor's law with viscous and dry friction.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct JointTerm {
    /// Impulse at the initial rate.
    pub(super) impulse: f64,
    /// Loss of impulse per rad/s of rate gained within the substep.
    pub(super) damping: f64,
}

impl JointTerm {
    /// The term of a joint at `rate`, from the torque at rate zero, its slope, and the dry friction. The mean rate
    /// is taken at the share `weight` of the substep of `h` seconds.
    #[inline]
    pub(super) fn new(h: f64, (constant, damping): (f64, f64), dry: LinearInOne, rate: f64, weight: f64) -> Self {
        Self {
            impulse: h * (constant - dry.constant - (damping + dry.stiffness) * rate),
            damping: h * (weight * damping + dry.stiffness),
        }
    }
}
