use super::blame::Witness;
use super::follower::POWER_MIN_A2;
use super::*;
use crate::vehicle::test_vehicle::reference;

mod blame;
mod following;
mod thresholds;

/// The reference vehicle's drive motor: its resistance, and its back-EMF per rad/s at the output.
const RESISTANCE_OHM: f32 = 0.316;
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

/// Two signs, or more, are as bad as one.
#[test]
fn only_no_sign_at_all_is_sound() {
    for bits in 0..32_u8 {
        let signs = MotorSigns {
            jumped: bits & 1 != 0,
            contradict: bits & 2 != 0,
            unanswered: bits & 4 != 0,
            starved: bits & 8 != 0,
            current_offset: bits & 16 != 0,
        };
        assert_eq!(signs.is_sound(), bits == 0, "{signs:?}");
    }
}

/// What is wrong with the simulated motor.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Wrong {
    Nothing,
    EncoderStuck,
    EncoderReversed,
    SensorDead,
    SensorStuck,
    LeadOpen,
}

/// A motor at a steady rate under a voltage that the laws' noise moves, with its watch.
struct Bench {
    watch: MotorWatch,
    motor: MotorParameters<f32>,
    /// Factors on the resistance and on the back-EMF constant that the watch believes.
    resistance_factor: f32,
    back_emf_factor: f32,
    current_a: f32,
    noise: u32,
    turned_rad: f32,
}

/// One tick of a watch, and the findings.
fn health(watch: &mut MotorWatch, reading: &MotorReading, witness: Option<Witness>) -> MotorHealth {
    let wrong = watch.update(reading);
    watch.health(wrong, reading, witness)
}

impl Bench {
    fn new(resistance_factor: f32, back_emf_factor: f32) -> Self {
        let motor = reference().parameters().drive_motor;
        Self {
            watch: MotorWatch::new(&motor, 1000),
            motor,
            resistance_factor,
            back_emf_factor,
            current_a: 0.0,
            noise: 1,
            turned_rad: 0.0,
        }
    }

    /// Uniform noise in -1 to 1.
    fn noise(&mut self) -> f32 {
        self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.noise >> 8) as f32 / 8_388_608.0 - 1.0
    }

    /// One tick at `rate_rad_s` with a mean current of `load_a`, the voltage moved by `ripple_v`.
    fn tick(&mut self, wrong: Wrong, rate_rad_s: f32, load_a: f32, ripple_v: f32) -> MotorHealth {
        let resistance = self.resistance_factor * self.motor.resistance_ohm;
        let back_emf_v =
            self.back_emf_factor * self.motor.back_emf_constant_v_s_per_rad * self.motor.gear_ratio * rate_rad_s;
        let voltage_v = back_emf_v + resistance * load_a + ripple_v * self.noise();
        let steady_a = (voltage_v - back_emf_v) / resistance;
        let rest_half = (-0.0005 * resistance / self.motor.inductance_h).exp();
        let half_a = steady_a + rest_half * (self.current_a - steady_a);
        self.current_a = steady_a + rest_half * rest_half * (self.current_a - steady_a);
        let converter_a = 0.004 * self.noise();
        let measured_a = match wrong {
            Wrong::SensorDead | Wrong::LeadOpen => 0.0,
            Wrong::SensorStuck => load_a,
            _ => half_a,
        } + converter_a;
        let encoder_rad_s = match wrong {
            Wrong::EncoderStuck => 0.0,
            Wrong::EncoderReversed => -rate_rad_s,
            _ => rate_rad_s,
        };
        self.turned_rad += TICK_S * encoder_rad_s;
        let rad_per_count = 2.0 * core::f32::consts::PI / (self.motor.encoder_counts_per_rev * self.motor.gear_ratio);
        let reading = MotorReading {
            count: (self.turned_rad / rad_per_count) as i32,
            applied_v: Some(voltage_v),
            applied_shares: None,
            current_a: measured_a,
            rate_rad_s: encoder_rad_s + 0.02 * self.noise(),
        };
        // The other motor does its share of the work, but it does not work against one without torque.
        let witness = Witness {
            apart_rad_s: reading.rate_rad_s - rate_rad_s,
            other_v: if wrong == Wrong::LeadOpen {
                0.0
            } else {
                resistance * load_a
            },
        };
        health(&mut self.watch, &reading, Some(witness))
    }

    /// What is found within `ticks`, and when.
    fn found(&mut self, ticks: u32, mut tick: impl FnMut(&mut Self) -> MotorHealth) -> Option<(u32, MotorHealth)> {
        (1..=ticks).find_map(|k| Some((k, tick(self))).filter(|(_, health)| *health != MotorHealth::default()))
    }
}

