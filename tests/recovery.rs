//! A sensor fails for a while and works again. Whatever it showed meanwhile, the estimates are right again soon after the vehicle
//! stands, and the vehicle arms and drives.

use model::command::Request;
use model::supervise::arming::Mode;
use model::supervise::codes::BlockerSet;
use plant::fault::SensorFault;
use virtual_board::scenario::Sensor;

mod support;
use support::Bench;

/// Time after which a vehicle whose sensor works again and whose bridges are open must stand and be calibrated, ms. The swing of
/// its arm decays in 6 s. Then the vehicle may still rock on its wheels, and the calibration averages the gyros over 4 s.
const AGAIN_MS: u64 = 11_000;

/// Asserts that the vehicle stands, that its estimates are right, and that nothing blocks arming.
fn knows_itself(bench: &mut Bench, story: &str) {
    let truth = bench.board.world(|world| world.plant.truth());
    let status = bench.board.status().expect("runs");
    assert_eq!(status.blockers, BlockerSet::EMPTY, "{story}: {:?}", status.blockers);
    let estimate = &status.estimate;
    assert!(truth.speed_m_s.abs() < 0.05, "{story}: {} m/s", truth.speed_m_s);
    assert!(
        (f64::from(estimate.phi_rad) - truth.phi_rad).abs() < 1.0_f64.to_radians(),
        "{story}: arm at {} rad, estimated {}",
        truth.phi_rad,
        estimate.phi_rad
    );
    assert!(
        estimate.slope_rad.abs() < 1.0_f32.to_radians(),
        "{story}: {} rad of slope",
        estimate.slope_rad
    );
    assert!(estimate.speed_m_s.abs() < 0.05, "{story}: {} m/s", estimate.speed_m_s);
    assert!(
        estimate.phi_rate_rad_s.abs() < 0.05 && estimate.yaw_rate_rad_s.abs() < 0.05,
        "{story}: {estimate:?}"
    );
}

fn fails_and_returns(sensor: Sensor, fault: SensorFault, after_ms: u64, for_ms: u64, seed: u64) {
    let story = format!("{sensor:?} {fault:?} after {after_ms} ms for {for_ms} ms, seed {seed}");
    let mut bench = Bench::driving(seed, 1.0);
    bench.drive = Some([0.0, 0.0]);
    // The vehicle brakes: the arm swings, and the wheels turn back and forth.
    bench.run(after_ms);
    bench.set_fault(sensor, fault);
    bench.run(for_ms);
    bench.set_fault(sensor, SensorFault::None);
    // A vehicle that is still armed comes to rest. Once the bridges are open, the arm's swing decays.
    bench.run(1000);
    bench.request(Request::Disarm);
    bench.run(AGAIN_MS);
    bench.request(Request::ClearFaults);
    bench.run(100);
    knows_itself(&mut bench, &story);
    bench.request(Request::Arm);
    bench.run(100);
    assert_eq!(bench.mode(), Mode::Armed, "{story}");
    let from = bench.board.world(|world| world.plant.truth());
    bench.drive = Some([0.5, 0.0]);
    bench.run(3000);
    let truth = bench.board.world(|world| world.plant.truth());
    let driven_m = (truth.x_m - from.x_m).hypot(truth.y_m - from.y_m);
    assert!(
        bench.board.status().expect("runs").faults.is_empty(),
        "{story}: {:?}",
        bench.board.status()
    );
    assert!(
        (truth.speed_m_s - 0.5).abs() < 0.05 && driven_m > 0.5,
        "{story}: {truth:?}"
    );
}

fn every_fault(sensor: Sensor) {
    for fault in SensorFault::ALL.into_iter().filter(|fault| *fault != SensorFault::None) {
        for (after_ms, for_ms, seed) in [(60, 30, 1), (150, 100, 2), (300, 250, 3), (500, 700, 4), (900, 2500, 5)] {
            fails_and_returns(sensor, fault, after_ms, for_ms, seed);
        }
    }
}

#[test]
fn an_arm_imu_that_was_lost_and_is_back() {
    every_fault(Sensor::ArmImu);
}

#[test]
fn a_spar_imu_that_was_lost_and_is_back() {
    every_fault(Sensor::SparImu);
}

#[test]
fn a_wheels_encoder_that_was_lost_and_is_back() {
    every_fault(Sensor::LeftEncoder);
    every_fault(Sensor::RightEncoder);
}

#[test]
fn a_ballasts_encoder_that_was_lost_and_is_back() {
    every_fault(Sensor::BallastEncoder);
}
