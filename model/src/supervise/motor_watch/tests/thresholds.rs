//! Every threshold of a motor's watch from both sides, and every delay to the tick.

use super::*;

/// The tick in which `seen` first holds, of at most 1000.
fn first(
    watch: &mut MotorWatch,
    witness: Witness,
    mut reading: impl FnMut(u32) -> MotorReading,
    seen: fn(&MotorHealth) -> bool,
) -> Option<u32> {
    (1..=1000).find(|tick| seen(&health(watch, &reading(*tick), Some(witness))))
}

/// The other wheel and the gyro show another rate.
const DENIES: Witness = Witness {
    apart_rad_s: f32::INFINITY,
    other_v: 0.0,
};
/// They show the same rate.
const BEARS_OUT: Witness = Witness {
    apart_rad_s: 0.0,
    other_v: 0.0,
};

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
                assert!(!watch.signs(&reading).jumped, "the first count is no jump");
                reading.count = start.wrapping_add(moved);
                assert_eq!(watch.signs(&reading).jumped, jumps, "{moved} from {start}");
                assert!(!watch.signs(&reading).jumped, "a jump lasts a tick");
            }
        }
    }
}

/// A supply below its minimum leaves the voltage between two shares of the one that was asked for.
#[test]
fn of_uncertain_voltages_the_one_that_current_and_encoder_explain_counts() {
    let watch = watch();
    for way in [1.0, -1.0] {
        for (explained_v, expected_v) in [(2.0, 5.0), (6.5, 6.5), (9.0, 8.0)] {
            for emf_v in [0.0, 1.5] {
                let current_a = way * (explained_v - emf_v) / RESISTANCE_OHM;
                for shares in [[0.5, 0.8], [0.8, 0.5]] {
                    let likely_v = watch.likely_v(way * 10.0, Some(shares), current_a, way * emf_v / EMF_V_S);
                    assert!(
                        (likely_v - way * expected_v).abs() < 1e-3,
                        "{explained_v} {emf_v} {shares:?}: {likely_v}"
                    );
                }
                assert_eq!(watch.likely_v(way * 10.0, None, current_a, 0.0), way * 10.0);
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
            assert!(!watch.signs(&open(5.0)).current_offset);
        }
        watch.update(&steady(0.0, 0.0, 0.0));
    }
    assert_eq!(first(&mut watch, BEARS_OUT, |_| open(5.0), offset), Some(51));
    for _ in 0..100 {
        assert!(watch.signs(&steady(0.0, 0.0, 0.0)).current_offset);
    }
    for _ in 0..60 {
        watch.update(&open(5.0));
    }
    // 5 A fall below 0.5 A in 2.3 time constants.
    let gone = (1..=200).find(|_| !watch.signs(&open(0.0)).current_offset);
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
        let found = first(&mut watch(), DENIES, |_| reading, |health| health.encoder);
        assert_eq!(
            found,
            contradicts.then_some(250),
            "{voltage_v} V, {drop_v} V, {emf_v} V"
        );
    }
    // Contradictions add up, and agreement takes them away as fast: three of four ticks gain two.
    let found = first(
        &mut watch(),
        DENIES,
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
        let found = first(&mut watch(), BEARS_OUT, |_| reading, |health| health.open);
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
                .signs(&MotorReading {
                    applied_v: None,
                    applied_shares: None,
                    ..reading
                })
                .starved
        );
        assert!(!watch.signs(&reading).starved);
    }
}

/// The watch reports a dead sensor after 150 ticks, and after 400 while the other motor works otherwise; an open bridge
/// starts the count anew.
#[test]
fn a_sensor_is_dead_after_150_ticks() {
    let reading = |tick: u32| steady(if tick & 2 == 0 { 1.1 } else { 0.9 }, 0.0, 0.0);
    let alike = Witness {
        other_v: 1.0,
        ..BEARS_OUT
    };
    // Three ticks until there is a second difference.
    let dead = |health: &MotorHealth| health.current_sensor;
    let found = first(&mut watch(), alike, reading, dead);
    assert!(found.is_some_and(|ticks| (152..=153).contains(&ticks)), "{found:?}");
    let mut watch = watch();
    for tick in 0..150 {
        assert!(!watch.signs(&reading(tick)).unanswered);
    }
    watch.update(&MotorReading {
        applied_v: None,
        applied_shares: None,
        ..reading(0)
    });
    let again = first(&mut watch, alike, reading, dead);
    assert_eq!(again, found, "as after the first");
    let against = first(&mut self::watch(), BEARS_OUT, reading, dead);
    assert!(against.is_some_and(|ticks| (402..=403).contains(&ticks)), "{against:?}");
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
