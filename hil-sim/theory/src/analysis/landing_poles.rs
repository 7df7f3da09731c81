//! The poles of the vehicle under the landing law, computed numerically: from the effect of a small change of
//! each state after one tick of the vehicle's own law and of the plant.
//!
//! The computation does not use the law's design poles. Without the effects of filter, tick and delay both would
//! agree, so the difference shows these effects.

use model::control::landing::{LandingLaw, MOTION_STATES};
use model::control::speed::SpeedInput;
use model::sample::TICK_S;
use model::vehicle::Vehicle;
use nalgebra::SMatrix;

use super::poles::eigenvalues;
use super::sampled::{SampledMotion, SampledPlant, cast};

/// The states of the law, and phi, theta', phi', the two stages of the wheel-rate filter, the estimator's sine
/// of the slope, and the commanded voltage that does not act yet.
const STATES: usize = MOTION_STATES + 7;
/// Change of a state, nondimensional. About zero, single precision represents this change to a part in 1e7, and
/// sines are linear over it to a part in 1e8.
const CHANGE: f64 = 1e-4;
/// Time for which the law runs before it is linearised, in time units: by then the fast learning of the slope
/// has ended.
const SETTLING_TIME: f64 = 16.0;
/// Commanded speed, m/s: negligible, but the law does not treat it as standing.
const CREEPING_M_S: f32 = 1e-9;
/// Share of a motion that remains after a tick, below which the motion counts as over within the tick.
const OVER: f64 = 0.1;

/// The vehicle's own law and a plant, about steady driving on the level.
struct Loop<'a> {
    vehicle: &'a Vehicle<f64>,
    plant: &'a SampledPlant,
    law: LandingLaw,
    tick: f64,
    gain: f64,
}

impl<'a> Loop<'a> {
    fn new(vehicle: &'a Vehicle<f64>, plant: &'a SampledPlant) -> Self {
        let time_s = vehicle.scales().time_s;
        let lag_s = vehicle.parameters().estimator.wheel_rate_time_constant_s;
        let mut law = LandingLaw::new(&cast(vehicle), TICK_S);
        law.reset(0.0);
        let mut this = Self {
            vehicle,
            plant,
            law,
            tick: f64::from(TICK_S) / time_s,
            gain: 1.0 - libm::exp(-f64::from(TICK_S) / lag_s),
        };
        let rests = this.told(&SampledMotion::default(), 0.0);
        for _ in 0..(SETTLING_TIME / this.tick) as u32 {
            this.law.step(&rests);
        }
        this
    }

    /// The law's input.
    fn told(&self, motion: &SampledMotion, sin_slope: f32) -> SpeedInput {
        let scales = self.vehicle.scales();
        SpeedInput {
            target_m_s: CREEPING_M_S,
            voltage_max_v: scales.voltage_to_si(self.plant.voltage_max) as f32,
            ..motion.sensed(&scales, sin_slope, [0.0; 3])
        }
    }

    /// The states a tick after these.
    fn after(&self, states: &[f64; STATES]) -> [f64; STATES] {
        let [
            phi,
            theta_rate,
            phi_rate,
            first,
            second,
            sin_slope,
            waiting,
            of_law @ ..,
        ] = *states;
        let mut motion = SampledMotion {
            theta: 0.0,
            phi,
            theta_rate,
            phi_rate,
            stages: [first, second],
        };
        let mut law = self.law;
        for (state, value) in law.motion_states().into_iter().zip(of_law) {
            *state = value as f32;
        }
        motion.filter(self.gain);
        let output = law.step(&self.told(&motion, sin_slope as f32));
        let sin_slope = sin_slope + f64::from(law.slope_lesson().unwrap_or_default());
        let commanded = self.vehicle.scales().voltage_from_si(f64::from(output.voltage_v));
        motion.advance(self.plant, (0.0, 1.0), waiting, self.tick);
        let of_motion = [motion.phi, motion.theta_rate, motion.phi_rate];
        let [first, second] = motion.stages;
        let mut after = [0.0; STATES];
        let of_law = law.motion_states().map(|state| f64::from(*state));
        let all = of_motion
            .into_iter()
            .chain([first, second, sin_slope, commanded])
            .chain(of_law);
        for (state, value) in after.iter_mut().zip(all) {
            *state = value;
        }
        after
    }

    /// The effect of a change of each state after a tick, one state per column.
    fn matrix(&self) -> SMatrix<f64, STATES, STATES> {
        let mut matrix = SMatrix::zeros();
        for changed in 0..STATES {
            let towards = |change: f64| {
                let mut states = [0.0; STATES];
                states[changed] = change;
                self.after(&states)
            };
            let (up, down) = (towards(CHANGE), towards(-CHANGE));
            for (row, (up, down)) in up.into_iter().zip(down).enumerate() {
                matrix[(row, changed)] = (up - down) / (2.0 * CHANGE);
            }
        }
        matrix
    }
}

/// The poles of `plant` under the landing law of `vehicle` in steady driving on the level, including a tick of
/// delay, in 1/s as `[re, im]`, the slowest first. Motions that end within a tick are omitted. `None` if the
/// poles cannot be computed.
pub fn landing_poles(vehicle: &Vehicle<f64>, plant: &SampledPlant) -> Option<Vec<[f64; 2]>> {
    let of_tick = eigenvalues(&Loop::new(vehicle, plant).matrix())?;
    let tick_s = f64::from(TICK_S);
    let mut poles: Vec<[f64; 2]> = of_tick
        .into_iter()
        .map(|[re, im]| (re.hypot(im), im.atan2(re)))
        .filter(|(left, _)| *left > OVER)
        .map(|(left, turned)| [left.ln() / tick_s, turned / tick_s])
        .collect();
    poles.sort_by(|p, q| q[0].total_cmp(&p[0]).then(p[1].total_cmp(&q[1])));
    Some(poles)
}
