//! A serial line between the host's link client and the virtual board's UART.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::future::poll_fn;
use std::rc::Rc;
use std::task::{Poll, Waker};

use embedded_io_async::{ErrorType, Read, Write};

/// One direction of the line.
#[derive(Debug, Default)]
struct Bytes {
    queue: VecDeque<u8>,
    reader: Option<Waker>,
}

/// One direction of a serial line. Clones are ends of the same line.
#[derive(Debug, Clone, Default)]
pub struct Pipe(Rc<RefCell<Bytes>>);

impl Pipe {
    /// Puts bytes on the line.
    pub fn put(&self, bytes: &[u8]) {
        let mut line = self.0.borrow_mut();
        line.queue.extend(bytes);
        if let Some(reader) = line.reader.take() {
            reader.wake();
        }
    }

    /// Takes all bytes off the line.
    #[inline]
    pub fn take_all(&self) -> Vec<u8> {
        if self.0.borrow().queue.is_empty() {
            // The usual case.
            return Vec::new();
        }
        self.take_bytes()
    }

    #[inline(never)]
    fn take_bytes(&self) -> Vec<u8> {
        std::mem::take(&mut self.0.borrow_mut().queue).into()
    }
}

impl ErrorType for Pipe {
    type Error = Infallible;
}

impl Read for Pipe {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        poll_fn(|context| {
            let mut line = self.0.borrow_mut();
            if line.queue.is_empty() {
                line.reader = Some(context.waker().clone());
                return Poll::Pending;
            }
            let length = buffer.len().min(line.queue.len());
            for (slot, byte) in buffer.iter_mut().zip(&line.queue) {
                *slot = *byte;
            }
            line.queue.drain(..length);
            Poll::Ready(Ok(length))
        })
        .await
    }
}

impl Write for Pipe {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.put(bytes);
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
