//! The firmware of a vehicle without a camera spar: another ELF, built for the small robot.

use std::path::Path;

use board_emulator::run::{EmulatedBackend, EmulationSettings};
use model::sample::Motor;
use model::supervise::arming::Mode;
use model::supervise::codes::FaultSet;
use plant::fault::SensorFault;
use virtual_board::scenario::{self, Scenario};

use crate::support::firmware;

const DRIVE: &str = r#"
title = "Drives with inputs of the spar that nothing is connected to"
duration_s = 6.0
seed = 4

[[step]]
at_s = 0.0
action = "analog-fault"
sensor = "ballast-current"
CURRENT

[[step]]
at_s = 1.5
action = "arm"

[[step]]
at_s = 2.5
action = "drive"
speed_m_s = 0.5
"#;

/// INTF_CONFIG1 of an IMU to which nobody has written (DS-000347, register map).
const INTF_CONFIG1_RESET: u8 = 0x91;

/// Whatever the unused inputs show, the board neither asks the spar's IMU nor takes a fault from encoder and current sensor.
#[test]
#[ignore = "needs an ELF without a spar: FIRMWARE_ELF=$(VEHICLE=vehicles/small.toml .ci/build-board)"]
fn a_vehicle_without_a_spar_neither_reads_nor_faults_on_its_inputs() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles/small.toml");
    let vehicle = vehicle_file::read_vehicle(&file).expect("the small robot");
    assert!(vehicle.parameters().spar.is_none());
    for (encoder, current) in [
        (SensorFault::Garbage, "reads = \"dead\""),
        (SensorFault::Off, "offset = 50.0"),
    ] {
        let scenario = Scenario::parse("drive.toml", &DRIVE.replace("CURRENT", current)).expect("valid");
        let mut plant = scenario.plant(&vehicle).expect("a plant");
        plant.encoder_mut(Motor::Ballast).set_fault(encoder);
        let mut backend =
            EmulatedBackend::power_on(firmware(), plant, EmulationSettings::default()).expect("the board powers up");
        let outcome = scenario::run(&scenario, &mut backend, |_| {}).expect("valid");
        let row = outcome.trace.rows.last().expect("rows");
        assert_eq!(
            (row.status.mode, row.status.faults),
            (Mode::Armed, FaultSet::EMPTY),
            "{encoder:?}"
        );
        assert!(
            (row.truth.speed_m_s - 0.5).abs() < 0.025,
            "{encoder:?}: {} m/s",
            row.truth.speed_m_s
        );
        assert_eq!(row.status.current_a[2], 0.0, "{encoder:?}");
        let about_spar = outcome.log.iter().find(|line| line.contains("spar IMU"));
        assert_eq!(about_spar, None, "the board looks for a spar IMU");
        let emulation = backend.emulation().expect("it ran to the end");
        let [arm, spar] = emulation
            .at(|stopped| stopped.board().intf_config1())
            .expect("it ran to the end");
        assert_ne!(
            arm, INTF_CONFIG1_RESET,
            "{encoder:?}: the driver has not set up the arm IMU"
        );
        assert_eq!(
            spar, INTF_CONFIG1_RESET,
            "{encoder:?}: the driver has set up a spar IMU"
        );
    }
}
