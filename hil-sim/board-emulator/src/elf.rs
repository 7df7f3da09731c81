//! The firmware's ELF: its image, its symbols, its log's dictionary.

use std::path::{Path, PathBuf};

use object::{Object, ObjectSection, ObjectSymbol};
use rigless::image::Image;

use crate::Error;

/// A firmware to run.
#[derive(Debug)]
pub struct Firmware {
    path: PathBuf,
    bytes: Vec<u8>,
    image: Image,
    rtt_block: u64,
}

impl Firmware {
    /// Reads an ELF.
    ///
    /// # Errors
    /// A file that cannot be read, is not an ELF, or has no RTT block.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let bytes = std::fs::read(path).map_err(|source| Error::Read {
            path: path.to_owned(),
            source,
        })?;
        let image = Image::new(path, bytes.clone(), None)?;
        let mut firmware = Self {
            path: path.to_owned(),
            bytes,
            image,
            rtt_block: 0,
        };
        firmware.rtt_block = firmware.symbol("_SEGGER_RTT")?.0;
        Ok(firmware)
    }

    /// Where it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The image the emulator places.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// Address of the RTT control block.
    pub fn rtt_block(&self) -> u64 {
        self.rtt_block
    }

    /// Address and size of a symbol.
    ///
    /// # Errors
    /// When the ELF has none of that name.
    pub fn symbol(&self, name: &str) -> Result<(u64, u64), Error> {
        let file = object::File::parse(&*self.bytes)?;
        file.symbol_by_name(name)
            .map(|symbol| (symbol.address(), symbol.size()))
            .ok_or_else(|| Error::NoSymbol {
                path: self.path.clone(),
                name: name.to_owned(),
            })
    }

    /// Every defined function's name, address and size whose name satisfies `wanted`.
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

    /// Bytes of flash and of RAM the firmware takes, the stack not among them.
    ///
    /// # Errors
    /// When the ELF cannot be parsed.
    pub fn footprint(&self) -> Result<Footprint, Error> {
        let file = object::File::parse(&*self.bytes)?;
        let mut footprint = Footprint::default();
        for section in file.sections() {
            match (section.kind(), section.name().unwrap_or_default()) {
                (_, ".data") => {
                    footprint.flash_bytes += section.size();
                    footprint.ram_bytes += section.size();
                }
                (_, ".bss" | ".uninit") => footprint.ram_bytes += section.size(),
                (_, ".vector_table" | ".text" | ".rodata") => footprint.flash_bytes += section.size(),
                _ => {}
            }
        }
        Ok(footprint)
    }

    /// Decodes the log out of what came through RTT.
    ///
    /// # Errors
    /// When the ELF carries no log dictionary.
    pub fn decode(&self, rtt: &[u8]) -> Result<Vec<String>, Error> {
        let table = defmt_decoder::Table::parse(&self.bytes)
            .map_err(|error| Error::Log(error.to_string()))?
            .ok_or_else(|| Error::Log("the ELF has no .defmt section".to_owned()))?;
        let mut stream = table.new_stream_decoder();
        stream.received(rtt);
        let mut lines = Vec::new();
        loop {
            match stream.decode() {
                Ok(frame) => lines.push(frame.display(false).to_string()),
                Err(defmt_decoder::DecodeError::UnexpectedEof) => return Ok(lines),
                Err(defmt_decoder::DecodeError::Malformed) => lines.push("<malformed>".to_owned()),
            }
        }
    }
}

/// Memory a firmware takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Footprint {
    /// Flash in bytes.
    pub flash_bytes: u64,
    /// Static RAM in bytes.
    pub ram_bytes: u64,
}
