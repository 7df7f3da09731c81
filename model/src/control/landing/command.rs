//! The path of the commanded speed to the law: a ramp within the ground's limits, then smoothing.

use crate::bounded::Bounded;
use crate::control::ballast_plan::Gentleness;
use crate::control::hold::Hold;
use crate::control::speed::SpeedInput;
use crate::vehicle::{ControlParameters, G, Scales, Vehicle};

/// Reference below which the place is captured, nondimensional.
const HOLD_REFERENCE: f32 = 0.03;

/// Largest speed by which the law lets sliding wheels run ahead of the vehicle, m/s. More slip gives no more force.
/// With less slip the estimator would soon report that the wheels roll again (`REGAINED_M_S` in
/// `estimate/traction.rs`). In a slide of more than three seconds the estimator may report so even with this slip, for
/// some tenths of a second, because the estimated speed over the ground drifts.
const SLIP_MAX_M_S: f32 = 0.3;

/// The acceleration, g, and the smoothing time, s, of a command to `vehicle`: the values of its file, bounded so that
/// the ballast of a level spar does not swing over.
pub(super) fn gentle(vehicle: &Vehicle<f32>) -> (f32, f32) {
    let control = &vehicle.parameters().control;
    let wished_g = control.acceleration_max_m_s2 / G;
    Gentleness::new(vehicle).map_or((wished_g, control.comfort_s), |gentle| {
        let acceleration_g = wished_g.bounded(0.0, gentle.acceleration_g);
        let smoothing_s = gentle.smoothing_s * acceleration_g / gentle.acceleration_g;
        (acceleration_g, control.comfort_s.bounded(smoothing_s, f32::MAX))
    })
}

/// Bounds of the acceleration in one tick, g; both are > 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Room {
    /// Friction coefficient that the law plans with.
    pub(super) mu: f32,
    pub(super) forward: f32,
    pub(super) backward: f32,
}

/// The path of the commanded speed to the law: a ramp within the ground's limits, then smoothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CommandRamp {
    speed_max_m_s: f32,
    hold: Hold,
    gain: f32,
    /// The smoothing's time constant, in time units.
    lag: f32,
    /// Largest slip, nondimensional.
    slip_max: f32,
    ramp: f32,
    reference: f32,
    acceleration: f32,
}

impl CommandRamp {
    /// The command path for a tick of `dt_s` and a smoothing time of `comfort_s`.
    pub(super) fn new(control: &ControlParameters<f32>, comfort_s: f32, dt_s: f32, scales: &Scales<f32>) -> Self {
        Self {
            speed_max_m_s: control.speed_max_m_s,
            hold: Hold::new(control.hold_kp_per_s),
            gain: if comfort_s > 0.0 {
                1.0 - libm::expf(-dt_s / comfort_s)
            } else {
                1.0
            },
            lag: comfort_s / scales.time_s,
            slip_max: SLIP_MAX_M_S / scales.speed_m_s,
            ramp: 0.0,
            reference: 0.0,
            acceleration: 0.0,
        }
    }

    /// The reference, nondimensional.
    pub(super) fn reference(&self) -> f32 {
        self.reference
    }

    /// Time by which the reference lags the ramp, in time units.
    pub(super) fn lag(&self) -> f32 {
        self.lag
    }

    /// Restarts at `speed`, nondimensional.
    pub(super) fn reset(&mut self, speed: f32) {
        self.ramp = speed;
        self.reference = speed;
        self.acceleration = 0.0;
        self.hold.release();
    }

    /// The commanded speed, m/s: the operator's, or the speed of the position hold, which captures the place once the
    /// vehicle is `slow`.
    pub(super) fn target_m_s(&mut self, input: &SpeedInput, slow: bool) -> f32 {
        let target = input.target_m_s.bounded(-self.speed_max_m_s, self.speed_max_m_s);
        let slow = slow && self.reference.abs() < HOLD_REFERENCE;
        target + self.hold.speed_m_s(target, input.distance_m, slow)
    }

    /// Bounds the reference while the wheels slide over ground that passes at `ground`, nondimensional. A reference
    /// away from rest runs ahead of that speed by no more than the largest slip. A bounded reference asks for no
    /// acceleration, because the ground already gives all that it can. Stopping is not bounded: with a wrong speed
    /// over the ground, the vehicle would not stop.
    fn slip(&mut self, ground: f32) {
        let least = ground.bounded(f32::MIN, 0.0) - self.slip_max;
        let most = ground.bounded(0.0, f32::MAX) + self.slip_max;
        if !(least..=most).contains(&self.ramp) {
            self.ramp = self.ramp.bounded(least, most);
            self.acceleration = 0.0;
        }
        self.reference = self.reference.bounded(least, most);
    }

    /// The acceleration of the reference, g.
    pub(super) fn acceleration(&self) -> f32 {
        self.acceleration
    }

