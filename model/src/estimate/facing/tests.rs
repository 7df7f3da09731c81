//! Wheels and IMUs that agree, disagree, slide and land, before the watch.

use super::*;

const RADIUS_M: f32 = 0.25;
const AXLE_S: f32 = 0.02;
const MIRRORED_TICKS: u16 = MIRRORED_INTERVALS * INTERVAL_TICKS as u16;
/// Angular frequency, 2 Hz, at which the tests turn the wheels to and fro against the arm.
const OMEGA_RAD_S: f32 = 12.6;

/// A watch, and simulated wheels with an IMU.
struct Bench {
    facing: Facing,
    ticks: u16,
    axle: LowPass,
    weighs: bool,
    slides: bool,
    /// The IMU's sideways acceleration as a share of the wheels' relative acceleration.
    sideways: f32,
}

impl Bench {
    fn new() -> Self {
        let mut facing = Facing::new(RADIUS_M, AXLE_S);
        // As on a side slope.
        facing.reset(3.0);
        Self {
            facing,
            ticks: 0,
            axle: LowPass::new(INTERVAL_S, AXLE_S),
            weighs: true,
            slides: false,
            sideways: 0.0,
        }
    }

    /// One interval at a relative rate. The error is this share of the wheels' relative acceleration, plus
    /// `offset_g`.
    fn interval(&mut self, relative_rad_s: f32, share: f32, offset_g: f32) -> bool {
        let relative_g = RADIUS_M / G * self.axle.update(relative_rad_s);
        self.facing.update(&Shown {
            relative_rad_s,
            unexplained: share * relative_g + offset_g,
            sideways_m_s2: 3.0 + self.sideways * relative_g * G,
            weighs: self.weighs,
            slides: self.slides,
        })
    }

    /// The tick in which the watch first reports a mirrored IMU while the wheels swing by `amplitude_m_s2`.
    fn told(&mut self, amplitude_m_s2: f32, share: f32, ticks: u16) -> Option<u16> {
        let step = u16::from(INTERVAL_TICKS);
        (step..=ticks).step_by(usize::from(step)).find(|_| {
            self.ticks += step;
            let angle = OMEGA_RAD_S * TICK_S * f32::from(self.ticks);
            let relative_rad_s = amplitude_m_s2 / (RADIUS_M * OMEGA_RAD_S) * libm::sinf(angle);
            self.interval(relative_rad_s, share, 0.0)
        })
    }
}

#[test]
fn a_mirrored_imu_is_told_within_a_quarter_of_a_second_of_motion_and_an_upright_one_never() {
    for amplitude_m_s2 in [2.0_f32, 6.0, -4.0] {
        let told = Bench::new().told(amplitude_m_s2, -2.0, 1000);
        assert!(
            told.is_some_and(|tick| (MIRRORED_TICKS..=250).contains(&tick)),
            "{amplitude_m_s2}: {told:?}"
        );
        // An exact IMU, wheels that spin on ice or slip a little, an accelerometer of a wrong scale, and an error of
        // the wrong sign.
        for share in [0.0, -1.0, -1.3, 0.3, 2.0] {
            assert_eq!(
                Bench::new().told(amplitude_m_s2, share, 3000),
                None,
                "{amplitude_m_s2}, {share}"
            );
        }
    }
    // Scales and radii that are wrong by a fifth do not hide a mirrored IMU.
    for share in [-1.6, -2.4] {
        assert!(Bench::new().told(3.0, share, 1000).is_some(), "{share}");
    }
}

/// An amplitude of 2 m/s^2 has the mean square of 1.4 m/s^2 and is twice the wheels' relative acceleration.
#[test]
fn little_motion_tells_nothing() {
    assert_eq!(Bench::new().told(0.8, -2.0, 3000), None);
    assert!(Bench::new().told(1.25, -2.0, 3000).is_some());
}

/// The watch does not report a blow that looks mirrored for 40 ticks, because the report needs 60 ticks.
#[test]
fn what_does_not_last_tells_nothing() {
    let mut bench = Bench::new();
    assert_eq!(bench.told(5.0, -2.0, MIRRORED_TICKS - 1), None);
    assert!(
        bench.facing.backward < MIRRORED_SHARE * bench.facing.forward,
        "it looks mirrored"
    );
    // Too small to show that the IMU faces forward.
    assert_eq!(bench.told(0.8, 0.0, 1000), None);
    // Two blows do not add up.
    assert_eq!(bench.told(5.0, -2.0, MIRRORED_TICKS - 1), None);
    assert_eq!(bench.told(0.8, 0.0, 1000), None);
    assert!(bench.told(5.0, -2.0, 600).is_some());
}

/// A blow that looks mirrored throws the vehicle off the ground: what the watch saw last does not count on in the air.
#[test]
fn nothing_is_told_in_the_air_of_what_was_before() {
    let mut bench = Bench::new();
    assert_eq!(bench.told(5.0, -2.0, MIRRORED_TICKS - 1), None);
    bench.weighs = false;
    assert_eq!(bench.told(5.0, -2.0, 1000), None);
}

