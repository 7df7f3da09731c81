//! The nondimensional models of a vehicle: the parameters of each chapter's equations, computed from the SI values.

use super::{MotorParameters, Vehicle};
use crate::dynamics::camera::CameraParameters;
use crate::dynamics::coupled::{Bearing, CoupledParameters};
use crate::dynamics::planar::PlanarParameters;
use crate::dynamics::spatial::SpatialParameters;
use crate::real::Real;

impl<T: Real> MotorParameters<T> {
    /// Time constant with which the rate of an unloaded rotor follows the voltage, s: `J R / (Kt Ke)`, 0 without inertia.
    pub fn free_rotor_s(&self) -> T {
        self.rotor_inertia_kg_m2 * self.resistance_ohm
            / (self.torque_constant_n_m_per_a * self.back_emf_constant_v_s_per_rad)
    }
}

impl<T: Real> Vehicle<T> {
    /// `(M + m) r^2`, kg m^2: the divisor of inertias in (3.10). The value equals mt R^2 of ch. 6, because
    /// `total_mass_kg` includes both wheels (erratum E20).
    fn inertia_kg_m2(&self) -> T {
        let body = &self.parameters().body;
        body.total_mass_kg * body.wheel_radius_m * body.wheel_radius_m
    }

    /// The nondimensional planar vehicle on the slope `beta_rad` (3.10, corrected: C is over M+m too,
    /// and zeta is the total damping, back-EMF included; erratum E1).
    pub fn planar(&self, beta_rad: T) -> PlanarParameters<T> {
        let (body, motor) = (&self.parameters().body, &self.parameters().drive_motor);
        let scales = self.scales();
        let inertia = self.inertia_kg_m2();
        let two = T::from_f64(2.0);
        let ratio2 = motor.gear_ratio * motor.gear_ratio;
        let back_emf =
            two * motor.torque_constant_n_m_per_a * motor.back_emf_constant_v_s_per_rad * ratio2 / motor.resistance_ohm;
        PlanarParameters {
            l: body.arm_length_m / body.wheel_radius_m,
            alpha: body.arm_mass_kg / body.total_mass_kg,
            zeta: (body.bearing_damping_n_m_s + back_emf) * scales.time_s / inertia,
            mu: body.wheels_inertia_kg_m2 / inertia,
            nu: two * ratio2 * motor.rotor_inertia_kg_m2 / inertia,
            beta: beta_rad,
        }
    }

    /// The nondimensional vehicle in space on a plane inclined by `slope_x_rad` and `slope_y_rad`
    /// (6.5): the planar numbers with half track and yaw inertia, without the spar, which
    /// [`SpatialParameters::carrying`] adds.
    pub fn spatial(&self, slope_x_rad: T, slope_y_rad: T) -> SpatialParameters<T> {
        let body = &self.parameters().body;
        let s = body.half_track_m / body.wheel_radius_m;
        let j0 = body.yaw_inertia_kg_m2 / self.inertia_kg_m2();
        SpatialParameters {
            slope_y: slope_y_rad,
            ..SpatialParameters::from_planar(&self.planar(slope_x_rad), s, j0)
        }
    }

    /// The nondimensional spar of ch. 7 (xi with the first power of w_c: erratum E27); `None` without a spar.
    pub fn camera(&self) -> Option<CameraParameters<T>> {
        let (spar, motor) = self.parameters().spar.as_ref()?;
        let scales = self.spar_scales()?;
        let (length, mass) = (spar.spar_length_m, spar.camera_mass_kg);
        let damping = scales.torque_n_m * scales.time_s;
        let back_emf =
            motor.torque_constant_n_m_per_a * motor.back_emf_constant_v_s_per_rad * motor.gear_ratio * motor.gear_ratio
                / motor.resistance_ohm;
        Some(CameraParameters {
            lm: spar.motor_distance_m / length,
            lr: spar.ballast_distance_m / length,
            mm: spar.motor_mass_kg / mass,
            mr: spar.ballast_mass_kg / mass,
            zeta: spar.spar_damping_n_m_s / damping,
            xi: back_emf / damping,
        })
    }

    /// The nondimensional vehicle with its spar on the slope `beta_rad` (8.5, corrected: everything over M + m, r and w;
    /// errata E34, E35); `None` without a spar.
    pub fn coupled(&self, beta_rad: T, bearing: Bearing) -> Option<CoupledParameters<T>> {
        let (spar, _) = self.parameters().spar.as_ref()?;
        let body = &self.parameters().body;
        let lp = spar.spar_length_m / body.wheel_radius_m;
        let kc = spar.camera_mass_kg / body.total_mass_kg;
        let planar = self.planar(beta_rad);
        Some(CoupledParameters::with_camera(planar, &self.camera()?, lp, kc, bearing))
    }
}
