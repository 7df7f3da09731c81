//! The vehicle's parameters in SI units, as an engineer measures them.
//!
//! Each group is a table of the vehicle file; the list of groups is in the parent module. The ranges cover every
//! vehicle that fits on a bench: they refuse misplaced decimal points, not designs.

use super::fields::parameter_group;

parameter_group! {
    /// Geometry and masses of the vehicle without its camera spar.
    BodyParameters {
        /// Wheel radius r.
        wheel_radius_m: 0.01 to 2.0,
        /// Total mass M + m: both wheels and the arm.
        total_mass_kg: 0.05 to 2000.0,
        /// Mass m of the arm (the thesis's reaction mass); must be less than the total mass (alpha = m / (M + m) < 1).
        arm_mass_kg: 0.01 to 2000.0,
        /// Distance l of the arm's centre of mass from the axle.
        arm_length_m: 0.005 to 2.0,
        /// Rotational inertia I of both wheels together about the axle.
        wheels_inertia_kg_m2: 0.0 to 1000.0,
        /// Half the track, d: distance of each wheel's contact from the vehicle's middle.
        half_track_m: 0.01 to 2.0,
        /// Yaw inertia beyond that of two point masses at the wheel centres.
        yaw_inertia_kg_m2: 0.0 to 1000.0,
        /// Viscous damping C between wheels and arm, both sides together.
        bearing_damping_n_m_s: 0.0 to 1000.0,
    }
}

parameter_group! {
    /// One motor with its gearbox and encoder: each of the two drive motors, or the ballast motor.
    MotorParameters {
        /// Torque constant of the motor shaft.
        torque_constant_n_m_per_a: 0.0001 to 10.0,
        /// Back-EMF constant of the motor shaft.
        back_emf_constant_v_s_per_rad: 0.0001 to 10.0,
        /// Armature resistance, leads and bridge included.
        resistance_ohm: 0.001 to 100.0,
        /// Armature inductance.
        inductance_h: 0.0 to 0.1,
        /// Rotor inertia of the motor shaft.
        rotor_inertia_kg_m2: 0.0 to 0.1,
        /// Gear ratio: motor turns per turn of the output.
        gear_ratio: 1.0 to 1000.0,
        /// Largest armature current that the vehicle commands.
        current_limit_a: 0.01 to 500.0,
        /// Current that the motor withstands indefinitely; above it the vehicle limits the heat of the winding.
        continuous_current_a: 0.01 to 500.0,
        /// Thermal time constant of the winding.
        winding_time_constant_s: 0.1 to 10000.0,
        /// Current that the motor's bridge withstands indefinitely in the hottest air of its operation; above it the vehicle
        /// limits the heat of the bridge. 500 A is no bound beyond the other limits.
        bridge_continuous_a: 0.01 to 500.0 or 500.0,
        /// Thermal time constant of the bridge: its package on its copper.
        bridge_time_constant_s: 0.05 to 1000.0 or 3.0,
        /// Coulomb friction at the gearbox output.
        coulomb_friction_n_m: 0.0 to 100.0,
        /// Encoder counts (four per line) per turn of the motor shaft.
        encoder_counts_per_rev: 4.0 to 65536.0 in counts,
    }
}

parameter_group! {
    /// The camera spar: the camera above the axle, the ballast motor and the ballast below it.
    SparParameters {
        /// Distance of the camera above the axle, l_c.
        spar_length_m: 0.02 to 5.0,
        /// Camera mass m_c.
        camera_mass_kg: 0.005 to 200.0,
        /// Mass m_m of the ballast motor, which sits on the spar below the axle.
        motor_mass_kg: 0.0 to 500.0,
        /// Ballast mass m_r.
        ballast_mass_kg: 0.005 to 500.0,
        /// Distance l_m of the ballast motor below the axle.
        motor_distance_m: 0.001 to 5.0,
        /// Distance l_r of the ballast from the ballast motor.
        ballast_distance_m: 0.001 to 5.0,
        /// Viscous damping c of the spar's bearing.
        spar_damping_n_m_s: 0.0 to 100.0,
        /// Gain g1 of Eq. 7.19 on the spar's angle, in the units of ch. 7 (`hil-sim lqr`); four zeros: no levelling.
        spar_gain: -10000.0 to 10000.0,
        /// Gain g2 on the ballast's angle relative to the spar.
        ballast_gain: -10000.0 to 10000.0,
        /// Gain g3 on the spar's rate.
        spar_rate_gain: -10000.0 to 10000.0,
        /// Gain g4 on the ballast's rate relative to the spar.
        ballast_rate_gain: -10000.0 to 10000.0,
    }
}