    /// Advances one tick towards `target`. To prevent windup, the reference leads the landing speed by no more than
    /// saturates the acceleration, and the ramp leads by that plus the lag of the smoothing. While the wheels slide,
    /// `ground` is the speed at which the ground passes.
    pub(super) fn advance(
        &mut self,
        target: f32,
        landing: f32,
        ground: Option<f32>,
        tick: f32,
        room: &Room,
        pole: f32,
    ) {
        let step = (target - self.ramp).bounded(-room.backward * tick, room.forward * tick);
        let (least, most) = (landing - room.backward / pole, landing + room.forward / pole);
        let ramp = self.ramp + step;
        self.ramp = ramp.bounded(least - room.backward * self.lag, most + room.forward * self.lag);
        self.reference = (self.reference + self.gain * (self.ramp - self.reference)).bounded(least, most);
        // The ramp's motion due to the landing speed is no commanded acceleration.
        self.acceleration += self.gain * (step / tick - self.acceleration);
        if let Some(ground) = ground {
            self.slip(ground);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::test_vehicle;

    /// The result of `gentle` for an acceleration and a comfort time of the file, with a spar that is levelled or not.
    fn asked(acceleration_m_s2: f32, comfort_s: f32, levelled: bool) -> (f32, f32) {
        let mut parameters = *test_vehicle::reference().parameters();
        parameters.control.acceleration_max_m_s2 = acceleration_m_s2;
        parameters.control.comfort_s = comfort_s;
        if let (Some((spar, _)), false) = (&mut parameters.spar, levelled) {
            [
                spar.spar_gain,
                spar.ballast_gain,
                spar.spar_rate_gain,
                spar.ballast_rate_gain,
            ] = [0.0; 4];
        }
        gentle(&Vehicle::new(parameters).expect("valid"))
    }

    /// The reference, m/s, two seconds after a start at `from_m_s` with the command `target_m_s`, while the wheels
    /// slide on ground that passes at `ground_m_s`.
    fn slides_to(from_m_s: f32, target_m_s: f32, ground_m_s: f32) -> f32 {
        let vehicle = test_vehicle::reference();
        let scales = vehicle.scales();
        let mut command = CommandRamp::new(&vehicle.parameters().control, 0.2, 0.001, &scales);
        command.reset(from_m_s / scales.speed_m_s);
        let room = Room {
            mu: 0.45,
            forward: 0.2,
            backward: 0.2,
        };
        let [target, ground] = [target_m_s, ground_m_s].map(|speed_m_s| speed_m_s / scales.speed_m_s);
        for _ in 0..2000 {
            // The wheels follow the reference.
            command.advance(target, command.reference(), Some(ground), 0.00627, &room, 1.5);
        }
        command.reference() * scales.speed_m_s
    }

    #[test]
    fn sliding_wheels_run_no_further_ahead_than_the_slip() {
        for (from_m_s, target_m_s, ground_m_s, want_m_s) in [
            (0.2, 2.0, 0.2, 0.2 + SLIP_MAX_M_S),
            (-0.2, -2.0, -0.2, -0.2 - SLIP_MAX_M_S),
            // The commanded speed is lower.
            (0.2, 0.4, 0.2, 0.4),
            // It stops, whatever the speed over the ground seems to be,
            (1.0, 0.0, 1.0, 0.0),
            (-1.0, 0.0, -1.0, 0.0),
            // and does not run away from the command.
            (0.0, 2.0, -1.0, SLIP_MAX_M_S),
            (0.0, -2.0, 1.0, -SLIP_MAX_M_S),
        ] {
            let found_m_s = slides_to(from_m_s, target_m_s, ground_m_s);
            assert!(
                (found_m_s - want_m_s).abs() < 0.01,
                "{target_m_s} {ground_m_s}: {found_m_s} m/s"
            );
        }
    }

    #[test]
    fn a_level_spar_bounds_the_command_and_a_spar_left_alone_does_not() {
        let bound = Gentleness::new(&test_vehicle::reference()).expect("a levelled spar");
        let (acceleration_g, smoothing_s) = asked(6.0, 0.0, true);
        assert_eq!(acceleration_g, bound.acceleration_g);
        // Within the rounding of the share.
        assert!((smoothing_s / bound.smoothing_s - 1.0).abs() < 1e-6);
        let (acceleration_g, smoothing_s) = asked(6.0, 0.0, false);
        assert!((acceleration_g * G - 6.0).abs() < 1e-5 && smoothing_s == 0.0);
        // Half the bound needs half the smoothing. A longer comfort time is kept.
        let half_m_s2 = 0.5 * bound.acceleration_g * G;
        assert!((asked(half_m_s2, 0.0, true).1 / bound.smoothing_s - 0.5).abs() < 1e-5);
        assert_eq!(asked(half_m_s2, 1.0, true).1, 1.0);
    }
}
