//! The firmware's ELF: its image and its symbols; the boot loader's image.

use std::path::{Path, PathBuf};

use defmt_decoder::Table;
use object::{Object, ObjectSymbol};
use rigless::image::Image;

use super::log::{LogReader, table_of};
use crate::error::Error;

/// A firmware that can run on the emulated board.
#[derive(Debug)]
pub struct Firmware {
    path: PathBuf,
    bytes: Vec<u8>,
    image: Image,
    loader: Image,
    rtt_block: u64,
    /// The dictionary of its log, or why it has none.
    log_table: Result<Table, String>,
}

/// Name of the boot loader's ELF, beside the firmware's.
const LOADER: &str = "boot-loader";

impl Firmware {
    /// Reads an ELF, and the boot loader's ELF in the same folder.
    ///
    /// # Errors
    /// When a file cannot be read or is not an ELF, or the firmware has no RTT control block.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let read = |path: &Path| {
            std::fs::read(path).map_err(|source| Error::Read {
                path: path.to_owned(),
                source,
            })
        };
        let bytes = read(path)?;
        let image = Image::new(path, bytes.clone(), None)?;
        let loader = path.with_file_name(LOADER);
        let loader = Image::new(&loader, read(&loader)?, None)?;
        let mut firmware = Self {
            path: path.to_owned(),
            log_table: table_of(&bytes),
            bytes,
            image,
            loader,
            rtt_block: 0,
        };
        firmware.rtt_block = firmware.symbol("_SEGGER_RTT")?.0;
        Ok(firmware)
    }

    /// The file from which the firmware was read.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The images of a flashed board: the boot loader's and the firmware's.
    pub fn images(&self) -> Vec<Image> {
        vec![self.loader.clone(), self.image.clone()]
    }

    /// The boot loader's image alone, for a board whose firmware the test supplies.
    pub fn loader(&self) -> Vec<Image> {
        vec![self.loader.clone()]
    }

    /// Address of the RTT control block.
    pub fn rtt_block(&self) -> u64 {
        self.rtt_block
    }

    /// Address and size of a symbol.
    ///
    /// # Errors
    /// When the ELF has no symbol of that name.
    pub fn symbol(&self, name: &str) -> Result<(u64, u64), Error> {
        let file = object::File::parse(&*self.bytes)?;
        file.symbol_by_name(name)
            .map(|symbol| (symbol.address(), symbol.size()))
            .ok_or_else(|| Error::NoSymbol {
                path: self.path.clone(),
                name: name.to_owned(),
            })
    }

    /// Returns a reader of one run's log.
    ///
    /// # Errors
    /// [`Error::Log`] when the ELF carries no log dictionary.
    pub fn log_reader(&self) -> Result<LogReader<'_>, Error> {
        let table = self.log_table.as_ref();
        table.map(LogReader::new).map_err(|why| Error::Log(why.clone()))
    }

    /// Decodes the log from the bytes that came through RTT.
    ///
    /// # Errors
    /// As [`Firmware::log_reader`].
    pub fn decode(&self, rtt: &[u8]) -> Result<Vec<String>, Error> {
        Ok(self.log_reader()?.lines(rtt))
    }

    /// Name, address and size of every defined function whose name satisfies `wanted`. For tests.
    ///
    /// # Errors
    /// When the ELF cannot be parsed.
    pub fn functions(&self, wanted: impl Fn(&str) -> bool) -> Result<Vec<(String, u64, u64)>, Error> {
        let file = object::File::parse(&*self.bytes)?;
        Ok(file
            .symbols()
            .filter(|symbol| symbol.kind() == object::SymbolKind::Text)
            .filter_map(|symbol| Some((symbol.name().ok()?.to_owned(), symbol.address() & !1, symbol.size())))
            .filter(|(name, ..)| wanted(name))
            .collect())
    }
}
