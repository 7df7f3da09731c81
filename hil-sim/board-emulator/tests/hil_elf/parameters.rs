//! Stored parameters on the emulated flash: they survive resets, and after a power cut the set is the old or the new one.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use board_emulator::run::{Emulation, EmulationSettings};
use board_emulator::time::{MS, US};
use board_emulator::vehicle::BenchVehicle;
use board_emulator::vehicle::stored::REGION;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use firmware::built_in;
use firmware::drive_board::{FLASH_SECTOR_BYTES, FLASH_WORD_BYTES, PARAMETER_SECTORS};
use firmware::parameters::ParameterStore;
use firmware::protocol::message::{Answer, Order, ParameterAnswer, ParameterRequest};
use model::vehicle::{Vehicle, VehicleParameters};

use crate::support::{BATTERY_V, Operator, STARTED_MS, firmware, noise, powered, ready};

const REGION_BYTES: usize = PARAMETER_SECTORS * FLASH_SECTOR_BYTES;
/// Largest number of boots from the states that power cuts of one store leave.
const BOOTS_MAX: usize = 50;
/// The parameter that the tests change: its number, and two values in its range.
const NUMBER: u16 = 0;
const OLD: f32 = 0.26;
const NEW: f32 = 0.27;

/// A board that was powered up with these bytes in the store's flash.
fn powered_with(region: &[u8]) -> Operator {
    let plant = Box::new(BenchVehicle::new(BATTERY_V));
    let contents = [(REGION, region.to_vec())];
    let board = Emulation::power_on_with(firmware(), plant, EmulationSettings::default(), &contents);
    Operator::new(board.expect("the board powers up"))
}

fn region(board: &mut Operator) -> Vec<u8> {
    let bytes = board.emulation.at(|stopped| stopped.read_block(REGION, REGION_BYTES));
    bytes.expect("it runs").expect("it is memory")
}

fn read(board: &mut Operator) -> f32 {
    match board.ask(ParameterRequest::Read { number: NUMBER }) {
        ParameterAnswer::Value { value, .. } => value,
        other => panic!("{other:?}"),
    }
}

fn write(board: &mut Operator, value: f32) {
    let answer = board.ask(ParameterRequest::Write { number: NUMBER, value });
    assert!(
        matches!(answer, ParameterAnswer::Value { value: told, .. } if told == value),
        "{answer:?}"
    );
}

fn log_has(board: &mut Operator, text: &str) -> bool {
    // Compared with the end of a line, because one message may be the beginning of another.
    board.log().iter().any(|line| line.ends_with(text))
}

#[test]
fn a_stored_set_is_kept_over_resets_and_power_cycles() {
    let mut board = ready();
    assert!(log_has(&mut board, "parameters: nothing stored, built-in set"));
    let built_in = built_in::PARAMETERS.value(NUMBER).expect("the number is a parameter's");
    assert_eq!(read(&mut board), built_in);
    write(&mut board, NEW);
    assert_eq!(board.ask(ParameterRequest::Store), ParameterAnswer::Stored);

    board.emulation.at(|stopped| stopped.reset_by_pin()).expect("it runs");
    board.run(STARTED_MS);
    assert!(log_has(&mut board, "reset by reset pin"));
    assert!(log_has(&mut board, "parameters: stored set"));
    assert_eq!(read(&mut board), NEW);

    let mut cycled = powered_with(&region(&mut board));
    cycled.run(STARTED_MS);
    assert_eq!(read(&mut cycled), NEW);
    assert_eq!(cycled.ask(ParameterRequest::BuiltIn), ParameterAnswer::BuiltInReady);
    assert_eq!(cycled.ask(ParameterRequest::Store), ParameterAnswer::Stored);
    let mut back = powered_with(&region(&mut cycled));
    back.run(STARTED_MS);
    assert_eq!(read(&mut back), built_in);
}

#[test]
fn nothing_is_stored_out_of_range_or_while_armed() {
    let mut board = ready();
    let answer = board.ask(ParameterRequest::Write {
        number: NUMBER,
        value: 1e9,
    });
    assert!(matches!(answer, ParameterAnswer::OutOfRange { .. }), "{answer:?}");
    let answer = board.ask(ParameterRequest::Write {
        number: u16::MAX,
        value: 1.0,
    });
    assert_eq!(answer, ParameterAnswer::NoSuchNumber);
    board.arm();
    write(&mut board, NEW);
    assert_eq!(board.ask(ParameterRequest::Store), ParameterAnswer::Armed);
    assert!(
        region(&mut board).iter().all(|byte| *byte == 0xFF),
        "the flash has changed"
    );
}

#[test]
fn random_bytes_boot_to_the_built_in_set() {
    let mut board = powered_with(&noise(REGION_BYTES, 0x9E37_79B9_7F4A_7C15));
    board.run(700);
    let log = board.log();
    assert!(log.iter().any(|line| line.contains("built-in set")), "{log:#?}");
    assert!(log.iter().any(|line| line.contains("self-check done")), "{log:#?}");
    assert_eq!(Some(read(&mut board)), built_in::PARAMETERS.value(NUMBER));
    let resets = board.emulation.at(|stopped| stopped.resets()).expect("it runs");
    assert_eq!(resets, []);
}