#[test]
fn without_weight_and_after_a_reset_nothing_is_told_of_what_was() {
    let mut bench = Bench::new();
    bench.weighs = false;
    assert_eq!(bench.told(5.0, -2.0, 2000), None);
    bench.weighs = true;
    let told = bench.told(5.0, -2.0, 1000);
    assert!(told.is_some());
    bench.facing.reset(0.0);
    assert_eq!(bench.facing, Facing::new(RADIUS_M, AXLE_S));
}

/// A vehicle hops off a kerb. In the air its motors slow the wheels, which does not accelerate the axle. The blow of
/// the landing, of two ticks, changes the axle's speed, and a friction of 0.6 spins the wheels up again. The
/// estimator mistakes the wheels' acceleration for the axle's, and filters the blow by 28 ms.
#[test]
fn no_landing_looks_like_a_mirrored_imu() {
    const SPUN_UP_M_S2: f32 = 0.6 * G / 0.066;
    const WEIGHS_TICKS: u16 = 250;
    for slowed_m_s in [0.0_f32, 0.2, 0.5, 0.8, 1.2, 2.5] {
        for blow_m_s in [-1.0_f32, -0.5, -0.3, 0.0, 0.3, 0.5, 1.0] {
            let mut facing = Facing::new(RADIUS_M, AXLE_S);
            let (mut axle, mut felt) = (LowPass::new(TICK_S, AXLE_S), LowPass::new(TICK_S, 0.028));
            axle.reset(2.5);
            facing.relative.reset(2.5 / RADIUS_M);
            let mut grounded_ticks = WEIGHS_TICKS;
            let mut wheels_m_s = 2.5_f32;
            for k in 0..1000_u16 {
                let (flies, lands) = ((100..160).contains(&k), (160..162).contains(&k));
                grounded_ticks = if flies || lands { 0 } else { grounded_ticks + 1 };
                wheels_m_s = if flies {
                    wheels_m_s - slowed_m_s / 60.0
                } else {
                    (wheels_m_s + SPUN_UP_M_S2 * TICK_S).min(2.5)
                };
                felt.update(if lands { blow_m_s / (2.0 * TICK_S) } else { 0.0 });
                let unexplained = (felt.value() - axle.update(wheels_m_s)) / G;
                if !k.is_multiple_of(u16::from(INTERVAL_TICKS)) {
                    continue;
                }
                let told = facing.update(&Shown {
                    relative_rad_s: wheels_m_s / RADIUS_M,
                    unexplained,
                    sideways_m_s2: 0.0,
                    weighs: grounded_ticks >= WEIGHS_TICKS,
                    slides: false,
                });
                assert!(
                    !told,
                    "slowed by {slowed_m_s} m/s, a blow of {blow_m_s} m/s: told in tick {k}"
                );
            }
        }
    }
}

/// Wheels that grip again look like a mirrored IMU with more than half a g. The watch finds a mirrored IMU even in
/// what looks like a slide.
#[test]
fn in_a_slide_only_what_is_below_half_a_g_tells() {
    for (amplitude_m_s2, slides, expected) in [(30.0, true, false), (30.0, false, true), (2.0, true, true)] {
        let mut bench = Bench::new();
        // Until then the largest acceleration falls to no less than half a g.
        bench.slides = slides;
        let told = bench.told(amplitude_m_s2, -2.0, 110);
        assert_eq!(told.is_some(), expected, "{amplitude_m_s2}, {slides}");
    }
}

/// An IMU that has shown that it faces forward is not blamed for a slide or for a push, until the vehicle has been disarmed.
#[test]
fn an_imu_that_faces_forward_is_not_blamed_for_a_slide() {
    let mut bench = Bench::new();
    assert_eq!(bench.told(4.0, 0.0, 500), None);
    assert_eq!(bench.told(4.0, -2.0, 3000), None);
    bench.slides = true;
    assert_eq!(bench.told(2.0, -2.0, 3000), None);
    bench.facing.reset(0.0);
    assert!(bench.told(2.0, -2.0, 500).is_some());
    // Motion that is too small to show a mirrored IMU does not show that the IMU faces forward either.
    let mut bench = Bench::new();
    assert_eq!(bench.told(0.8, 0.0, 3000), None);
    bench.slides = true;
    assert!(bench.told(2.0, -2.0, 500).is_some());
}

/// A motion that shakes the IMU sideways as much as forward is a vibration. A steady side force, as in a bend, is
/// not.
#[test]
fn a_vibration_that_the_law_answers_tells_nothing() {
    for (sideways, expected) in [(0.0, true), (0.9, true), (1.3, false), (-2.0, false)] {
        let mut bench = Bench::new();
        bench.sideways = sideways;
        assert_eq!(bench.told(5.0, -2.0, 2000).is_some(), expected, "{sideways}");
    }
}

/// An arm angle that is wrong by 17 degrees while the vehicle accelerates steadily gives a steady error, too.
#[test]
fn what_is_steady_tells_nothing() {
    let mut bench = Bench::new();
    let mut relative_rad_s = 0.0;
    for k in 0..1000_u16 {
        let grown = (f32::from(k) * 0.002).min(1.0);
        relative_rad_s += 0.15 * grown * G / RADIUS_M * INTERVAL_S;
        assert!(!bench.interval(relative_rad_s, 0.0, -0.3 * grown), "{k}");
    }
}