parameter_group! {
    /// Positions of the IMUs. Their axes: x forward, y left, z up while the vehicle stands level.
    ImuParameters {
        /// Distance of the arm IMU from the axle, positive towards the arm's centre of mass.
        arm_radius_m: -2.0 to 2.0,
        /// Distance of the spar IMU above the axle, along the spar.
        spar_radius_m: -5.0 to 5.0 bare 0.0,
    }
}

parameter_group! {
    /// The supply.
    BatteryParameters {
        /// Open-circuit voltage of a full battery.
        nominal_v: 3.0 to 60.0,
        /// Below this voltage the vehicle does not arm; while driving it comes to a controlled stop.
        minimum_v: 2.0 to 60.0,
        /// Above this voltage (regeneration) the vehicle does not arm; while driving it opens the bridges.
        maximum_v: 3.0 to 80.0,
        /// Internal resistance, leads included.
        resistance_ohm: 0.0 to 10.0,
    }
}

parameter_group! {
    /// The choice of the speed law, its limits and gains.
    ControlParameters {
        /// Speed law: Eq. 3.25 with its additions (0), or the landing law (1), whose gains follow from the vehicle.
        law: 0.0 to 1.0 or 1.0: "eq-3.25", "landing",
        /// Largest forward or backward speed.
        speed_max_m_s: 0.0 to 20.0,
        /// Largest commanded acceleration of the axle.
        acceleration_max_m_s2: 0.01 to 20.0,
        /// Friction coefficient of the tyres on the ground; the landing law plans with three quarters of it.
        grip_mu: 0.05 to 2.0,
        /// Time constant that smooths the commanded speed, for the camera; longer is softer and slower.
        comfort_s: 0.0 to 2.0 or 0.2,
        /// Position hold at rest: speed per metre of displacement; 0 holds the speed only.
        hold_kp_per_s: 0.0 to 2.0 or 0.4,
        /// Eq. 3.25: speed gain, nondimensional; it multiplies theta' - reference (+0.8 in the thesis).
        kp: -20.0 to 5.0 or 0.8,
        /// Eq. 3.25: gain on the arm's rate phi', nondimensional.
        kd: 0.0 to 25.0 or 10.0,
        /// Eq. 3.25: slow integral gain on the speed error against unmodelled friction, nondimensional.
        ki: 0.0 to 1.0 or 0.06,
        /// Eq. 3.25: swing damping, gain on phi less its equilibrium, nondimensional; 0 leaves Eq. 3.25 alone.
        swing_gain: 0.0 to 10.0 or 4.0,
        /// Yaw-rate gain: voltage per rad/s of error.
        yaw_kp_v_s_per_rad: 0.0 to 200.0 by YawGain,
        /// Integral yaw-rate gain: voltage per rad of integrated error.
        yaw_ki_v_per_rad: 0.0 to 500.0 by YawIntegral,
        /// Heading-hold gain: yaw rate per rad of heading error.
        heading_kp_per_s: 0.0 to 10.0 by HeadingGain,
        /// Largest yaw rate.
        yaw_rate_max_rad_s: 0.0 to 20.0,
        /// Largest commanded yaw acceleration.
        yaw_acceleration_max_rad_s2: 0.01 to 200.0,
        /// Largest voltage on the ballast motor.
        ballast_voltage_max_v: 0.0 to 60.0 by BridgeVoltage,
    }
}

parameter_group! {
    /// Time constants of the estimator.
    EstimatorParameters {
        /// Time constant with which the accelerometer corrects the integrated gyro.
        tilt_time_constant_s: 0.05 to 60.0 or 2.0,
        /// Time constant with which the gyro bias is learnt.
        bias_time_constant_s: 20.0 to 10000.0 or 60.0,
        /// Time constant of the wheel-rate filter.
        wheel_rate_time_constant_s: 0.002 to 0.01 or 0.004,
        /// Time constant of the slope estimate.
        slope_time_constant_s: 0.05 to 60.0 or 1.0,
    }
}

parameter_group! {
    /// Limits whose crossing is a fault, and the largest ages of commands and samples.
    SafetyParameters {
        /// Dead-man time: when the newest drive command is older, the vehicle stops and disarms.
        command_timeout_s: 0.02 to 5.0 or 0.25,
        /// Longest time that a controlled stop may take before the bridges open.
        stop_timeout_s: 0.1 to 30.0 or 4.0,
        /// Arm angle beyond which the vehicle is about to whirl (a fault).
        phi_max_rad: 0.2 to 3.1 or 1.4,
        /// Spar angle beyond which the ballast motor is switched off.
        spar_max_rad: 0.1 to 3.1 bare 1.3,
        /// Measured motor current beyond which there is a fault.
        overcurrent_a: 0.1 to 1000.0,
        /// Largest age of a sensor sample that is used.
        sensor_timeout_s: 0.002 to 0.1 or 0.005,
    }
}
