//! Names that have changed: a reader of what an older version wrote finds the new name here.

/// Tables (`table`) and fields (`table.field`) that have changed their names since version 0.1: the old name and
/// the new one.
pub const RENAMED: &[(&str, &str)] = &[
    ("camera", "spar"),
    ("camera_motor", "ballast_motor"),
    ("imu.chassis_radius_m", "imu.arm_radius_m"),
    ("control.camera_voltage_max_v", "control.ballast_voltage_max_v"),
    ("spar.motor_arm_m", "spar.motor_distance_m"),
    ("spar.ballast_arm_m", "spar.ballast_distance_m"),
];
