//! The flashed code and the host's pure step compute the same bits, tick after tick.

use board_emulator::elf::flight;
use firmware::built_in;
use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;

use crate::support::{Operator, firmware, powered};

/// Number of ticks compared, unless the environment variable sets another (a million in the nightly run).
const TICKS: u64 = 100_000;
const TICKS_VARIABLE: &str = "EQUIVALENCE_TICKS";

fn ticks() -> u64 {
    std::env::var(TICKS_VARIABLE).map_or(TICKS, |text| text.parse().expect("a number of ticks"))
}

/// FNV-1a over what one tick commanded the bridges.
fn hash(record: &FlightRecord, enable: bool, duty: [i16; 3]) -> u64 {
    let bytes = record.tick.to_le_bytes().into_iter().chain([u8::from(enable)]);
    bytes
        .chain(duty.into_iter().flat_map(i16::to_le_bytes))
        .fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
        })
}

/// Records every tick of a drive from power-up on.
fn record(ticks: u64) -> Vec<FlightRecord> {
    let address = flight::address(firmware()).expect("the record is the host's");
    let mut board = Operator::new(powered());
    board
        .emulation
        .at(move |stopped| stopped.probe(address, flight::WORDS as u64))
        .expect("it runs");
    let mut records: Vec<FlightRecord> = Vec::new();
    board.run(700);
    board.arm();
    // The commands change all the time, so that every branch of the laws runs.
    let mut n = 0_u32;
    while (records.len() as u64) < ticks {
        n += 1;
        board.command = Some(((f64::from(n) * 0.7).sin() as f32, (f64::from(n) * 0.3).cos() as f32));
        board.run(500);
        let words = board.emulation.at(|stopped| stopped.take_probe()).expect("it runs");
        for words in words.chunks(flight::WORDS) {
            let record = flight::decode(words).expect("a record");
            let last = records.last().map_or(0, |last: &FlightRecord| last.tick);
            match record.tick.checked_sub(last) {
                Some(0) => {}
                Some(1) => records.push(record),
                gap => panic!("tick {} after {last}: {gap:?}", record.tick),
            }
        }
    }
    records
}

fn core(parameters: &model::vehicle::VehicleParameters<f32>) -> VehicleCore {
    VehicleCore::new(&Vehicle::new(*parameters).expect("the built-in vehicle"), &SCALES)
}

/// Replays records; returns the number of the first tick that differs.
fn first_difference(records: &[FlightRecord], mut core: VehicleCore) -> Option<u32> {
    for record in records {
        let output = core.step(&record.sample, &record.command).actuation;
        let flown = hash(record, record.actuation.enable, record.actuation.duty);
        if hash(record, output.enable, output.duty) != flown {
            return Some(record.tick);
        }
    }
    None
}

#[test]
fn the_elf_and_the_host_step_alike() {
    let records = record(ticks());
    let enabled = records.iter().filter(|record| record.actuation.enable).count();
    let moving = records.iter().filter(|record| record.actuation.duty != [0; 3]).count();
    println!("{} ticks, {enabled} armed, {moving} with a duty", records.len());
    assert!(enabled * 2 > records.len() && moving * 2 > records.len());
    assert_eq!(first_difference(&records, core(&built_in::PARAMETERS)), None);

    // A number that is wrong by a thousandth shows, as the law's gains follow from the vehicle.
    let mut mutant = built_in::PARAMETERS;
    mutant.body.arm_mass_kg *= 1.001;
    let found = first_difference(&records, core(&mutant));
    println!("with another mass the first difference is at tick {found:?}");
    assert!(found.is_some());
}
