//! An image over the link into the part's flash: the board stores and checks it while the control loop keeps running, and refuses
//! it while armed.

use board_emulator::time::MS;
use board_emulator::vehicle::stored::REGION;
use firmware::drive_board::{BOARD, FLASH_SECTOR_BYTES, HISTORY_SECTORS, PARAMETER_SECTORS};
use firmware::image::Image;
use firmware::image_seal::ERASED;
use firmware::protocol::message::{
    Answer, Order, ParameterAnswer, ParameterRequest, UPDATE_BYTES, UpdateAnswer, UpdateRefusal, UpdateRequest,
};
use hil_sim::cli::link::update::Update;
use model::command::Request;
use model::supervise::arming::Mode;
use model::supervise::codes::Blocker;

use crate::support::{Operator, firmware, ready};

/// Where the image arrives: the start of bank 2.
pub const PLACE: u64 = 0x0810_0000;
/// Fault history and parameters, which must not change.
pub const STORES: u64 = REGION - (HISTORY_SECTORS * FLASH_SECTOR_BYTES) as u64;
pub const STORES_BYTES: usize = (HISTORY_SECTORS + PARAMETER_SECTORS) * FLASH_SECTOR_BYTES;

/// The image of the firmware under test, and its bytes.
pub fn image() -> (Image, Vec<u8>) {
    let update = Update::read(firmware().path()).expect("it is sealed");
    (update.image(), update.bytes().to_vec())
}

/// Gives an order of the update, and runs on until the answer has come.
pub fn ask(board: &mut Operator, request: UpdateRequest) -> UpdateAnswer {
    let sequence = board.order(Order::Update(request)).expect("identified");
    for _ in 0..4000 {
        board.emulation.run_for(2 * MS).expect("it runs");
        board.listen();
        match board.client.answer_to(sequence) {
            Some(Answer::Update(answer)) => return answer,
            Some(other) => panic!("{other:?}"),
            None => {}
        }
    }
    panic!("no answer");
}

/// The piece of an image that begins at `at`.
pub fn piece(bytes: &[u8], at: usize) -> UpdateRequest {
    UpdateRequest::piece(bytes, at as u32).expect("within the image")
}

pub fn flash(board: &mut Operator, from: u64, length: usize) -> Vec<u8> {
    let read = board.emulation.at(move |stopped| stopped.read_block(from, length));
    read.expect("it runs").expect("it is memory")
}

/// The firmware stores its own image. Meanwhile no tick is late and the vehicle does not arm; parameters and fault history stay.
#[test]
fn an_image_is_stored_and_checked_while_the_control_loop_runs_on() {
    let (announced, bytes) = image();
    assert_eq!(announced.board, BOARD);
    let mut board = ready();
    board.run(50);
    let changed = board.ask(ParameterRequest::Write { number: 0, value: 0.27 });
    assert!(matches!(changed, ParameterAnswer::Value { .. }), "{changed:?}");
    assert_eq!(board.ask(ParameterRequest::Store), ParameterAnswer::Stored);
    let before = flash(&mut board, STORES, STORES_BYTES);
    let late = board.status().vehicle.late_ticks;

    assert_eq!(
        ask(&mut board, UpdateRequest::Begin(announced)),
        UpdateAnswer::Ready { next: 0 }
    );
    board.command = Some((0.0, 0.0));
    board.request(Request::Arm);
    assert_eq!(board.status().vehicle.mode, Mode::Disarmed);
    assert!(board.status().vehicle.blockers.contains(Blocker::Update));
    for at in (0..bytes.len()).step_by(UPDATE_BYTES) {
        let next = (at + UPDATE_BYTES).min(bytes.len()) as u32;
        assert_eq!(ask(&mut board, piece(&bytes, at)), UpdateAnswer::Ready { next });
    }
    assert_eq!(board.status().vehicle.late_ticks, late);
    let whole = bytes.len() & !3;
    assert!(
        flash(&mut board, PLACE, whole) == bytes[..whole],
        "the flash does not hold the image as it was sent"
    );
    assert!(
        flash(&mut board, STORES, STORES_BYTES) == before,
        "parameters and faults"
    );
    assert_eq!(ask(&mut board, UpdateRequest::Install), UpdateAnswer::Restarting);
    assert_eq!(board.status().vehicle.late_ticks, late);
    assert!(
        board.status().vehicle.blockers.contains(Blocker::Update),
        "the update stops blocking before the restart"
    );
    let resets = board.emulation.at(|stopped| stopped.resets()).expect("it runs");
    assert_eq!(resets, []);
}

#[test]
fn nothing_is_stored_while_armed() {
    let (announced, bytes) = image();
    let mut board = ready();
    board.arm();
    for request in [
        UpdateRequest::Begin(announced),
        piece(&bytes, 0),
        UpdateRequest::Install,
    ] {
        board.run(50);
        assert_eq!(
            ask(&mut board, request),
            UpdateAnswer::Refused(UpdateRefusal::NotDisarmed)
        );
    }
    board.run(50);
    assert_eq!(board.status().vehicle.mode, Mode::Armed);
    assert!(flash(&mut board, PLACE, 4096).iter().all(|byte| *byte == ERASED));
}

/// The board refuses to install a stored image that is not the announced one.
#[test]
fn a_stored_image_that_is_not_the_announced_one_is_refused() {
    let (announced, bytes) = image();
    let short = Image {
        length: 2 * UPDATE_BYTES as u32 + 1024,
        ..announced
    };
    let mut board = ready();
    board.run(50);
    let foreign = Image {
        board: 767,
        ..announced
    };
    let refused = UpdateAnswer::Refused(UpdateRefusal::WrongBoard { board: BOARD });
    assert_eq!(ask(&mut board, UpdateRequest::Begin(foreign)), refused);
    assert_eq!(
        ask(&mut board, UpdateRequest::Begin(short)),
        UpdateAnswer::Ready { next: 0 }
    );
    for at in (0..short.length as usize).step_by(UPDATE_BYTES) {
        ask(&mut board, piece(&bytes, at));
    }
    let refused = UpdateAnswer::Refused(UpdateRefusal::WrongChecksum);
    assert_eq!(ask(&mut board, UpdateRequest::Install), refused);
}