#[test]
fn a_sound_motor_is_believed_warm_or_cold_strong_or_weak() {
    for (resistance, back_emf) in [(1.0, 1.0), (1.35, 1.0), (0.8, 1.2), (1.2, 0.85)] {
        for (rate, load) in [(0.0, 0.0), (1.2, 0.7), (-4.0, -2.0), (10.0, 3.0), (4.0, 17.0)] {
            for ripple in [0.0, 0.01, 0.1, 1.0] {
                let mut bench = Bench::new(resistance, back_emf);
                let found = bench.found(2000, |bench| bench.tick(Wrong::Nothing, rate, load, ripple));
                assert_eq!(found, None, "{resistance} {back_emf} {rate} {load} {ripple}");
            }
        }
    }
}

#[test]
fn a_dead_or_stuck_sensor_is_found_within_0_35_seconds_and_nothing_else() {
    for wrong in [Wrong::SensorDead, Wrong::SensorStuck] {
        for (rate, load) in [(0.0, 0.5), (1.2, 0.7), (-4.0, -1.8), (10.0, 3.4), (2.0, 6.0)] {
            // As small as when standing still, and as large as when pushing.
            for ripple in [0.03, 0.3] {
                let mut bench = Bench::new(1.0, 1.0);
                for _ in 0..500 {
                    bench.tick(Wrong::Nothing, rate, load, ripple);
                }
                let found = bench.found(1000, |bench| bench.tick(wrong, rate, load, ripple));
                let (ticks, health) = found.expect("found");
                assert!(ticks < 350, "{wrong:?} {rate} {load} {ripple}: {ticks}");
                let expected = MotorHealth {
                    current_sensor: true,
                    ..MotorHealth::default()
                };
                assert_eq!(health, expected, "{wrong:?} {rate} {load} {ripple}");
            }
        }
    }
}

#[test]
fn a_stuck_or_reversed_encoder_is_found_from_a_crawl_on_and_is_no_sensors_fault() {
    for (speed_m_s, load) in [(0.15, 0.5), (0.3, 0.65), (1.0, 1.8), (-1.0, -1.8), (2.5, 4.0)] {
        for wrong in [Wrong::EncoderStuck, Wrong::EncoderReversed] {
            let mut bench = Bench::new(1.0, 1.0);
            let found = bench.found(1000, |bench| bench.tick(wrong, speed_m_s / 0.25, load, 0.1));
            let (ticks, health) = found.expect("found");
            assert!(ticks < 400, "{speed_m_s} {wrong:?}: {ticks}");
            assert!(health.encoder && !health.current_sensor && !health.open, "{health:?}");
        }
    }
}

/// The speed loop that a dead encoder closes swings to and fro: the contradictions never last, but they add up.
#[test]
fn an_encoder_that_dies_in_a_swinging_loop_is_found_within_half_a_second() {
    for wrong in [Wrong::EncoderStuck, Wrong::EncoderReversed] {
        let mut bench = Bench::new(1.0, 1.0);
        let mut k = 0;
        let found = bench.found(1000, |bench| {
            k += 1;
            let swing = libm::sinf(k as f32 * 0.0138);
            bench.tick(wrong, 0.4 + 1.6 * swing, 4.0 * swing, 0.1)
        });
        let (ticks, health) = found.expect("found");
        assert!(ticks < 500, "{wrong:?}: {ticks}");
        assert!(health.encoder && !health.current_sensor && !health.open, "{health:?}");
    }
}

#[test]
fn an_open_lead_is_named_once_the_voltage_should_drive_much() {
    for (rate, wanted_a) in [(0.0, 8.0), (4.0, -12.0), (-4.0, 16.0)] {
        for ripple in [0.0, 0.1] {
            let mut bench = Bench::new(1.0, 1.0);
            let found = bench.found(400, |bench| bench.tick(Wrong::LeadOpen, rate, wanted_a, ripple));
            let (ticks, health) = found.expect("found");
            let expected = MotorHealth {
                open: true,
                ..MotorHealth::default()
            };
            assert!(
                ticks <= 110 && health == expected,
                "{rate} {wanted_a} {ripple}: {ticks}, {health:?}"
            );
        }
    }
}

