//! Start-up and the tasks.

use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_time::{Duration, Ticker, Timer};
use embedded_hal_async::spi::SpiDevice;
use firmware::hardware::{AnalogInputs, Bridges, CycleCounter, EmergencyStop, EncoderCounters, Watchdog};
use model::sample::Actuation;

use crate::board::{self, Board, Imu};

#[embassy_executor::task]
async fn control(mut board: Board) {
    let mut tick = Ticker::every(Duration::from_hz(1000));
    let mut n = 0u32;
    let _ = who(&mut board.chassis_imu).await;
    loop {
        tick.next().await;
        let c0 = board.cycles.cycles();
        let mut b = [0u8; 15];
        b[0] = 0x1D | 0x80;
        let _ = board.chassis_imu.transfer_in_place(&mut b).await;
        let mut b2 = [0u8; 15];
        b2[0] = 0x1D | 0x80;
        let _ = board.spar_imu.transfer_in_place(&mut b2).await;
        let a = board.analog.read().await;
        let counts = board.encoders.counts();
        let stop = board.emergency_stop.is_pressed();
        if n == 0 {
            board.bridges.clear_break();
        }
        board.bridges.apply(&Actuation {
            enable: n > 20 && !stop,
            duty: [8000, -8000, 0],
        });
        board.watchdog.feed();
        let c1 = board.cycles.cycles();
        if n % 100 == 0 {
            let a = a.unwrap();
            defmt::info!(
                "n {} imu {:02x} enc {} bat {} cur {} stop {} brk {} cyc {}",
                n,
                b,
                counts,
                a.battery,
                a.current,
                stop,
                board.bridges.break_tripped(),
                c1.wrapping_sub(c0)
            );
        }
        n += 1;
    }
}

async fn who(imu: &mut Imu) -> u8 {
    let mut b = [0x75u8 | 0x80, 0];
    let _ = imu.transfer_in_place(&mut b).await;
    defmt::info!("who {:02x}", b[1]);
    for w in [[0x4Eu8, 0x0F], [0x4F, 0x06], [0x50, 0x06]] {
        let _ = imu.write(&w).await;
        Timer::after_micros(300).await;
    }
    b[1]
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let board = Board::take();
    defmt::info!("up, reset by {}", board.reset_cause);
    if let Some(words) = &board.last_words {
        defmt::error!("last words: {=str}", words.as_str());
    }
    board::start_control_executor().spawn(control(board).unwrap());
}
