//! Files that appear whole or not at all, and recordings, which keep everything that was written.
//!
//! A [`NewFile`] is written under a temporary name in the same directory and takes its name when it is complete. A
//! full disk or a crash therefore never leaves half a file under that name, and a link of that name is replaced, not
//! followed. A [`GrowingFile`] has its name from the start: whatever a killed program, a full disk or a pulled cable
//! left of it stays. It keeps room on its disk for its end.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::CommandError;
use crate::reserve::ReservedOutput;

/// A file that is being written.
#[derive(Debug)]
pub struct NewFile {
    part: BufWriter<NamedTempFile>,
    path: PathBuf,
    /// The flag that names the file, for messages.
    flag: &'static str,
    /// Whether the file may replace another file.
    replaces: bool,
}

impl NewFile {
    /// Begins the file `path`, which replaces a file of this name. `flag` names it on the command line.
    ///
    /// # Errors
    /// [`CommandError::Input`] with flag and file, if the directory cannot be written.
    pub fn replace(flag: &'static str, path: &Path) -> Result<Self, CommandError> {
        Self::begin(flag, path, true)
    }

    /// Begins the file `path`, which must not exist. `flag` names it on the command line.
    ///
    /// # Errors
    /// As [`NewFile::replace`], and if the file already exists.
    pub fn create(flag: &'static str, path: &Path) -> Result<Self, CommandError> {
        refuse_existing(flag, path)?;
        Self::begin(flag, path, false)
    }

    fn begin(flag: &'static str, path: &Path, replaces: bool) -> Result<Self, CommandError> {
        let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        let mut builder = tempfile::Builder::new();
        builder.prefix(".part-");
        // The mode of any new file. The process's umask removes the bits that it does not allow.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let part = builder
            .tempfile_in(directory.unwrap_or(Path::new(".")))
            .map_err(|error| not_written(flag, path, &error))?;
        Ok(Self {
            part: BufWriter::new(part),
            path: path.to_owned(),
            flag,
            replaces,
        })
    }

    /// Gives the complete file its name.
    ///
    /// # Errors
    /// [`CommandError::Input`] with the file's name, if the disk is full, or if a directory or a file that must not be
    /// replaced has this name.
    pub fn finish(self) -> Result<PathBuf, CommandError> {
        let Self {
            part,
            path,
            flag,
            replaces,
        } = self;
        let wrong = |error: &std::io::Error| not_written(flag, &path, error);
        let part = part.into_inner().map_err(|error| wrong(error.error()))?;
        if replaces {
            part.persist(&path).map_err(|error| wrong(&error.error))?;
        } else {
            part.persist_noclobber(&path).map_err(|error| wrong(&error.error))?;
        }
        Ok(path)
    }
}

/// Every error names flag and file, whoever prints it.
impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = self.part.write(bytes);
        written.map_err(|error| named(error.kind(), not_written(self.flag, &self.path, &error)))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        let flushed = self.part.flush();
        flushed.map_err(|error| named(error.kind(), not_written(self.flag, &self.path, &error)))
    }
}

fn named(kind: ErrorKind, told: CommandError) -> std::io::Error {
    std::io::Error::new(kind, told)
}

/// Room that a growing file keeps on its disk, bytes: for the last half second of a record at 200 bytes a tick, with the two
/// seconds that a board still has at its beginning, and for the index of more than an hour of such half seconds at some 150 bytes.
const RESERVE_BYTES: usize = 2 << 20;

/// A file that grows under its own name and keeps everything that was written, whatever ends the program.
///
/// It keeps room on its disk. Once the disk is full, the next flush returns that error, and the reserved room takes the
/// end of the file.
#[derive(Debug)]
pub struct GrowingFile {
    part: ReservedOutput<BufWriter<File>, File>,
    path: PathBuf,
    /// The flag that names the file, for messages.
    flag: &'static str,
    /// What to do with a file that could not be completed, for messages.
    if_cut: &'static str,
    complete: bool,
}

/// A file without a name beside `path` that occupies the reserve, and vanishes with the program; `None` without so much room.
/// A file system that compresses keeps no room by it: a full disk then cuts the file off.
fn reserve_beside(path: &Path) -> Option<File> {
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let mut reserve = tempfile::tempfile_in(directory.unwrap_or(Path::new("."))).ok()?;
    reserve.write_all(&vec![0; RESERVE_BYTES]).ok()?;
    Some(reserve)
}

impl GrowingFile {
    /// Begins the file `path`, which must not exist. `flag` names it on the command line.
    ///
    /// # Errors
    /// [`CommandError::Input`] with flag and file, if the file already exists or cannot be written.
    pub fn create(flag: &'static str, path: &Path) -> Result<Self, CommandError> {
        let file = File::create_new(path).map_err(|error| not_written(flag, path, &error))?;
        Ok(Self {
            part: ReservedOutput::new(BufWriter::new(file), reserve_beside(path)),
            path: path.to_owned(),
            flag,
            if_cut: "",
            complete: false,
        })
    }

    /// The file whose messages say so if it could not be completed.
    #[must_use]
    pub fn if_cut(mut self, if_cut: &'static str) -> Self {
        self.if_cut = if_cut;
        self
    }

    /// Writes the file's content through to the disk; returns the file's name.
    ///
    /// # Errors
    /// [`CommandError::Other`] with flag and file, if the disk is full. Everything written before stays.
    pub fn finish(mut self) -> Result<PathBuf, CommandError> {
        self.sync()?;
        self.complete = true;
        Ok(self.path.clone())
    }

    /// Abandons the file: writes its content through to the disk. An empty file is removed.
    ///
    /// # Errors
    /// As [`GrowingFile::finish`].
    pub fn give_up(mut self) -> Result<(), CommandError> {
        self.sync()
    }

