//! Every threshold of a motor's watch from both sides, and every delay to the tick.

use super::*;

const RESISTANCE_OHM: f32 = 0.316;
/// Back-EMF per rad/s at the output.
const EMF_V_S: f32 = 43.0 * 0.030124;

fn watch() -> MotorWatch {
    MotorWatch::new(&reference().parameters().drive_motor, 1000)
}

/// Under a steady voltage, which does not show how the current follows.
fn steady(applied_v: f32, current_a: f32, rate_rad_s: f32) -> MotorReading {
    MotorReading {
        count: 0,
        applied_v: Some(applied_v),
        applied_shares: None,
        current_a,
        rate_rad_s,
    }
}

/// The tick in which `seen` first holds, of at most 1000.
fn first(
    watch: &mut MotorWatch,
    mut reading: impl FnMut(u32) -> MotorReading,
    seen: fn(&MotorHealth) -> bool,
) -> Option<u32> {
    (1..=1000).find(|tick| seen(&watch.update(&reading(*tick))))
}

#[test]
fn an_encoder_jumps_beyond_its_largest_advance_whatever_the_bridge_does() {
    for applied_v in [None, Some(0.0)] {
        for (moved, jumps) in [(1000_i32, false), (1001, true), (-1000, false), (-1001, true)] {
            for start in [0, i32::MAX - 500, i32::MIN + 500] {
                let mut watch = watch();
                let mut reading = MotorReading {
                    count: start,
                    applied_v,
                    applied_shares: None,
                    current_a: 0.0,
                    rate_rad_s: 0.0,
                };
                assert!(!watch.update(&reading).encoder, "the first count is no jump");
                reading.count = start.wrapping_add(moved);
                assert_eq!(watch.update(&reading).encoder, jumps, "{moved} from {start}");
                assert!(!watch.update(&reading).encoder, "a jump lasts a tick");
            }
        }
    }
}

/// At an open bridge the current counts from the 51st tick, filtered over 20 ms, and what was found stays while driving.
#[test]
fn an_offset_is_found_once_the_bridge_has_been_open_for_a_while() {
    let open = |current_a| MotorReading {
        applied_v: None,
        applied_shares: None,
        ..steady(0.0, current_a, 0.0)
    };
    let mut watch = watch();
    let offset = |health: &MotorHealth| health.current_offset;
    for _ in 0..3 {
        // A bridge that closes again starts the wait anew.
        for _ in 0..40 {
            assert!(!watch.update(&open(5.0)).current_offset);
        }
        watch.update(&steady(0.0, 0.0, 0.0));
    }
    assert_eq!(first(&mut watch, |_| open(5.0), offset), Some(51));
    for _ in 0..100 {
        assert!(watch.update(&steady(0.0, 0.0, 0.0)).current_offset);
    }
    for _ in 0..60 {
        watch.update(&open(5.0));
    }
    // 5 A fall below 0.5 A in 2.3 time constants.
    let gone = (1..=200).find(|_| !watch.update(&open(0.0)).current_offset);
    assert!(gone.is_some_and(|ticks| (46..=47).contains(&ticks)), "{gone:?}");
}

/// What voltage, current and encoder say differs by more than 0.35 V, half the resistance drop and a quarter of the
/// back-EMF (the larger of the two): for 250 ticks.
#[test]
fn an_encoder_contradicts_beyond_what_is_allowed() {
    let amperes = |drop_v: f32| drop_v / RESISTANCE_OHM;
    let rate = |emf_v: f32| emf_v / EMF_V_S;
    for (voltage_v, drop_v, emf_v, contradicts) in [
        // At rest 0.467 V less a quarter of it are 0.35 V.
        (0.46, 0.0, 0.0, false),
        (0.475, 0.0, 0.0, true),
        (-0.46, 0.0, 0.0, false),
        (-0.475, 0.0, 0.0, true),
        (0.0, 0.0, 0.46, false),
        (0.0, 0.0, 0.475, true),
        (0.0, 0.0, -0.475, true),
        // 3 V less a drop of 1.52 V: 1.48 V against 0.35 V, 0.76 V and 0.37 V.
        (3.0, 1.50, 0.0, true),
        (3.0, 1.54, 0.0, false),
        (-3.0, -1.50, 0.0, true),
        (-3.0, -1.54, 0.0, false),
        // An encoder that shows 5 V of back-EMF: 1.6 V may differ.
        (3.35, 0.0, 5.0, true),
        (3.45, 0.0, 5.0, false),
        (6.7, 0.0, 5.0, false),
        (7.2, 0.0, 5.0, true),
        // Current and back-EMF explain the voltage.
        (8.0, 3.0, 5.0, false),
        (-8.0, -3.0, -5.0, false),
        (8.0, 3.0, -5.0, true),
    ] {
        let reading = steady(voltage_v, amperes(drop_v), rate(emf_v));
        let found = first(&mut watch(), |_| reading, |health| health.encoder);
        assert_eq!(
            found,
            contradicts.then_some(250),
            "{voltage_v} V, {drop_v} V, {emf_v} V"
        );
    }
    // Contradictions add up, and agreement takes them away as fast: three of four ticks gain two.
    let found = first(
        &mut watch(),
        |tick| steady(1.0, 0.0, if tick % 4 == 0 { rate(1.0) } else { 0.0 }),
        |health| health.encoder,
    );
    assert!(found.is_some_and(|ticks| (490..=500).contains(&ticks)), "{found:?}");
}

