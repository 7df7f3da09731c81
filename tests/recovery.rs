//! A sensor that fails for a while and works again: whatever it showed meanwhile, the vehicle knows itself again soon
//! after it stands, can be armed, and drives.

use model::command::Request;
use model::sample::Motor;
use model::supervise::arming::Mode;
use model::supervise::codes::BlockerSet;
use plant::Plant;
use plant::fault::SensorFault;

mod support;
use support::Bench;

/// Time after which a vehicle whose sensor works again and whose bridges are open stands and is calibrated: its arm swings
/// out in 6 s; then the whole vehicle may go on rocking on its wheels, and its gyros are averaged over 4 s of that.
const AGAIN_MS: u64 = 11_000;

fn set(plant: &mut Plant, sensor: &str, fault: SensorFault) {
    match sensor {
        "arm-imu" => plant.arm_imu().set_fault(fault),
        "spar-imu" => plant.spar_imu().expect("has a camera").set_fault(fault),
        "left-encoder" => plant.encoder_mut(Motor::Left).set_fault(fault),
        "right-encoder" => plant.encoder_mut(Motor::Right).set_fault(fault),
        "ballast-encoder" => plant.encoder_mut(Motor::Ballast).set_fault(fault),
        other => panic!("{other}"),
    }
}

/// The vehicle stands, knows its angles and can be armed.
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

fn fails_and_returns(sensor: &str, fault: SensorFault, after_ms: u64, for_ms: u64, seed: u64) {
    let story = format!("{sensor} {fault:?} after {after_ms} ms for {for_ms} ms, seed {seed}");
    let mut bench = Bench::driving(seed, 1.0);
    bench.drive = Some([0.0, 0.0]);
    // The vehicle brakes: the arm swings, and the wheels turn back and forth.
    bench.run(after_ms);
    bench.board.world(|world| set(&mut world.plant, sensor, fault));
    bench.run(for_ms);
    bench
        .board
        .world(|world| set(&mut world.plant, sensor, SensorFault::None));
    // What goes on driving stops by itself; what opened its bridges swings out.
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

fn every_fault(sensor: &str) {
    for fault in SensorFault::ALL.into_iter().filter(|fault| *fault != SensorFault::None) {
        for (after_ms, for_ms, seed) in [(60, 30, 1), (150, 100, 2), (300, 250, 3), (500, 700, 4), (900, 2500, 5)] {
            fails_and_returns(sensor, fault, after_ms, for_ms, seed);
        }
    }
}

#[test]
fn an_arm_imu_that_was_lost_and_is_back() {
    every_fault("arm-imu");
}

#[test]
fn a_spar_imu_that_was_lost_and_is_back() {
    every_fault("spar-imu");
}

#[test]
fn a_wheels_encoder_that_was_lost_and_is_back() {
    every_fault("left-encoder");
    every_fault("right-encoder");
}

#[test]
fn a_ballasts_encoder_that_was_lost_and_is_back() {
    every_fault("ballast-encoder");
}
