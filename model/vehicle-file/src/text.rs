//! Reads regular files of bounded size, whatever a command's path leads to.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

use crate::place::TextPlace;

/// Largest file that is read, in bytes. A vehicle file has about 3000 bytes, a scenario rarely more.
pub const TEXT_MAX_BYTES: u64 = 1 << 20;

/// Opens the regular file at `path`.
///
/// Refuses devices and pipes before it opens them: reading a device may never end, and opening a pipe
/// waits for its writer.
///
/// # Errors
/// The file cannot be opened, or is not a regular one.
pub fn open_file(path: &Path) -> io::Result<File> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(io::Error::other("not a regular file"));
    }
    File::open(path)
}

/// Reads the regular file at `path`, which must be at most `most_bytes` long.
///
/// # Errors
/// The reason, without the file's name.
pub fn read_bytes(path: &Path, most_bytes: u64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    // One byte more than allowed: a file that grows meanwhile is refused like a file that is too
    // long.
    open_file(path)
        .and_then(|file| file.take(most_bytes + 1).read_to_end(&mut bytes))
        .map_err(|error| error.to_string())?;
    if bytes.len() as u64 > most_bytes {
        let length = std::fs::metadata(path).map_or(bytes.len() as u64, |metadata| metadata.len());
        return Err(format!("its length is {length} bytes: allowed is 0 to {most_bytes}"));
    }
    Ok(bytes)
}

/// Reads the regular file at `path`, which must be UTF-8 and at most [`TEXT_MAX_BYTES`] long.
///
/// # Errors
/// The reason, without the file's name.
pub fn read_text(path: &Path) -> Result<String, String> {
    String::from_utf8(read_bytes(path, TEXT_MAX_BYTES)?).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let byte = error.as_bytes().get(good).copied().unwrap_or_default();
        let before = String::from_utf8_lossy(&error.as_bytes()[..good]);
        let place = TextPlace::of(&before, good);
        format!("not a text in UTF-8: byte 0x{byte:02X} ({place}); save it as UTF-8")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(name: &str, length: usize) -> std::path::PathBuf {
        let path = std::env::temp_dir().join(format!("vehicle-file-{}-{name}", std::process::id()));
        std::fs::write(&path, vec![b'#'; length]).expect("writes");
        path
    }

    #[test]
    fn the_longest_allowed_file_is_read_and_one_byte_more_refused() {
        let limit = TEXT_MAX_BYTES as usize;
        let (fits, long) = (file("fits", limit), file("long", limit + 1));
        assert_eq!(read_text(&fits).map(|text| text.len()), Ok(limit));
        let message = read_text(&long).expect_err("too long");
        assert_eq!(message, "its length is 1048577 bytes: allowed is 0 to 1048576");
        for path in [fits, long] {
            std::fs::remove_file(path).expect("removes");
        }
    }

    #[test]
    fn only_regular_files_of_text_are_read() {
        assert_eq!(read_text(&std::env::temp_dir()), Err("not a regular file".to_owned()));
        #[cfg(unix)]
        assert_eq!(read_text(Path::new("/dev/zero")), Err("not a regular file".to_owned()));
        let path = file("binary", 0);
        std::fs::write(&path, [0xFF, 0xFE]).expect("writes");
        assert!(read_text(&path).expect_err("no text").contains("UTF-8"));
        std::fs::remove_file(path).expect("removes");
    }
}
