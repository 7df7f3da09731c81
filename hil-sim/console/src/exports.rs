//! The functions that the page calls.
//!
//! A function that takes bytes takes the bytes that the page has written to [`input`]'s address. A function that returns
//! a length has put that many bytes at [`output`]'s address. Each function says whether the bytes are JSON, text or bytes
//! of the link. Times are in us.
// The functions are exported by name.
#![allow(unsafe_code)]

use std::cell::RefCell;

use model::command::Request;
use serde::Serialize;

use crate::operator_link::OperatorLink;
use crate::page_memory::{input_room, output_start, put, put_json, take_input, take_text};
use crate::parameter_work::{differences, rows};
use crate::recording::mcap;
use crate::replay::PageReplay;
use crate::simulation::{Simulation, default_drive_hash};
use crate::vocabulary::Vocabulary;

thread_local! {
    static BOARD: RefCell<Option<Simulation>> = const { RefCell::new(None) };
    static LINK: RefCell<Option<OperatorLink>> = const { RefCell::new(None) };
    static MCAP: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static REPLAY: RefCell<Option<PageReplay>> = const { RefCell::new(None) };
}

/// Makes room for `length` bytes and returns where the page writes them.
#[unsafe(no_mangle)]
pub extern "C" fn input(length: usize) -> *mut u8 {
    input_room(length)
}

/// Address of the last answer's bytes.
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    output_start()
}

/// The firmware's vocabulary, as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn vocabulary() -> usize {
    put_json(&Vocabulary::new())
}

/// Hash of the trace of the default drive; 0 if the drive failed.
#[unsafe(no_mangle)]
pub extern "C" fn trace_hash() -> u64 {
    default_drive_hash().unwrap_or(0)
}

/// Puts the error, or nothing, into the output.
fn put_error(result: Result<(), String>) -> usize {
    put(result.err().unwrap_or_default().into_bytes())
}

/// Boots a board in the world that the input describes as JSON; the answer is the error, as text.
#[unsafe(no_mangle)]
pub extern "C" fn board_boot() -> usize {
    let world = serde_json::from_slice(&take_input()).map_err(|error| error.to_string());
    // The previous board must be dropped before the next board takes the clock.
    BOARD.set(None);
    put_error(world.and_then(|world| {
        BOARD.set(Some(Simulation::boot(&world)?));
        Ok(())
    }))
}

fn with_board<R: Default>(act: impl FnOnce(&mut Simulation) -> R) -> R {
    BOARD.with_borrow_mut(|board| board.as_mut().map(act).unwrap_or_default())
}

/// Runs the board for some milliseconds; the answer is the board's output, bytes of the link.
#[unsafe(no_mangle)]
pub extern "C" fn board_run(ms: u32) -> usize {
    put(with_board(|board| board.run(ms)))
}

/// Sends the input, bytes of the link, to the board.
#[unsafe(no_mangle)]
pub extern "C" fn board_send() {
    let bytes = take_input();
    with_board(|board| board.send(&bytes));
}

/// Carries out a step of a scenario, given as text without its time; the answer is the error, as text.
#[unsafe(no_mangle)]
pub extern "C" fn board_act() -> usize {
    let step = take_text();
    put_error(with_board(|board| Some(board.act(&step))).unwrap_or_else(|| Err("no board".to_owned())))
}

/// The simulated vehicle's true state, as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn board_look() -> usize {
    put_json(&with_board(|board| Some(board.look())))
}

/// Hash of the board's whole output. For tests.
#[unsafe(no_mangle)]
pub extern "C" fn board_hash() -> u64 {
    with_board(|board| board.hash())
}

fn with_link<R: Default>(act: impl FnOnce(&mut OperatorLink) -> R) -> R {
    LINK.with_borrow_mut(|link| link.as_mut().map(act).unwrap_or_default())
}

/// Begins a conversation with a board; `nonce` is a number that no host has used before on it.
#[unsafe(no_mangle)]
pub extern "C" fn link_begin(nonce: u32) {
    LINK.set(Some(OperatorLink::new(nonce)));
}

/// Lets this host give orders from now on, or only listen (0).
#[unsafe(no_mangle)]
pub extern "C" fn link_operate(operates: u32) {
    with_link(|link| link.operate(operates != 0));
}

/// Takes the input, bytes of the link; the answer is their content, as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn link_receive(now_us: f64) -> usize {
    let bytes = take_input();
    put_json(&with_link(|link| Some(link.receive(now_us as u64, &bytes))))
}

/// Asks every question that is due; the answer is the bytes for the board.
#[unsafe(no_mangle)]
pub extern "C" fn link_poll(now_us: f64) -> usize {
    put(with_link(|link| link.poll(now_us as u64)))
}

