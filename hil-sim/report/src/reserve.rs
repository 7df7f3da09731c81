//! Room that is kept on a disk, so that what completes a file has a place when the disk is full.

use std::io::{self, ErrorKind, Write};

/// An output with a reserve on its disk. When the disk is full, the reserve is given up and its room serves the writes that
/// follow. The owner, whom [`ReservedOutput::take_full`] tells of it, then completes the file and ends.
#[derive(Debug)]
pub struct ReservedOutput<W, R> {
    out: W,
    /// What keeps the room while it exists.
    reserve: Option<R>,
    /// The error that took the reserve, until it is reported.
    full: Option<io::Error>,
}

impl<W: Write, R> ReservedOutput<W, R> {
    /// The output `out` with this reserve, if there is room for one.
    pub fn new(out: W, reserve: Option<R>) -> Self {
        Self {
            out,
            reserve,
            full: None,
        }
    }

    /// The error of the full disk that has taken the reserve: once.
    pub fn take_full(&mut self) -> Option<io::Error> {
        self.full.take()
    }

    /// The output itself.
    pub fn get_ref(&self) -> &W {
        &self.out
    }

    /// Does `write`, a second time if the reserve gives it the room that it lacks.
    fn with_room<T>(&mut self, write: impl Fn(&mut W) -> io::Result<T>) -> io::Result<T> {
        match write(&mut self.out) {
            Err(error) if is_full(&error) && self.reserve.take().is_some() => {
                self.full = Some(error);
                write(&mut self.out)
            }
            written => written,
        }
    }
}

/// Whether another file's room would help.
fn is_full(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded)
}

impl<W: Write, R> Write for ReservedOutput<W, R> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.with_room(|out| out.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.with_room(W::flush)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;
    use std::io::BufWriter;
    use std::rc::Rc;

    /// A disk with room for so many bytes.
    type Disk = Rc<Cell<usize>>;

    #[derive(Default)]
    struct FileOnDisk(Disk, Vec<u8>);

    impl Write for FileOnDisk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let taken = bytes.len().min(self.0.get());
            if taken == 0 && !bytes.is_empty() {
                return Err(ErrorKind::StorageFull.into());
            }
            self.0.set(self.0.get() - taken);
            self.1.extend_from_slice(&bytes[..taken]);
            Ok(taken)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Bytes that are free again once it is dropped.
    struct Kept(Disk, usize);

    impl Drop for Kept {
        fn drop(&mut self) {
            self.0.set(self.0.get() + self.1);
        }
    }

    #[test]
    fn a_full_disk_takes_what_the_reserve_has_room_for_and_says_so_once() {
        let disk = Disk::new(Cell::new(100));
        let file = BufWriter::with_capacity(16, FileOnDisk(disk.clone(), Vec::new()));
        let mut out = ReservedOutput::new(file, Some(Kept(disk.clone(), 50)));
        let bytes: Vec<u8> = (0..150).collect();
        for part in bytes.chunks(30) {
            out.write_all(part).expect("there is room, with the reserve");
        }
        out.flush().expect("there is room, with the reserve");
        assert_eq!(out.get_ref().get_ref().1, bytes);
        assert_eq!(disk.get(), 0);
        assert_eq!(out.take_full().expect("full").kind(), ErrorKind::StorageFull);
        assert!(out.take_full().is_none());
        // There is no second reserve.
        let more = out.write_all(&[0; 20]).and_then(|()| out.flush());
        assert_eq!(more.expect_err("full").kind(), ErrorKind::StorageFull);
    }

    #[test]
    fn another_error_keeps_the_reserve() {
        struct Broken;
        impl Write for Broken {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(ErrorKind::PermissionDenied.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let disk = Disk::new(Cell::new(0));
        let mut out = ReservedOutput::new(Broken, Some(Kept(disk.clone(), 50)));
        assert_eq!(out.write(&[1]).expect_err("broken").kind(), ErrorKind::PermissionDenied);
        assert_eq!(disk.get(), 0);
    }
}
