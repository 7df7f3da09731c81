use super::*;
use crate::vehicle::test_vehicle::reference;

mod thresholds;

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
        let shown_rad_s = match wrong {
            Wrong::EncoderStuck => 0.0,
            Wrong::EncoderReversed => -rate_rad_s,
            _ => rate_rad_s,
        } + 0.02 * self.noise();
        self.turned_rad += TICK_S
            * match wrong {
                Wrong::EncoderStuck => 0.0,
                Wrong::EncoderReversed => -rate_rad_s,
                _ => rate_rad_s,
            };
        let rad_per_count = 2.0 * core::f32::consts::PI / (self.motor.encoder_counts_per_rev * self.motor.gear_ratio);
        self.watch.update(&MotorReading {
            count: (self.turned_rad / rad_per_count) as i32,
            applied_v: Some(voltage_v),
            applied_shares: None,
            current_a: measured_a,
            rate_rad_s: shown_rad_s,
        })
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
            let mut last = MotorHealth::default();
            for _ in 0..400 {
                last = bench.tick(Wrong::LeadOpen, rate, wanted_a, ripple);
            }
            assert!(
                last.open && (!last.encoder || ripple == 0.0),
                "{rate} {wanted_a} {ripple}: {last:?}"
            );
        }
    }
}

#[test]
fn a_current_at_an_open_bridge_is_an_offset_beyond_half_an_ampere() {
    for (offset_a, expected) in [(0.4, false), (0.6, true), (-0.6, true), (5.0, true), (-0.4, false)] {
        let mut bench = Bench::new(1.0, 1.0);
        let mut health = MotorHealth::default();
        for _ in 0..200 {
            let current_a = offset_a + 0.004 * bench.noise();
            health = bench.watch.update(&MotorReading {
                count: 0,
                applied_v: None,
                applied_shares: None,
                current_a,
                rate_rad_s: 0.0,
            });
        }
        assert_eq!(health.current_offset, expected, "{offset_a}");
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

/// A thousand edges are missing once the motor has surely turned by 0.1 rad, in 250 ticks at least.
#[test]
fn an_encoder_is_silent_once_the_motor_has_surely_turned() {
    for (turned_rad, answer, after_ticks) in [
        (0.001, CurrentResponse::Follows, Some(250)),
        (0.0002, CurrentResponse::Follows, Some(501)),
        (0.0, CurrentResponse::Follows, None),
        (-0.001, CurrentResponse::Follows, None),
        (0.001, CurrentResponse::Unknown, None),
        (0.001, CurrentResponse::Dead, None),
    ] {
        let mut silence = Silence::default();
        // One of the two lines is dead: the count goes to and fro.
        let found = (1..=1000).find(|tick| silence.update(tick % 2, turned_rad, answer));
        let near = |ticks: i32| found.is_some_and(|found| (found - ticks).abs() <= 2);
        assert!(
            after_ticks.map_or(found.is_none(), near),
            "{turned_rad} {answer:?}: {found:?}"
        );
    }
    // An encoder that moves on is not silent.
    let mut silence = Silence::default();
    assert!(!(1..=1000).any(|tick| silence.update(tick, 0.001, CurrentResponse::Follows)));
}
