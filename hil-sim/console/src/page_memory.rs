//! What page and module hand to each other: bytes in, bytes out.

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

/// Takes what the page has written.
pub fn take_input() -> Vec<u8> {
    INPUT.with_borrow_mut(std::mem::take)
}

/// Takes what the page has written, as text; what is no text is shown as such.
pub fn take_text() -> String {
    String::from_utf8_lossy(&take_input()).into_owned()
}

/// Where the output begins.
pub fn output_start() -> *const u8 {
    OUTPUT.with_borrow(Vec::as_ptr)
}

/// Hands `bytes` to the page and returns how many there are.
pub fn put(bytes: Vec<u8>) -> usize {
    OUTPUT.with_borrow_mut(|output| {
        *output = bytes;
        output.len()
    })
}

/// Hands a value to the page as JSON and returns the number of bytes.
pub fn put_json(value: &impl Serialize) -> usize {
    // Every value here is of numbers, names and lists, which JSON has.
    put(serde_json::to_vec(value).unwrap_or_default())
}
