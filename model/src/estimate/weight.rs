//! Whether the vehicle stands on its wheels: the accelerometer feels about its weight.

use super::rate_filter::LowPass;
use crate::persistence::Persistence;
use crate::vehicle::G;

/// Range of the specific force, in g, in which the accelerometer shows the vertical. Below this range the vehicle
/// falls; above it the vehicle lands.
const WEIGHT_MIN_G: f32 = 0.5;
const WEIGHT_MAX_G: f32 = 2.0;
/// Time constant of the mean force, s. A vehicle that begins to fall feels half its weight after 10 ms. Of a vibration of 1 g at
/// 20 Hz, half is left.
const FORCE_TIME_CONSTANT_S: f32 = 0.015;
/// Ticks for which the mean force must be the weight before the accelerometer is trusted again: the wheels rebound.
const CARRIED_TICKS: u16 = 30;
/// Ticks without weight after which the vehicle is on rough ground and does not fall: a fall of 0.44 m lasts that long and
/// has its own fault. Each tick with weight takes back half a tick without: rough ground is without weight for a third of the time.
const FALL_MAX_TICKS: u16 = 300;
/// Ticks for which each sample must be the weight before the accelerometer may show a slide or its mounting: most of a period of
/// 3 Hz. Under a vibration of about g the accelerometer would otherwise count in only one half of each period, which looks like an
/// acceleration.
const STEADY_WEIGHT_TICKS: u16 = 270;

/// Watches the specific force in the plane of the wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weight {
    force_m_s2: [LowPass; 2],
    carried: Persistence,
    /// Half ticks without weight.
    without: u16,
    steady: Persistence,
}

impl Weight {
    /// A watch called every `dt_s` seconds.
    pub fn new(dt_s: f32) -> Self {
        Self {
            force_m_s2: [LowPass::new(dt_s, FORCE_TIME_CONSTANT_S); 2],
            carried: Persistence::new(CARRIED_TICKS),
            without: 0,
            steady: Persistence::new(STEADY_WEIGHT_TICKS),
        }
    }

    /// Updates the watch with the specific force along two axes of the plane of the wheels, m/s^2; `None` from a sensor that is not
    /// believed.
    ///
    /// ```
    /// use model::estimate::weight::Weight;
    /// let mut weight = Weight::new(0.001);
    /// // A vibration of 1 g at 50 Hz shakes a vehicle that stands.
    /// for tick in 0..500 {
    ///     let swing = (0.1 * core::f32::consts::PI * tick as f32).sin();
    ///     weight.update(Some([0.0, 9.81 * (1.0 + swing)]));
    /// }
    /// assert!(weight.is_carried() && !weight.is_steady());
    /// // A ledge of 20 mm: 64 ms without weight.
    /// for _ in 0..64 {
    ///     weight.update(Some([0.0, 0.0]));
    /// }
    /// assert!(!weight.is_carried());
    /// // Rough ground: half of the time twice the weight, half of the time none, ten times per second.
    /// for tick in 0..400 {
    ///     weight.update(Some([0.0, if tick % 100 < 50 { 25.0 } else { 0.0 }]));
    /// }
    /// assert!(weight.is_carried());
    /// ```
    #[inline]
    pub fn update(&mut self, force_m_s2: Option<[f32; 2]>) {
        let Some(force_m_s2) = force_m_s2 else {
            self.carried.update(false);
            self.without = 0;
            self.steady.update(false);
            return;
        };
        let [x, z] = &mut self.force_m_s2;
        if self.steady.update(is_weight(force_m_s2)) {
            // Nearly always: where every sample is the weight, so is their mean, and has been for long enough.
            x.reset(force_m_s2[0]);
            z.reset(force_m_s2[1]);
            self.without = self.without.saturating_sub(1);
            return;
        }
        x.update(force_m_s2[0]);
        z.update(force_m_s2[1]);
        let carried = self.carried.update(is_weight([x.value(), z.value()]));
        self.without = if carried {
            self.without.saturating_sub(1)
        } else {
            // Bounded, so that smooth ground is soon smooth again.
            (self.without + 2).min(3 * FALL_MAX_TICKS)
        };
    }

    /// Whether the wheels carry the vehicle: it neither falls nor lands, however it shakes.
    pub fn is_carried(&self) -> bool {
        self.carried.stands() || self.without >= 2 * FALL_MAX_TICKS
    }

    /// Whether besides nothing shakes the vehicle.
    pub fn is_steady(&self) -> bool {
        self.steady.stands()
    }
}

/// Whether the specific force has about the magnitude of the weight.
fn is_weight([x, z]: [f32; 2]) -> bool {
    const LEAST: f32 = WEIGHT_MIN_G * G;
    const MOST: f32 = WEIGHT_MAX_G * G;
    (LEAST * LEAST..MOST * MOST).contains(&(x * x + z * z))
}