#[test]
fn a_current_at_an_open_bridge_is_an_offset_beyond_half_an_ampere() {
    for (offset_a, expected) in [(0.4, false), (0.6, true), (-0.6, true), (5.0, true), (-0.4, false)] {
        let mut bench = Bench::new(1.0, 1.0);
        let mut found = MotorHealth::default();
        for _ in 0..200 {
            let current_a = offset_a + 0.004 * bench.noise();
            let reading = MotorReading {
                count: 0,
                applied_v: None,
                applied_shares: None,
                current_a,
                rate_rad_s: 0.0,
            };
            found = health(&mut bench.watch, &reading, None);
        }
        assert_eq!(found.current_offset, expected, "{offset_a}");
        // While the bridge drives, the finding stays.
        assert_eq!(bench.tick(Wrong::Nothing, 0.0, 0.0, 0.0).current_offset, expected);
    }
}

/// A current that answers as the armature does makes the sums of what was modelled and of what was measured alike.
#[test]
fn the_measured_changes_are_those_that_the_voltage_makes() {
    let mut bench = Bench::new(1.0, 1.0);
    for _ in 0..600 {
        bench.tick(Wrong::Nothing, 2.0, 1.0, 0.05);
    }
    let Follower {
        power,
        common,
        measured_power,
        ..
    } = bench.watch.follower;
    assert!(power > 10.0 * POWER_MIN_A2, "{power} A^2");
    assert!((common / power - 1.0).abs() < 0.1, "{common} of {power} A^2");
    // Measured in its middle, a tick's current changes more than its mean does.
    assert!(measured_power > power, "{measured_power} of {power} A^2");
}

/// The ticks until an encoder is dead, of at most 1000: one of its two lines is dead, so the count goes to and fro.
fn dead_after(turned_rad: impl Fn(u32) -> f32) -> Option<u32> {
    let mut silence = Silence::default();
    (1..=1000_u32).find(|tick| silence.update((tick % 2).cast_signed()) && silence.turn(turned_rad(*tick)))
}

/// A thousand edges are missing once the motor has surely turned by 0.1 rad, in 250 ticks at least.
#[test]
fn an_encoder_is_silent_once_the_motor_has_surely_turned() {
    for (turned_rad, after_ticks) in [(0.001, 250), (0.0005, 250), (0.0002, 502), (-0.0002, 502)] {
        let found = dead_after(|_| turned_rad);
        assert!(
            found.is_some_and(|found| found.abs_diff(after_ticks) <= 2),
            "{turned_rad}: {found:?}"
        );
    }
    // A loop that is closed through a dead encoder swings: 0.1 rad each way.
    let swings = |tick: u32| 0.001 * libm::sinf(tick as f32 * 0.02);
    assert_eq!(dead_after(swings), Some(250));
    // Noise and vibration turn nothing: 5 ms and 50 ms each way, at 4 rad/s and 0.4 rad/s.
    assert_eq!(dead_after(|tick| if tick / 5 % 2 == 0 { 0.004 } else { -0.004 }), None);
    assert_eq!(
        dead_after(|tick| if tick / 50 % 2 == 0 { 0.0004 } else { -0.0004 }),
        None
    );
    // The rest of a voltage whose halves are not sampled alike: a step takes 200 ticks at most.
    assert!(dead_after(|_| 0.000_126).is_some_and(|ticks| (795..=800).contains(&ticks)));
    assert_eq!(dead_after(|_| 0.000_124), None);
    // An encoder that moves on is not silent.
    let mut silence = Silence::default();
    assert!(!(1..=1000).any(|tick| silence.update(tick * 5) && silence.turn(0.001)));
}

/// Five counts away the encoder has moved on, four it has not: one of its two lines may be dead.
#[test]
fn an_encoder_moves_on_by_more_than_four_counts() {
    for place in [0, 70_000, -70_000, i32::MAX] {
        for (counts, silent) in [(4, true), (-4, true), (5, false), (-5, false)] {
            let mut silence = Silence::default();
            let found = (1..=1000).any(|tick| {
                let count = place.wrapping_add(tick % 2 * counts);
                silence.update(count) && silence.turn(0.001)
            });
            assert_eq!(found, silent, "{counts} at {place}");
        }
    }
}

/// Voltage and current show the rate only while the current responds.
#[test]
fn a_current_that_does_not_respond_turns_nothing() {
    for ripple_v in [0.0, 0.1] {
        let mut watch = MotorWatch::new(&reference().parameters().drive_motor, 1000);
        for tick in 0..1000 {
            // 0.4 V are within what may be unexplained; 0.3 V of them have surely turned the motor.
            let reading = MotorReading {
                count: 0,
                applied_v: Some(0.4 + if tick & 2 == 0 { ripple_v } else { -ripple_v }),
                applied_shares: None,
                current_a: 0.0,
                rate_rad_s: 0.0,
            };
            assert!(!watch.signs(&reading).contradict, "{ripple_v}");
        }
    }
}
