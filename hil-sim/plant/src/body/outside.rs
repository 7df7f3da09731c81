//! External constraints and forces on the bodies: chocks, a seized wheel, a stand under the axle, a push.

use super::ldl::{Speeds, Symmetric};
use super::motion::Configuration;
use super::{Body, FORWARD, JOINTS, LEFT, LIFT, PHI, RIGHT, SIDE, SPAR, YAW};
use crate::terrain::Ground;

/// Stiffness of a chock or a seized gearbox on the held rate, in N m s/rad.
const HOLD_N_M_S: f64 = 1e7;
/// Stiffness of a stand on the axle's speeds and yaw rate, in N s/m and N m s/rad: 13 kg sink by 0.1 um/s.
const STAND_N_S_M: f64 = 1e9;
/// Height by which a stand lifts the axle, in m.
const STAND_M: f64 = 0.05;

/// The body on which a push acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PushedBody {
    /// The middle of the axle.
    Axle,
    /// The arm's centre of mass.
    Arm,
    /// The camera on the spar's upper end.
    Spar,
}

/// An external force in the heading's axes, in N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    /// The body on which the force acts.
    pub on: PushedBody,
    /// Along the heading.
    pub forward_n: f64,
    /// To the left.
    pub left_n: f64,
    /// Off the plane.
    pub up_n: f64,
}

/// All external constraints and forces.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Outside {
    chocked: bool,
    /// Left and right wheel seized against the arm.
    jammed: [bool; 2],
    on_stand: bool,
    push: Option<Push>,
    /// Whether any of these is present.
    pub(super) acts: bool,
    /// Moment of a push about the axle's forward axis over the last substep, for the roll balance.
    pub(super) roll_n_m: f64,
}

impl Outside {
    fn update(&mut self) {
        self.acts = self.chocked || self.jammed != [false; 2] || self.on_stand || self.push.is_some();
        self.roll_n_m = 0.0;
    }
}

impl Body {
    /// Whether chocks (a hand on the rims) block the wheels. The arm still swings.
    pub fn chocked(&self) -> bool {
        self.outside.chocked
    }

    /// Puts chocks to the wheels or takes them away.
    pub fn set_chocked(&mut self, chocked: bool) {
        self.outside.chocked = chocked;
        self.outside.update();
    }

    /// Seizes a wheel (left 0, right 1) against the arm, or frees it.
    pub fn set_jammed(&mut self, wheel: usize, jammed: bool) {
        if let Some(slot) = self.outside.jammed.get_mut(wheel) {
            *slot = jammed;
            self.outside.update();
        }
    }

    /// Starts a push, or ends it with `None`.
    pub fn set_push(&mut self, push: Option<Push>) {
        self.outside.push = push;
        self.outside.update();
    }

    /// The push in force.
    pub fn push(&self) -> Option<Push> {
        self.outside.push
    }

    /// Whether the axle rests on a stand.
    pub fn on_stand(&self) -> bool {
        self.outside.on_stand
    }

    /// Puts the axle on a stand, at rest with the wheels 50 mm off the ground, or back on the ground.
    pub fn set_on_stand(&mut self, ground: &Ground, on_stand: bool) {
        if self.outside.on_stand == on_stand {
            return;
        }
        self.outside.on_stand = on_stand;
        self.outside.update();
        for index in [FORWARD, SIDE, LIFT, YAW] {
            self.speed[index] = 0.0;
        }
        let reach = self.inertia.half_track * libm::sin(self.position[YAW]);
        let x = self.position[FORWARD];
        let height = 0.5 * (ground.wheel(x + reach).height_m + ground.wheel(x - reach).height_m);
        self.position[LIFT] = if on_stand { height + STAND_M } else { height };
        self.in_flight = on_stand;
    }

    /// Adds the external terms to the matrix and the impulses of a substep of `h` seconds.
    pub(super) fn act(&mut self, h: f64, c: &Configuration, a: &mut Symmetric, b: &mut Speeds) {
        let u = self.speed;
        let mut hold = |row: &[(usize, f64)], stiffness: f64| {
            let rate: f64 = row.iter().map(|&(index, value)| value * u[index]).sum();
            for &(i, vi) in row {
                b[i] -= h * stiffness * vi * rate;
                for &(j, vj) in row.iter().filter(|&&(j, _)| j <= i) {
                    a[i][j] += h * stiffness * vi * vj;
                }
            }
        };
        if self.outside.chocked {
            hold(&[(RIGHT, 1.0)], HOLD_N_M_S);
            hold(&[(LEFT, 1.0)], HOLD_N_M_S);
        }
        if self.outside.on_stand {
            for index in [FORWARD, SIDE, LIFT, YAW] {
                hold(&[(index, 1.0)], STAND_N_S_M);
            }
        }
        for (row, jammed) in JOINTS.iter().zip(self.outside.jammed) {
            if jammed {
                hold(row, HOLD_N_M_S);
            }
        }
        if let Some(push) = self.outside.push {
            // The place `radius` below the axle along a body that has swung to (sin, cos).
            let (radius, (sin, cos), swing) = match push.on {
                PushedBody::Axle => (0.0, (0.0, 1.0), None),
                PushedBody::Arm => (self.inertia.arm_first / self.inertia.arm_mass, c.arm, Some(PHI)),
                PushedBody::Spar => (-self.inertia.spar_length, c.spar, Some(SPAR)),
            };
            b[FORWARD] += h * push.forward_n;
            b[SIDE] += h * push.left_n;
            b[LIFT] += h * push.up_n;
            b[YAW] += h * radius * sin * push.left_n;
            if let Some(index) = swing {
                b[index] += h * radius * (cos * push.forward_n + sin * push.up_n);
            }
            self.outside.roll_n_m = radius * cos * push.left_n;
        }
    }
}