/// Commands speed, m/s, and yaw rate, rad/s, positive to the left.
#[unsafe(no_mangle)]
pub extern "C" fn link_drive(now_us: f64, speed_m_s: f32, yaw_rate_rad_s: f32) {
    with_link(|link| link.drive(now_us as u64, speed_m_s, yaw_rate_rad_s));
}

/// Opens the bridges.
#[unsafe(no_mangle)]
pub extern "C" fn link_disarm(now_us: f64) {
    with_link(|link| link.disarm(now_us as u64));
}

/// Arms.
#[unsafe(no_mangle)]
pub extern "C" fn link_arm(now_us: f64) {
    with_link(|link| link.request(now_us as u64, Request::Arm));
}

/// Clears the latched faults.
#[unsafe(no_mangle)]
pub extern "C" fn link_clear_faults(now_us: f64) {
    with_link(|link| link.request(now_us as u64, Request::ClearFaults));
}

/// The parameters in force, as JSON; `null` before they are read.
#[unsafe(no_mangle)]
pub extern "C" fn link_parameters() -> usize {
    put_json(&with_link(|link| link.parameters().map(rows)))
}

/// The parameters in force as the text of a vehicle file.
#[unsafe(no_mangle)]
pub extern "C" fn link_vehicle_file() -> usize {
    let text = with_link(|link| link.parameters().map(vehicle_file::to_toml));
    put(text.unwrap_or_default().into_bytes())
}

/// Changes parameters, a JSON list of number and value, and stores the set; an empty list reads the set again. The answer
/// is the error in the list, as text.
#[unsafe(no_mangle)]
pub extern "C" fn link_change() -> usize {
    let changes: Result<Vec<(u16, f32)>, _> = serde_json::from_slice(&take_input());
    put_error(changes.map_err(|error| error.to_string()).map(|changes| {
        with_link(|link| link.change(&changes));
    }))
}

/// Restores the firmware's built-in set.
#[unsafe(no_mangle)]
pub extern "C" fn link_built_in() {
    with_link(OperatorLink::built_in);
}

/// Differences between a vehicle file and the set in force.
#[derive(Debug, Default, Serialize)]
struct Compared {
    error: Option<String>,
    /// Parameter number, and the file's value.
    differences: Vec<(u16, f32)>,
}

/// Compares a vehicle file's text with the set in force, as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn link_compare() -> usize {
    let text = take_text();
    let compared = with_link(|link| link.parameters().map(|set| differences(set, &text)));
    put_json(&match compared {
        None => Compared {
            error: Some("the board's parameters are not read yet".to_owned()),
            ..Compared::default()
        },
        Some(Err(error)) => Compared {
            error: Some(error),
            ..Compared::default()
        },
        Some(Ok(differences)) => Compared {
            error: None,
            differences,
        },
    })
}

/// Begins a recording, or ends its stream (0).
#[unsafe(no_mangle)]
pub extern "C" fn link_record(now_us: f64, on: u32) {
    with_link(|link| link.record(now_us as u64, on != 0));
}

/// Takes the recording: the bytes of its file of frames.
#[unsafe(no_mangle)]
pub extern "C" fn link_take_recording() -> usize {
    put(with_link(OperatorLink::take_recording))
}

/// Converts a recording to an MCAP file. The input is the text of the vehicle file of the set in force, `vehicle_length`
/// bytes (0: not known), then the frames. The answer is the error, as text; [`mcap_take`] takes the file.
#[unsafe(no_mangle)]
pub extern "C" fn mcap_make(vehicle_length: usize) -> usize {
    let input = take_input();
    let (vehicle, frames) = input.split_at(vehicle_length.min(input.len()));
    put_error(mcap(frames, &String::from_utf8_lossy(vehicle)).map(|file| MCAP.set(file)))
}

/// Takes the MCAP file of the last conversion.
#[unsafe(no_mangle)]
pub extern "C" fn mcap_take() -> usize {
    put(MCAP.take())
}

/// Opens the records of a file. The input is the text of a vehicle file, `vehicle_length` bytes (0: the reference
/// vehicle), then the file. The answer is the error, as text.
#[unsafe(no_mangle)]
pub extern "C" fn replay_open(vehicle_length: usize) -> usize {
    let input = take_input();
    let (vehicle, file) = input.split_at(vehicle_length.min(input.len()));
    let opened = PageReplay::open(file, &String::from_utf8_lossy(vehicle));
    put_error(opened.map(|opened| REPLAY.set(Some(opened))))
}

/// Replays up to `ticks` further ticks; the answer is their statuses, as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn replay_step(ticks: usize) -> usize {
    put_json(&REPLAY.with_borrow_mut(|replay| replay.as_mut().map(|replay| replay.step(ticks))))
}
