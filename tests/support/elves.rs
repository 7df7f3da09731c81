//! Sealed ELFs whose bytes are no firmware: no part could run them.
#![allow(dead_code)] // Each test binary uses part of it.

use firmware::drive_board::IMAGE_START;
use firmware::image_seal::{
    BOARD_AT, BUILD_AT, DTCM_START, ERASED, MARKER, NUMBERS_AT, SEAL_AT, SEAL_BYTES, STACK_BYTES, VERSION_AT,
};
use hil_elf::seal::seal;

/// A sealed ELF for a board, with an image of `length` bytes.
pub fn elf(board: u16, length: usize) -> Vec<u8> {
    linked(board, length, IMAGE_START, IMAGE_START)
}

/// The same, whose ELF places the image at `start`, and whose first instruction lies behind `code`.
pub fn linked(board: u16, length: usize, start: u32, code: u32) -> Vec<u8> {
    let mut image: Vec<u8> = (0..length).map(|at| ((at * at) >> 3) as u8).collect();
    image[..4].copy_from_slice(&(DTCM_START + STACK_BYTES).to_le_bytes());
    image[4..8].copy_from_slice(&(code + 0x441).to_le_bytes());
    let seal_bytes = &mut image[SEAL_AT..SEAL_AT + SEAL_BYTES];
    seal_bytes.fill(0);
    for (to, part) in seal_bytes.chunks_exact_mut(4).zip(MARKER) {
        to.copy_from_slice(&part.to_le_bytes());
    }
    seal_bytes[NUMBERS_AT..NUMBERS_AT + 8].fill(ERASED);
    seal_bytes[BUILD_AT] = 7;
    seal_bytes[VERSION_AT] = 1;
    seal_bytes[BOARD_AT..BOARD_AT + 2].copy_from_slice(&board.to_le_bytes());
    // Header and one program header of a 32-bit ELF.
    let mut elf = vec![0; 52 + 32];
    elf[..6].copy_from_slice(&[0x7F, b'E', b'L', b'F', 1, 1]);
    elf[28] = 52;
    elf[42] = 32;
    elf[44] = 1;
    for (at, value) in [(0, 1), (4, 84), (12, start), (16, length as u32)] {
        elf[52 + at..52 + at + 4].copy_from_slice(&value.to_le_bytes());
    }
    elf.extend(image);
    seal(&mut elf).expect("an ELF with a seal");
    elf
}
