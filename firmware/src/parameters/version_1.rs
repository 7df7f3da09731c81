//! Sets that firmware of version 0.1 stored: values without names, in the order of that version's parameters.

use core::ops::Range;

use crate::image::CHECKSUM;

/// The parameters of version 0.1, in order.
const NAMES: [&str; 66] = [
    "body.wheel_radius_m",
    "body.total_mass_kg",
    "body.arm_mass_kg",
    "body.arm_length_m",
    "body.wheels_inertia_kg_m2",
    "body.half_track_m",
    "body.yaw_inertia_kg_m2",
    "body.bearing_damping_n_m_s",
    "drive_motor.torque_constant_n_m_per_a",
    "drive_motor.back_emf_constant_v_s_per_rad",
    "drive_motor.resistance_ohm",
    "drive_motor.inductance_h",
    "drive_motor.rotor_inertia_kg_m2",
    "drive_motor.gear_ratio",
    "drive_motor.current_limit_a",
    "drive_motor.coulomb_friction_n_m",
    "drive_motor.encoder_counts_per_rev",
    "camera.spar_length_m",
    "camera.camera_mass_kg",
    "camera.motor_mass_kg",
    "camera.ballast_mass_kg",
    "camera.motor_arm_m",
    "camera.ballast_arm_m",
    "camera.spar_damping_n_m_s",
    "camera.spar_gain",
    "camera.ballast_gain",
    "camera.spar_rate_gain",
    "camera.ballast_rate_gain",
    "camera_motor.torque_constant_n_m_per_a",
    "camera_motor.back_emf_constant_v_s_per_rad",
    "camera_motor.resistance_ohm",
    "camera_motor.inductance_h",
    "camera_motor.rotor_inertia_kg_m2",
    "camera_motor.gear_ratio",
    "camera_motor.current_limit_a",
    "camera_motor.coulomb_friction_n_m",
    "camera_motor.encoder_counts_per_rev",
    "imu.chassis_radius_m",
    "imu.spar_radius_m",
    "battery.nominal_v",
    "battery.minimum_v",
    "battery.maximum_v",
    "battery.resistance_ohm",
    "control.kp",
    "control.kd",
    "control.ki",
    "control.swing_gain",
    "control.hold_kp_per_s",
    "control.yaw_kp_v_s_per_rad",
    "control.yaw_ki_v_per_rad",
    "control.heading_kp_per_s",
    "control.speed_max_m_s",
    "control.acceleration_max_m_s2",
    "control.yaw_rate_max_rad_s",
    "control.yaw_acceleration_max_rad_s2",
    "control.camera_voltage_max_v",
    "estimator.tilt_time_constant_s",
    "estimator.bias_time_constant_s",
    "estimator.wheel_rate_time_constant_s",
    "estimator.slope_time_constant_s",
    "safety.command_timeout_s",
    "safety.stop_timeout_s",
    "safety.phi_max_rad",
    "safety.spar_max_rad",
    "safety.overcurrent_a",
    "safety.sensor_timeout_s",
];
/// Hash of each name.
const HASHES: [u32; NAMES.len()] = {
    let mut hashes = [0; NAMES.len()];
    let mut at = 0;
    while at < NAMES.len() {
        hashes[at] = CHECKSUM.checksum(NAMES[at].as_bytes());
        at += 1;
    }
    hashes
};
/// The parameters that a vehicle without a spar did not have.
const CAMERA: Range<usize> = 17..37;
/// Hashes of the names and ranges of a vehicle with and without a spar.
const WITH_CAMERA: u32 = 0xa6fc2134;
const WITHOUT_CAMERA: u32 = 0xf9704e66;
/// Bytes in front of the values: the hash and the number of values, 4 bytes each.
const SET_HEADER_1: usize = 8;

/// Hash of the name and value of each parameter of a set of version 0.1; `None` if the bytes are not such a
/// set.
pub(super) fn values(bytes: &[u8]) -> Option<impl Iterator<Item = (u32, f32)> + use<'_>> {
    let (header, values) = bytes.split_at_checked(SET_HEADER_1)?;
    let (schema, count) = header.split_first_chunk::<4>()?;
    let left_out = match u32::from_le_bytes(*schema) {
        WITH_CAMERA => 0..0,
        WITHOUT_CAMERA => CAMERA,
        _ => return None,
    };
    let expected = NAMES.len() - left_out.len();
    if u32::from_le_bytes(count.try_into().ok()?) as usize != expected || values.len() != 4 * expected {
        return None;
    }
    let names = HASHES
        .iter()
        .enumerate()
        .filter(move |(place, _)| !left_out.contains(place));
    let values = values
        .chunks_exact(4)
        .filter_map(|value| value.try_into().ok().map(f32::from_le_bytes));
    Some(names.map(|(_, hash)| *hash).zip(values))
}