/// 40 % of 17 A are 2.15 V; less than a tenth of what should flow is nothing; for 100 ticks.
#[test]
fn a_lead_is_open_when_much_should_flow_and_nothing_does() {
    for (voltage_v, current_a, rate_rad_s, open) in [
        (2.13, 0.0, 0.0, false),
        (2.17, 0.0, 0.0, true),
        (-2.13, 0.0, 0.0, false),
        (-2.17, 0.0, 0.0, true),
        // 3.16 V drive 10 A.
        (3.16, 0.98, 0.0, true),
        (3.16, -0.98, 0.0, true),
        (3.16, 1.02, 0.0, false),
        (3.16, -1.02, 0.0, false),
        // The back-EMF takes its share of the voltage.
        (2.17 + EMF_V_S, 0.0, 1.0, true),
        (2.13 + EMF_V_S, 0.0, 1.0, false),
        (2.13 - EMF_V_S, 0.0, -1.0, false),
        (2.17 - EMF_V_S, 0.0, -1.0, true),
    ] {
        let reading = steady(voltage_v, current_a, rate_rad_s);
        let found = first(&mut watch(), |_| reading, |health| health.open);
        assert_eq!(
            found,
            open.then_some(100),
            "{voltage_v} V, {current_a} A, {rate_rad_s} rad/s"
        );
        // A bridge that opens says nothing of its leads.
        let mut watch = watch();
        for _ in 0..99 {
            watch.update(&reading);
        }
        assert!(
            !watch
                .update(&MotorReading {
                    applied_v: None,
                    applied_shares: None,
                    ..reading
                })
                .open
        );
        assert!(!watch.update(&reading).open);
    }
}

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
    // Second differences of 0.02 A: the voltage that shows something is 0.02 / sqrt(2) A through 0.316 ohm, and more,
    // as the inductance takes some of the change.
    assert_eq!(following(0.0043, 1.0, 2000), CurrentResponse::Unknown);
    assert_eq!(following(0.0049, 1.0, 2000), CurrentResponse::Follows);
    assert_eq!(following(0.0049, 0.0, 2000), CurrentResponse::Dead);
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

/// The watch reports a dead sensor after 150 ticks, and a living sensor never; an open bridge starts the count anew.
#[test]
fn a_sensor_is_dead_after_150_ticks() {
    let reading = |tick: u32| steady(if tick & 2 == 0 { 0.1 } else { -0.1 }, 0.0, 0.0);
    // Three ticks until there is a second difference.
    let dead = |health: &MotorHealth| health.current_sensor;
    let found = first(&mut watch(), reading, dead);
    assert!(found.is_some_and(|ticks| (152..=153).contains(&ticks)), "{found:?}");
    let mut watch = watch();
    for tick in 0..150 {
        assert!(!watch.update(&reading(tick)).current_sensor);
    }
    watch.update(&MotorReading {
        applied_v: None,
        applied_shares: None,
        ..reading(0)
    });
    let again = first(&mut watch, reading, dead);
    assert_eq!(again, found, "as after the first");
}

/// An encoder stuck at a crawl, too slow to contradict: 0.1 rad that the motor has surely turned. Of the back-EMF, 0.1 V
/// and half of the drop are not sure.
#[test]
fn a_stuck_encoder_is_found_by_the_way_that_the_motor_has_surely_gone() {
    for (rate_rad_s, load_a) in [(0.40_f32, 0.5_f32), (-0.40, -0.5), (0.38, 0.3), (-0.36, -0.1)] {
        let surely_v = EMF_V_S * rate_rad_s.abs() - 0.1 - 0.5 * RESISTANCE_OHM * load_a.abs();
        let expected = 0.1 / (surely_v / EMF_V_S * TICK_S);
        let mut bench = Bench::new(1.0, 1.0);
        let found = bench.found(2000, |bench| bench.tick(Wrong::EncoderStuck, rate_rad_s, load_a, 0.1));
        let (ticks, health) = found.expect("found");
        assert!(
            (ticks as f32 / expected - 1.0).abs() < 0.05 && health.encoder,
            "{rate_rad_s} {load_a}: {ticks} ticks, {expected} expected"
        );
    }
    // 0.1 V of back-EMF are not sure at all.
    let mut bench = Bench::new(1.0, 1.0);
    assert_eq!(
        bench.found(5000, |bench| bench.tick(Wrong::EncoderStuck, 0.07, 0.0, 0.1)),
        None
    );
}

/// Five counts away the encoder has moved on, four it has not: one of its two lines may be dead.
#[test]
fn an_encoder_moves_on_by_more_than_four_counts() {
    for place in [0, 70_000, -70_000, i32::MAX] {
        for (counts, silent) in [(4, true), (-4, true), (5, false), (-5, false)] {
            let mut silence = Silence::default();
            let found = (1..=1000).any(|tick| {
                let count = place.wrapping_add(tick % 2 * counts);
                silence.update(count, 0.001, CurrentResponse::Follows)
            });
            assert_eq!(found, silent, "{counts} at {place}");
        }
    }
}
