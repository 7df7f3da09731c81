//! Cost of the plant: `cargo run --release -p plant --example plant_cost`.

use std::path::Path;
use std::time::Instant;

use model::board::BoardScales;
use plant::terrain::Terrain;
use plant::{BridgeState, Plant};

fn main() {
    let vehicle = vehicle_file::read_vehicle(Path::new("vehicles/reference.toml")).expect("the reference vehicle");
    for (name, friction) in [("rolling", 0.8), ("slipping", 0.01)] {
        let terrain = Terrain::slope(0.0873, friction).expect("a terrain");
        let mut plant = Plant::new(&vehicle, &BoardScales::EXAMPLE, terrain, 1).expect("a plant");
        for imu in [0, 1] {
            let chip = if imu == 0 {
                Some(plant.arm_imu())
            } else {
                plant.spar_imu()
            };
            if let Some(chip) = chip {
                chip.transfer(&mut [0x4f, 0x25, 0x25]);
                chip.transfer(&mut [0x52, 0x33]);
                chip.transfer(&mut [0x4e, 0x0f]);
            }
        }
        let mut best = f64::INFINITY;
        for _ in 0..15 {
            let ms = 5_000;
            let start = Instant::now();
            for k in 0..ms {
                let duty = 0.15 + 0.1 * f64::from(k % 2000) / 2000.0;
                plant.advance(
                    1e-3,
                    &[
                        BridgeState::Duty(duty),
                        BridgeState::Duty(duty * 1.01),
                        BridgeState::Duty(0.0),
                    ],
                );
            }
            best = best.min(start.elapsed().as_secs_f64() / f64::from(ms) * 1e9);
        }
        println!("{name}: {best:.0} ns a simulated ms, now {:?}", plant.truth());
    }
}