/// Power is cut at every step of storing over an old set, and of storing into a full sector, which moves the
/// store to the other sector.
#[test]
fn a_power_cut_leaves_the_old_or_the_new_set() {
    for start in [used(), full()] {
        let mut board = powered_with(&start);
        board.run(700);
        assert_eq!(read(&mut board), OLD);
        write(&mut board, NEW);
        let store = board.order(Order::Parameters(ParameterRequest::Store));
        let (states, cuts) = states_of(&mut board, store.expect("identified"));
        assert!(cuts >= 50, "{cuts}");
        assert!(states.len() >= 4, "{} different states", states.len());
        let mut seen = BTreeMap::new();
        // Boots take time: from many states the test boots only some, and the last.
        let every = states.len().div_ceil(BOOTS_MAX);
        for state in states.iter().rev().step_by(every) {
            let mut cut = powered_with(state);
            cut.run(STARTED_MS);
            let value = read(&mut cut);
            assert!(value == OLD || value == NEW, "{value}");
            *seen.entry(value.to_bits()).or_insert(0) += 1;
            let resets = cut.emulation.at(|stopped| stopped.resets()).expect("it runs");
            assert_eq!(resets, []);
        }
        println!("{cuts} cuts, {} different states, by value: {seen:?}", states.len());
        assert_eq!(seen.len(), 2, "only old or only new sets are among the states");
        // After the last cut, parameters can still be stored.
        let mut after = powered_with(states.last().expect("a state"));
        after.run(STARTED_MS);
        write(&mut after, OLD);
        assert_eq!(after.ask(ParameterRequest::Store), ParameterAnswer::Stored);
    }
}

/// Runs until the board answers the order `store`, and cuts power at each step: fine ones while the flash changes,
/// coarse ones while it does not. Returns the different flash contents that the cuts leave, torn words included, and
/// the number of cuts.
fn states_of(board: &mut Operator, store: u32) -> (Vec<Vec<u8>>, usize) {
    let mut states = vec![region(board)];
    let mut cuts = 0;
    let start = board.emulation.now();
    let mut quiet = 0;
    let answer = loop {
        if let Some(answer) = board.client.answer_to(store) {
            break answer;
        }
        // The board searches the flash before it writes and after it, and an erase takes a second.
        let step = if quiet < 60 { 100 * US } else { 2 * MS };
        board.emulation.run_for(step).expect("it runs");
        assert!(board.emulation.now() < start + 8_000 * MS, "no answer");
        board.listen();
        cuts += 1;
        quiet += 1;
        let state = region(board);
        let before = states.last().expect("one at least");
        if state != *before {
            quiet = 0;
            states.push(torn(before, &state));
            states.push(state);
            cuts += 1;
        }
    };
    println!("the store takes {} ms", (board.emulation.now() - start) / MS);
    assert_eq!(answer, Answer::Parameters(ParameterAnswer::Stored));
    (states, cuts)
}

/// The flash after a cut in the middle of a change: each changed word has some old and some new bytes.
fn torn(before: &[u8], after: &[u8]) -> Vec<u8> {
    let mut torn = after.to_vec();
    for (n, (byte, old)) in torn.iter_mut().zip(before).enumerate() {
        // Half of the bytes, in a pattern unrelated to any field's boundaries.
        if (n * 7 + n / FLASH_WORD_BYTES * 3) % 16 < 8 {
            *byte = *old;
        }
    }
    torn
}

/// A flash in the host's memory.
#[derive(Clone)]
struct HostFlash {
    bytes: Rc<RefCell<Vec<u8>>>,
    erases: Rc<RefCell<u32>>,
}

impl ErrorType for HostFlash {
    type Error = Infallible;
}

impl ReadNorFlash for HostFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
        bytes.copy_from_slice(&self.bytes.borrow()[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        REGION_BYTES
    }
}

impl NorFlash for HostFlash {
    const WRITE_SIZE: usize = FLASH_WORD_BYTES;
    const ERASE_SIZE: usize = FLASH_SECTOR_BYTES;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
        *self.erases.borrow_mut() += 1;
        self.bytes.borrow_mut()[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
        for (to, from) in self.bytes.borrow_mut()[offset as usize..].iter_mut().zip(bytes) {
            *to &= from;
        }
        Ok(())
    }
}

/// Stores sets on the host until `enough`, given the numbers of earlier stores and of erases, holds; returns the
/// flash as it was before the last store.
fn stored_until(enough: impl Fn(u32, u32) -> bool) -> Vec<u8> {
    let flash = HostFlash {
        bytes: Rc::new(RefCell::new(vec![0xFF; REGION_BYTES])),
        erases: Rc::new(RefCell::new(0)),
    };
    let Ok(mut store) = ParameterStore::new(flash.clone()) else {
        panic!("two sectors are enough");
    };
    let mut parameters: VehicleParameters<f32> = built_in::PARAMETERS;
    parameters.set(NUMBER, OLD).expect("in range");
    let vehicle = Vehicle::new(parameters).expect("consistent");
    for stores in 0.. {
        let before = flash.bytes.borrow().clone();
        match pin!(store.store(&vehicle)).poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(Ok(())) => {}
            _ => panic!("the host's flash neither waits nor fails"),
        }
        if enough(stores, *flash.erases.borrow()) {
            return before;
        }
    }
    unreachable!("the flash fills up")
}

/// A store that holds the old set.
fn used() -> Vec<u8> {
    stored_until(|stores, _| stores == 1)
}

/// A store whose sector has no room for another set.
fn full() -> Vec<u8> {
    stored_until(|_, erases| erases > 0)
}

#[test]
fn the_hosts_flash_holds_what_the_board_reads() {
    let mut board = powered_with(&full());
    board.run(STARTED_MS);
    assert!(log_has(&mut board, "parameters: stored set"));
    assert_eq!(read(&mut board), OLD);
    assert_eq!(powered().now() % MS, 0);
}
