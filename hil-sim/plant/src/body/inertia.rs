//! The inertia of the vehicle's bodies: masses, first and second moments.

use model::vehicle::Vehicle;

/// Constants of the equations of motion, SI.
#[derive(Debug, Clone, Copy)]
pub struct Inertia {
    /// Everything that moves with the axle, in kg.
    pub total_mass: f64,
    /// Mass of the arm including its payload, in kg.
    pub arm_mass: f64,
    /// First moment m l of the arm about the axle, including its payload, in kg m.
    pub arm_first: f64,
    /// Second moment m l^2 of the arm, including its payload, in kg m^2.
    pub arm_second: f64,
    /// Angle of the arm's centre of mass ahead of the arm's axis, in rad: 0 without a payload beside the
    /// axis.
    pub arm_offset: f64,
    /// First moment of the spar (camera above, motor and ballast's pivot below), hanging positive, in kg m.
    pub spar_first: f64,
    /// Second moment of the spar, including the ballast's mass at its pivot, in kg m^2.
    pub spar_second: f64,
    /// First moment of the ballast about its pivot, in kg m.
    pub ballast_first: f64,
    /// Second moment of the ballast about its pivot, in kg m^2.
    pub ballast_second: f64,
    /// Coupling of spar and ballast, m_r l_m l_r, in kg m^2.
    pub cross: f64,
    /// Yaw inertia with every mass at the axle: 2 m_w d^2 + J0, in kg m^2.
    pub yaw: f64,
    /// Spin inertia of one wheel, in kg m^2.
    pub wheel: f64,
    /// Rotor inertia of the left and the right drive at its output, n^2 J, in kg m^2; 0 where a gearbox with play lets
    /// the rotor turn freely.
    pub rotor: [f64; 2],
    /// Rotor inertia of the ballast motor at its output, in kg m^2.
    pub ballast_rotor: f64,
    /// Viscous damping between one wheel and the arm, in N m s.
    pub bearing_damping: f64,
    /// Viscous damping of the spar's bearing, pivoted on the arm, in N m s.
    pub spar_damping: f64,
    /// Mean of the wheels' radii, in m.
    pub radius: f64,
    /// The left wheel's radius less the right wheel's, in m.
    pub radius_difference: f64,
    /// Distance of the camera above the axle, in m.
    pub spar_length: f64,
    /// Half the track, in m.
    pub half_track: f64,
    /// Whether the vehicle has a spar.
    pub has_spar: bool,
}

impl Inertia {
    /// The constants of `vehicle`.
    pub fn new(vehicle: &Vehicle<f64>) -> Self {
        let p = vehicle.parameters();
        let (b, d) = (&p.body, &p.drive_motor);
        let wheels_mass = b.total_mass_kg - b.arm_mass_kg;
        let arm_first = b.arm_mass_kg * b.arm_length_m;
        let mut inertia = Self {
            total_mass: b.total_mass_kg,
            arm_mass: b.arm_mass_kg,
            arm_first,
            arm_second: arm_first * b.arm_length_m,
            arm_offset: 0.0,
            spar_first: 0.0,
            spar_second: 0.0,
            ballast_first: 0.0,
            ballast_second: 0.0,
            cross: 0.0,
            yaw: wheels_mass * b.half_track_m * b.half_track_m + b.yaw_inertia_kg_m2,
            // A wheel without inertia would have no equation of motion while off the ground.
            wheel: (0.5 * b.wheels_inertia_kg_m2).max(1e-6 * b.total_mass_kg * b.wheel_radius_m * b.wheel_radius_m),
            rotor: [d.gear_ratio * d.gear_ratio * d.rotor_inertia_kg_m2; 2],
            ballast_rotor: 0.0,
            bearing_damping: 0.5 * b.bearing_damping_n_m_s,
            spar_damping: 0.0,
            radius: b.wheel_radius_m,
            radius_difference: 0.0,
            spar_length: 0.0,
            half_track: b.half_track_m,
            has_spar: false,
        };
        if let Some((c, m)) = &p.spar {
            let below = c.motor_mass_kg + c.ballast_mass_kg;
            inertia.has_spar = true;
            inertia.spar_length = c.spar_length_m;
            inertia.total_mass += c.camera_mass_kg + below;
            inertia.spar_first = below * c.motor_distance_m - c.camera_mass_kg * c.spar_length_m;
            inertia.spar_second =
                below * c.motor_distance_m * c.motor_distance_m + c.camera_mass_kg * c.spar_length_m * c.spar_length_m;
            inertia.ballast_first = c.ballast_mass_kg * c.ballast_distance_m;
            inertia.ballast_second = inertia.ballast_first * c.ballast_distance_m;
            inertia.cross = inertia.ballast_first * c.motor_distance_m;
            inertia.ballast_rotor = m.gear_ratio * m.gear_ratio * m.rotor_inertia_kg_m2;
            inertia.spar_damping = c.spar_damping_n_m_s;
        }
        inertia
    }
}
