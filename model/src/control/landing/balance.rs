//! The equations of motion at torque level: every acceleration and contact force as a linear function of the torque.
//!
//! With the torque at the joint as input, theta' drops out of (3.12) and (3.13): the arm is a plane system of phi
//! and phi' alone.

use crate::real::Real;

/// A linear function of the torque: `at_zero + per_torque * torque`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Affine<T> {
    /// Value without torque.
    pub at_zero: T,
    /// Change per unit of torque.
    pub per_torque: T,
}

impl<T: Real> Affine<T> {
    /// The value at `torque`.
    #[inline]
    pub fn at(&self, torque: T) -> T {
        self.at_zero + self.per_torque * torque
    }

    /// The torque that gives `value`.
    #[inline]
    pub fn solve(&self, value: T) -> T {
        (value - self.at_zero) / self.per_torque
    }
}

/// The vehicle's nondimensional inertias, with its spar carried by the axle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance<T> {
    /// `1 + S`: all mass over M + m.
    pub mass: T,
    /// `alpha L`: first moment of the arm.
    pub alpha_l: T,
    /// `alpha L^2`: second moment of the arm.
    pub alpha_l2: T,
    /// `mu`: inertia of the wheels.
    pub mu: T,
    /// `nu`: reflected inertia of the rotors.
    pub nu: T,
}

/// Accelerations and contact forces at one state, as functions of the torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionByTorque<T> {
    /// theta''.
    pub wheel: Affine<T>,
    /// phi''.
    pub arm: Affine<T>,
    /// Friction on the wheels, up the slope positive.
    pub friction: Affine<T>,
    /// Normal force on the wheels.
    pub normal: Affine<T>,
    /// theta'' per unit of the slope's sine, at constant torque.
    pub wheel_per_sin_slope: T,
}

impl<T: Real> Balance<T> {
    /// The motion with the arm at an angle of sine and cosine `arm`, its rate `phi_rate`, on a slope of sine and
    /// cosine `slope`: (3.12) and (3.13) solved for the accelerations, and the contact forces of ch. 4.
    ///
    /// ```
    /// use model::control::landing::Balance;
    /// use model::dynamics::planar::{Planar, PlanarParameters};
    /// let thesis = PlanarParameters::<f64>::thesis();
    /// let balance = Balance { mass: 1.0, alpha_l: 0.72, alpha_l2: 0.576, mu: 0.066, nu: 0.0 };
    /// let motion = balance.motion(0.3_f64.sin_cos(), 0.5, thesis.beta.sin_cos());
    /// // The same state under the same torque: u less the damping at theta' = 1.
    /// let (u, torque) = (4.0, 4.0 - 2.2 * (1.0 + 0.5));
    /// let [wheel, arm] = Planar::new(thesis).accelerations(&[0.0, 0.3, 1.0, 0.5], u);
    /// assert!((motion.wheel.at(torque) - wheel).abs() < 1e-12 && (motion.arm.at(torque) - arm).abs() < 1e-12);
    /// let forces = Planar::new(thesis).contact_forces(&[0.0, 0.3, 1.0, 0.5], u);
    /// assert!((motion.friction.at(torque) - forces.friction).abs() < 1e-12);
    /// assert!((motion.normal.at(torque) - forces.normal).abs() < 1e-12);
    /// ```
    #[inline]
    pub fn motion(&self, arm: (T, T), phi_rate: T, slope: (T, T)) -> MotionByTorque<T> {
        let ((sin_phi, cos_phi), (sin_beta, cos_beta)) = (arm, slope);
        // Of phi - beta, by the addition theorem.
        let sin = sin_phi * cos_beta - cos_phi * sin_beta;
        let cos = cos_phi * cos_beta + sin_phi * sin_beta;
        let centripetal = self.alpha_l * phi_rate * phi_rate;
        let m11 = self.mass + self.mu + self.nu;
        let m22 = self.alpha_l2 + self.nu;
        let m12 = self.alpha_l * cos + self.nu;
        let inverse = T::ONE / (m11 * m22 - m12 * m12);
        let along = sin * centripetal - self.mass * sin_beta;
        let weight = self.alpha_l * sin_phi;
        let wheel = Affine {
            at_zero: (m22 * along + m12 * weight) * inverse,
            per_torque: (m22 - m12) * inverse,
        };
        let swing = Affine {
            at_zero: -(m11 * weight + m12 * along) * inverse,
            per_torque: (m11 - m12) * inverse,
        };
        MotionByTorque {
            wheel,
            arm: swing,
            friction: Affine {
                at_zero: self.mass * (wheel.at_zero + sin_beta) + self.alpha_l * cos * swing.at_zero
                    - sin * centripetal,
                per_torque: self.mass * wheel.per_torque + self.alpha_l * cos * swing.per_torque,
            },
            normal: Affine {
                at_zero: self.mass * cos_beta + self.alpha_l * sin * swing.at_zero + cos * centripetal,
                per_torque: self.alpha_l * sin * swing.per_torque,
            },
            wheel_per_sin_slope: -(m22 * self.mass) * inverse,
        }
    }

    /// The motion of a vehicle whose wheels are blocked: the arm is a pendulum on a fixed axle. The contact forces
    /// are reported as 0, because those of a free wheel do not apply.
    #[inline]
    pub fn blocked_motion(&self, sin_phi: T) -> MotionByTorque<T> {
        let none = Affine {
            at_zero: T::ZERO,
            per_torque: T::ZERO,
        };
        let inverse = T::ONE / (self.alpha_l2 + self.nu);
        MotionByTorque {
            wheel: none,
            arm: Affine {
                at_zero: -(self.alpha_l * sin_phi) * inverse,
                per_torque: inverse,
            },
            friction: none,
            normal: none,
            wheel_per_sin_slope: T::ZERO,
        }
    }
}
