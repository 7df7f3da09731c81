//! The hashes of the default drive and of a session as the page has it: a board, an operator, bytes between them.
//!
//! `hil-sim/console/test/session.mjs` plays the same session with the page's own module and compares the two lines.

use std::error::Error;

use model::command::Request;
use vehicle_console::operator_link::OperatorLink;
use vehicle_console::simulation::{PageScene, Simulation, default_drive_hash};

/// Steps of the session, 10 ms each.
const STEPS: u32 = 1500;

fn main() -> Result<(), Box<dyn Error>> {
    let mut board = Simulation::boot(&PageScene::default())?;
    let mut link = OperatorLink::new(7);
    link.operate(true);
    for step in 0..STEPS {
        let now_us = u64::from(step) * 10_000;
        if step == 500 {
            link.request(now_us, Request::Arm);
        }
        if step % 2 == 0 {
            let (speed_m_s, yaw_rate_rad_s) = if (700..1200).contains(&step) {
                (0.5, 0.25)
            } else {
                (0.0, 0.0)
            };
            link.drive(now_us, speed_m_s, yaw_rate_rad_s);
        }
        board.send(&link.poll(now_us));
        let said = board.run(10);
        link.receive(now_us + 10_000, &said);
    }
    // The first board of the process, as of the page's worker: the boot's number goes over the link.
    println!("session {:016x}", board.hash());
    drop(board);
    println!("drive {:016x}", default_drive_hash()?);
    Ok(())
}
