//! Drives a scenario on the emulated board and prints its metrics and its speed.
use board_emulator::backend::EmulatedBackend;
use board_emulator::{Firmware, Settings, build};
use hil_sim::plant::Plant;
use hil_sim::scenario::{self, Scenario};

fn main() {
    let path = std::env::args().nth(1).unwrap();
    let mut scenario = Scenario::read(path.as_ref()).unwrap();
    if let Some(s) = std::env::args().nth(2) {
        scenario.duration_s = s.parse().unwrap();
        scenario.steps.retain(|x| x.at_s < scenario.duration_s);
    }
    let firmware: &Firmware = build::firmware().unwrap();
    let vehicle = vehicle_file();
    let plant = Plant::new(&vehicle, scenario.terrain.clone(), scenario.seed).unwrap();
    let mut backend = EmulatedBackend::power_on(firmware, plant, Settings::default()).unwrap();
    let t = std::time::Instant::now();
    let outcome = scenario::run(&scenario, &mut backend, |_| {});
    let w = t.elapsed().as_secs_f64();
    for l in &outcome.log {
        println!("{l}");
    }
    for c in scenario::evaluate(&scenario, &outcome) {
        println!("{c:?}");
    }
    println!("ratio {:.2}", scenario.duration_s / w);
    let n = backend.emulation().unwrap().at(|s| s.instructions()).unwrap();
    println!("instr/ms {}", n as f64 / (scenario.duration_s * 1000.0));
}

fn vehicle_file() -> model::vehicle::Vehicle<f64> {
    model::vehicle::Vehicle::new(firmware::built_in::PARAMETERS.cast::<f64>()).unwrap()
}
