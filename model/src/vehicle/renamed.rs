//! Names that have changed. A reader of older files finds the new name of a table or field here.

/// Tables (`table`) and fields (`table.field`) whose names have changed since version 0.1: the old name and the
/// new name.
pub const RENAMED: &[(&str, &str)] = &[
    ("camera", "spar"),
    ("camera_motor", "ballast_motor"),
    ("imu.chassis_radius_m", "imu.arm_radius_m"),
    ("control.camera_voltage_max_v", "control.ballast_voltage_max_v"),
    ("spar.motor_arm_m", "spar.motor_distance_m"),
    ("spar.ballast_arm_m", "spar.ballast_distance_m"),
];
