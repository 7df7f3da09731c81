//! Memory through which page and module exchange bytes.

use std::cell::RefCell;

use serde::Serialize;

thread_local! {
    static INPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static OUTPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// Makes room for `length` bytes of input and returns where the page writes them.
pub fn input_room(length: usize) -> *mut u8 {
    INPUT.with_borrow_mut(|input| {
        input.clear();
        input.resize(length, 0);
        input.as_mut_ptr()
    })
}

/// Takes the bytes that the page has written.
pub fn take_input() -> Vec<u8> {
    INPUT.with_borrow_mut(std::mem::take)
}

/// Takes the bytes that the page has written, as text. Invalid bytes become replacement
/// characters.
pub fn take_text() -> String {
    String::from_utf8_lossy(&take_input()).into_owned()
}

/// Address of the output.
pub fn output_start() -> *const u8 {
    OUTPUT.with_borrow(Vec::as_ptr)
}

/// Passes `bytes` to the page and returns their number.
pub fn put(bytes: Vec<u8>) -> usize {
    OUTPUT.with_borrow_mut(|output| {
        *output = bytes;
        output.len()
    })
}

/// Passes a value to the page as JSON and returns the number of bytes.
pub fn put_json(value: &impl Serialize) -> usize {
    // Every value here consists of numbers, names and lists, which JSON can represent.
    put(serde_json::to_vec(value).unwrap_or_default())
}
