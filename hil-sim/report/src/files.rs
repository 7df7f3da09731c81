//! Files that appear whole or not at all.
//!
//! A file is written under a temporary name beside its place and takes its name when it is complete, so that a full disk
//! or a crash never leaves half a file under its name, and a link that stands in its place is replaced, not followed.

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::CommandError;

/// A file that is being written.
#[derive(Debug)]
pub struct NewFile {
    part: BufWriter<NamedTempFile>,
    path: PathBuf,
}

impl NewFile {
    /// Begins the file `path`.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the file, if its directory cannot be written.
    pub fn create(path: &Path) -> Result<Self, CommandError> {
        let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        let mut builder = tempfile::Builder::new();
        builder.prefix(".part-");
        // As any new file's; the process's umask takes away what it does not allow.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let part = builder
            .tempfile_in(directory.unwrap_or(Path::new(".")))
            .map_err(|error| not_written(path, &error))?;
        Ok(Self {
            part: BufWriter::new(part),
            path: path.to_owned(),
        })
    }

    /// Gives the complete file its name.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the file, if the disk is full or the place is taken by a directory.
    pub fn finish(self) -> Result<PathBuf, CommandError> {
        let Self { part, path } = self;
        let part = part.into_inner().map_err(|error| not_written(&path, error.error()))?;
        part.persist(&path).map_err(|error| not_written(&path, &error.error))?;
        Ok(path)
    }
}

impl Write for NewFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.part.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.part.flush()
    }
}

/// Writes the whole file `path`.
///
/// # Errors
/// [`CommandError::Input`] naming the file.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<PathBuf, CommandError> {
    let mut file = NewFile::create(path)?;
    file.write_all(bytes).map_err(|error| not_written(path, &error))?;
    file.finish()
}

fn not_written(path: &Path, error: &std::io::Error) -> CommandError {
    CommandError::Input(format!(
        "--out: cannot write {}: {error}; it must lie in a directory that can be written",
        path.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_finished_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("trace.csv");
        write_whole(&path, b"old").expect("written");
        let mut file = NewFile::create(&path).expect("begun");
        file.write_all(b"half").expect("written");
        drop(file);
        assert_eq!(std::fs::read(&path).expect("readable"), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1);
        write_whole(&path, b"new").expect("written");
        assert_eq!(std::fs::read(&path).expect("readable"), b"new");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_replaced_and_what_it_leads_to_stays() {
        let folder = tempfile::tempdir().expect("a folder");
        let (elsewhere, path) = (folder.path().join("elsewhere"), folder.path().join("index.html"));
        std::fs::write(&elsewhere, b"precious").expect("written");
        std::os::unix::fs::symlink(&elsewhere, &path).expect("linked");
        write_whole(&path, b"page").expect("written");
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
        write_whole(&ours, b"").expect("written");
        std::fs::write(&plain, b"").expect("written");
        let mode = |path: &Path| std::fs::metadata(path).expect("there").permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }

    #[test]
    fn a_place_that_cannot_be_written_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("missing").join("trace.csv");
        let error = NewFile::create(&path).expect_err("no such directory").to_string();
        assert!(error.contains("trace.csv"), "{error}");
    }
}
