//! A motor whose encoder, current sensor and leads contradict each other.

use super::*;

#[test]
fn an_encoder_that_denies_its_motors_voltage_is_implausible() {
    let mut bench = Bench::new();
    // 12 V at rest with 6 A cannot be, and without a current only if a lead is open.
    bench.applied = Actuation {
        enable: true,
        duty: [16384, 0, 0],
    };
    bench.sensed.current_a[0] = 6.0;
    // The gyro shows that the left wheel turns, and not the right one.
    bench.estimate.yaw_rate_rad_s = -4.0;
    assert_eq!(bench.ticks_until(Fault::EncoderImplausible, 400), Some(250));
    // The wheel stands, by its encoder as by the other wheel and the gyro.
    bench = Bench::new();
    bench.applied = Actuation {
        enable: true,
        duty: [16384, 0, 0],
    };
    bench.sensed.current_a[0] = 6.0;
    assert_eq!(bench.ticks_until(Fault::CurrentSensor, 400), Some(250));
    assert!(!bench.tick().faults.contains(Fault::EncoderImplausible));
    for (motor, fault, class) in [
        (0, Fault::LeftMotorOpen, FaultSet::OPENING),
        (1, Fault::RightMotorOpen, FaultSet::OPENING),
        (2, Fault::BallastMotorOpen, FaultSet::SPAR),
    ] {
        let mut bench = Bench::new();
        bench.applied.enable = true;
        bench.applied.duty[motor] = 16384;
        // The output falls behind.
        bench.sensed.relative_rate_rad_s[motor] = 0.2;
        bench.tick();
        bench.sensed.relative_rate_rad_s[motor] = 0.0;
        assert_eq!(bench.ticks_until(fault, 400), Some(99));
        let mut only = FaultSet::EMPTY;
        only.insert(fault);
        assert_eq!(bench.tick().faults, only);
        assert!(class.has_any(only));
    }
    // An open bridge says nothing of its encoder.
    let mut bench = Bench::new();
    bench.applied.duty = [16384, 0, 0];
    assert_eq!(bench.ticks_until(Fault::EncoderImplausible, 200), None);
}
