//! When a measured current follows the voltage, from both sides.

use super::super::follower::{CurrentResponse, DIFFERENCE_TICKS, Follower, SecondDifference};
use crate::vehicle::test_vehicle::reference;

/// A voltage that is up for two ticks and down for two, and a current that is `share` of what the armature makes of it.
fn following(amplitude_v: f32, share: f32, ticks: u32) -> CurrentResponse {
    let mut follower = Follower::new(&reference().parameters().drive_motor);
    (0..ticks).fold(CurrentResponse::Unknown, |_, tick| {
        let voltage_v = if tick & 2 == 0 { amplitude_v } else { -amplitude_v };
        let mut ahead = follower;
        ahead.update(voltage_v, 0.0);
        let model_a = ahead.model.last;
        // A load and an offset show nothing.
        follower.update(voltage_v, 3.0 + share * model_a)
    })
}

/// Half of the change is following; less than a quarter, without changes of its own, is dead; between the two it is open.
#[test]
fn a_current_follows_by_half_and_is_dead_below_a_quarter() {
    for (share, answer) in [
        (1.0, CurrentResponse::Follows),
        (0.52, CurrentResponse::Follows),
        (0.48, CurrentResponse::Unknown),
        (0.27, CurrentResponse::Unknown),
        (0.23, CurrentResponse::Dead),
        (0.0, CurrentResponse::Dead),
        (-0.69, CurrentResponse::Dead),
        (-0.72, CurrentResponse::Unknown),
        (-1.0, CurrentResponse::Unknown),
    ] {
        assert_eq!(following(0.02, share, 2000), answer, "{share}");
    }
    // Second differences of 0.015 A: the voltage that shows something is 0.015 / sqrt(2) A through 0.316 ohm, and more,
    // as the inductance takes some of the change.
    assert_eq!(following(0.0032, 1.0, 2000), CurrentResponse::Unknown);
    assert_eq!(following(0.0037, 1.0, 2000), CurrentResponse::Follows);
    assert_eq!(following(0.0037, 0.0, 2000), CurrentResponse::Dead);
    // The first second difference needs three values.
    assert_eq!(following(0.5, 1.0, 2), CurrentResponse::Unknown);
    assert_eq!(following(0.5, 1.0, 3), CurrentResponse::Follows);
}

/// A follower that begins anew returns nothing before three values, whatever it knew, and then what a new follower
/// returns.
#[test]
fn a_follower_that_is_reset_knows_nothing() {
    let new = Follower::new(&reference().parameters().drive_motor);
    let mut used = new;
    for tick in 0_u8..20 {
        used.update(f32::from(tick & 2), 3.0 - f32::from(tick));
    }
    used.reset();
    let mut fresh = new;
    for (tick, voltage_v) in [0.5, -0.5, 0.5, 0.5, -0.5].into_iter().enumerate() {
        let answers = [&mut used, &mut fresh].map(|follower| follower.update(voltage_v, 2.0 * voltage_v));
        assert_eq!(answers[0], answers[1], "{tick}");
        assert_eq!(used.power == 0.0, tick < 2, "{tick}: {}", used.power);
        let sums = |follower: &Follower| [follower.power, follower.common, follower.measured_power];
        assert_eq!(sums(&used), sums(&fresh), "{tick}");
    }
}

/// Steady loads, offsets and ramps are no changes; the first two values show nothing, which the follower knows.
#[test]
fn a_second_difference_leaves_steady_values_and_ramps_out() {
    let mut difference = SecondDifference::default();
    let seconds = [3.0, 4.0, 5.0, 6.0, 6.0, 6.0, 10.0].map(|value| difference.update(value));
    assert_eq!(seconds[usize::from(DIFFERENCE_TICKS)..], [0.0, 0.0, -1.0, 0.0, 4.0]);
}

/// One jump, as of a sensor that dies, outweighs nothing.
#[test]
fn one_jump_of_the_current_does_not_hide_a_dead_sensor() {
    let mut follower = Follower::new(&reference().parameters().drive_motor);
    let answers: [CurrentResponse; 400] = core::array::from_fn(|tick| {
        let voltage_v = if tick & 2 == 0 { 0.1 } else { -0.1 };
        // 10 A flowed; the sensor is dead from tick 100 on.
        follower.update(voltage_v, if tick < 100 { 10.0 } else { 0.0 })
    });
    assert_eq!(answers[99], CurrentResponse::Dead, "it never followed");
    assert!(answers[150..].iter().all(|answer| *answer == CurrentResponse::Dead));
}

/// An armature with a time constant of one tick: the modelled current of a tick is the mean of an exponential rise.
#[test]
fn the_modelled_current_rises_with_the_armatures_time_constant() {
    let mut motor = reference().parameters().drive_motor;
    motor.inductance_h = motor.resistance_ohm * crate::sample::TICK_S;
    let mut follower = Follower::new(&motor);
    follower.update(0.0, 0.0);
    for tick in 1..=5_u8 {
        follower.update(1.0, 0.0);
        let rest = |ticks: u8| libm::expf(-f32::from(ticks));
        let mean_a = (1.0 - 0.5 * (rest(tick - 1) + rest(tick))) / motor.resistance_ohm;
        assert!(
            (follower.model.last - mean_a).abs() < 1e-4,
            "tick {tick}: {} A",
            follower.model.last
        );
    }
}