    fn sync(&mut self) -> Result<(), CommandError> {
        let synced = { self.part.flush() }.and_then(|()| self.part.get_ref().get_ref().sync_all());
        synced.map_err(|error| self.cut(&error))
    }

    /// The message about a disk that is full; there is still room to complete the file.
    fn full(&self, error: &std::io::Error) -> CommandError {
        let (flag, path) = (self.flag, self.path.display());
        CommandError::Other(format!(
            "{flag}: {path}: {error}; what it has taken until then stays in it"
        ))
    }

    /// The message about a file that cannot be completed.
    fn cut(&self, error: &std::io::Error) -> CommandError {
        let full = self.full(error);
        match self.if_cut {
            "" => full,
            what => CommandError::Other(format!("{full}; {what}")),
        }
    }
}

/// Every error names flag and file, whoever prints it.
impl Write for GrowingFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let written = self.part.write(bytes);
        written.map_err(|error| named(error.kind(), self.cut(&error)))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        let flushed = self.part.flush();
        flushed.map_err(|error| named(error.kind(), self.cut(&error)))?;
        match self.part.take_full() {
            Some(error) => Err(named(error.kind(), self.full(&error))),
            None => Ok(()),
        }
    }
}

/// Dropping an empty file removes it, so that the user can repeat the command.
impl Drop for GrowingFile {
    fn drop(&mut self) {
        if self.complete {
            return;
        }
        let _ = self.part.flush();
        if self
            .part
            .get_ref()
            .get_ref()
            .metadata()
            .is_ok_and(|file| file.len() == 0)
        {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Writes the whole file `path` of the flag `flag`; replaces a file of this name.
///
/// # Errors
/// [`CommandError::Input`] with flag and file.
pub fn write_whole(flag: &'static str, path: &Path, bytes: &[u8]) -> Result<PathBuf, CommandError> {
    let mut file = NewFile::replace(flag, path)?;
    file.write_all(bytes).map_err(|error| not_written(flag, path, &error))?;
    file.finish()
}

/// Refuses an existing file of the flag `flag`, or a link of this name, before any work is done for the file.
///
/// # Errors
/// [`CommandError::Input`] with flag and file.
pub fn refuse_existing(flag: &str, path: &Path) -> Result<(), CommandError> {
    match path.symlink_metadata() {
        Ok(_) => Err(existing(flag, path)),
        Err(_) => Ok(()),
    }
}

/// The message about a file that already exists.
fn existing(flag: &str, path: &Path) -> CommandError {
    CommandError::Input(format!(
        "{flag}: {} exists already; choose another name",
        path.display()
    ))
}

fn not_written(flag: &str, path: &Path, error: &std::io::Error) -> CommandError {
    if error.kind() == ErrorKind::AlreadyExists {
        return existing(flag, path);
    }
    // The library's own text would name the temporary file.
    let why = match error.raw_os_error() {
        Some(_) => error.to_string(),
        None => error.kind().to_string(),
    };
    let path = path.display();
    if matches!(
        error.kind(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge
    ) {
        return CommandError::Input(format!("{flag}: cannot write {path}: {why}"));
    }
    CommandError::Input(format!(
        "{flag}: cannot write {path}: {why}; it must lie in a directory that can be written"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_finished_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("trace.csv");
        write_whole("--out", &path, b"old").expect("written");
        let mut file = NewFile::replace("--out", &path).expect("begun");
        file.write_all(b"half").expect("written");
        drop(file);
        assert_eq!(std::fs::read(&path).expect("readable"), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1);
        write_whole("--out", &path, b"new").expect("written");
        assert_eq!(std::fs::read(&path).expect("readable"), b"new");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_replaced_and_what_it_leads_to_stays() {
        let folder = tempfile::tempdir().expect("a folder");
        let (elsewhere, path) = (folder.path().join("elsewhere"), folder.path().join("index.html"));
        std::fs::write(&elsewhere, b"precious").expect("written");
        std::os::unix::fs::symlink(&elsewhere, &path).expect("linked");
        write_whole("--out", &path, b"page").expect("written");
        assert_eq!(std::fs::read(&elsewhere).expect("readable"), b"precious");
        assert_eq!(std::fs::read(&path).expect("readable"), b"page");
        assert!(!path.is_symlink());
    }

    #[cfg(unix)]
    #[test]
    fn a_finished_file_can_be_read_by_others_as_far_as_the_umask_allows() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().expect("a folder");
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        write_whole("--out", &ours, b"").expect("written");
        std::fs::write(&plain, b"").expect("written");
        let mode = |path: &Path| std::fs::metadata(path).expect("there").permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }

    #[test]
    fn a_place_that_cannot_be_written_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("missing").join("trace.csv");
        let error = NewFile::create("--record", &path)
            .expect_err("no such directory")
            .to_string();
        assert!(
            error.starts_with("--record: cannot write ") && error.contains("trace.csv"),
            "{error}"
        );
        // The message does not contain the temporary name.
        assert!(!error.contains(".part-"), "{error}");
    }

    #[test]
    fn a_file_that_must_not_exist_takes_no_other_files_place_not_even_of_one_that_came_meanwhile() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("results.jsonl");
        let mut file = NewFile::create("--out", &path).expect("begun");
        file.write_all(b"ours").expect("written");
        std::fs::write(&path, b"theirs").expect("written");
        for refused in [file.finish().map(|_| ()), NewFile::create("--out", &path).map(|_| ())] {
            let error = refused.expect_err("taken").to_string();
            assert!(error.contains("results.jsonl exists already"), "{error}");
        }
        assert_eq!(std::fs::read(&path).expect("readable"), b"theirs");
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1);
    }
}
