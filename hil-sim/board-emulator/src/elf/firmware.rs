//! The firmware's ELF: its image and its symbols.

use std::path::{Path, PathBuf};

use object::{Object, ObjectSymbol};
use rigless::image::Image;

use crate::error::Error;

/// A firmware that can be run.
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
    /// When the file cannot be read, is no ELF, or has no RTT control block.
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

    /// The file that the firmware was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The image that the emulator loads.
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// The ELF's bytes.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
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

    /// Name, address and size of every defined function whose name satisfies `wanted`.
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
