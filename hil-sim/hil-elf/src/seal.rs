//! Seals a firmware's image: writes its length and checksum into the ELF, before anything flashes or emulates it.

use crate::image_seal::{
    BOARD_AT, BUILD_AT, ERASED, FLASH_START, IMAGE_MAX, MARKER, MISSING, NUMBERS_AT, NUMBERS_BYTES, VERSION_AT,
};

/// First bytes of an ELF for a 32-bit little-endian machine.
const MAGIC: [u8; 6] = [0x7F, b'E', b'L', b'F', 1, 1];
/// Offsets in the ELF's header: offset of the program headers, their size and their number.
const PROGRAM_HEADERS: usize = 28;
const PROGRAM_HEADER_BYTES: usize = 42;
const PROGRAM_HEADER_COUNT: usize = 44;
/// Offsets in a program header: type, offset in the file, address in the flash, bytes in the file.
const TYPE: usize = 0;
const OFFSET: usize = 4;
const ADDRESS: usize = 12;
const FILE_BYTES: usize = 16;
/// Type of a loaded segment.
const LOADED: u32 = 1;

/// Description of a sealed image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SealedImage {
    /// Number of the image's board.
    pub board: u16,
    /// Version of the firmware: major, minor, patch.
    pub version: [u16; 3],
    /// Hash of the firmware's sources.
    pub build: u32,
    /// Address of the image's first byte in the part's memory.
    pub start: u32,
    /// Number of bytes in the flash.
    pub length: u32,
    /// Checksum of those bytes.
    pub checksum: u32,
}

/// CRC-32C (ISCSI), computed bit by bit.
pub fn checksum(bytes: &[u8]) -> u32 {
    /// The polynomial, lowest bit first.
    const POLYNOMIAL: u32 = 0x82F6_3B78;
    let step = |crc: u32, _| (crc >> 1) ^ (POLYNOMIAL & (crc & 1).wrapping_neg());
    !bytes
        .iter()
        .fold(u32::MAX, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), step))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

fn half(bytes: &[u8], at: usize) -> Option<usize> {
    Some(usize::from(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?)))
}

/// The flash contents of an ELF.
struct FlashImage {
    /// Address of the first byte in the part's memory. The flashing program checks whether that address is right
    /// for the board.
    start: u32,
    bytes: Vec<u8>,
    /// Pieces of the image: offset in the image, offset in the file, number of bytes.
    pieces: Vec<(usize, usize, usize)>,
}

impl FlashImage {
    fn read(elf: &[u8]) -> Option<Self> {
        if !elf.starts_with(&MAGIC) {
            return None;
        }
        let (first, bytes) = (word(elf, PROGRAM_HEADERS)? as usize, half(elf, PROGRAM_HEADER_BYTES)?);
        let mut image = Self {
            start: 0,
            bytes: Vec::new(),
            pieces: Vec::new(),
        };
        let mut segments = Vec::new();
        for n in 0..half(elf, PROGRAM_HEADER_COUNT)? {
            let header = elf.get(first + n * bytes..)?;
            let (offset, length) = (word(header, OFFSET)? as usize, word(header, FILE_BYTES)? as usize);
            let Some(at) = word(header, ADDRESS)?.checked_sub(FLASH_START) else {
                continue;
            };
            if word(header, TYPE)? != LOADED || length == 0 || at >= IMAGE_MAX {
                continue;
            }
            segments.push((at as usize, offset, length));
        }
        let start = segments.iter().map(|(at, ..)| *at).min()?;
        image.start = FLASH_START + start as u32;
        for (at, offset, length) in segments {
            let at = at - start;
            if image.bytes.len() < at + length {
                image.bytes.resize(at + length, ERASED);
            }
            image
                .bytes
                .get_mut(at..at + length)?
                .copy_from_slice(elf.get(offset..offset + length)?);
            image.pieces.push((at, offset, length));
        }
        Some(image)
    }

    /// The offset in the file of an offset in the image.
    fn in_file(&self, at: usize) -> Option<usize> {
        let piece = self
            .pieces
            .iter()
            .find(|(start, _, bytes)| (*start..start + bytes).contains(&at))?;
        Some(piece.1 + at - piece.0)
    }
}

/// The image that a sealed ELF puts into the flash, and its bytes.
///
/// # Errors
/// As [`seal`]; the image is not sealed, or has changed since it was sealed.
pub fn sealed_image(elf: &[u8]) -> Result<(SealedImage, Vec<u8>), &'static str> {
    let mut sealed = elf.to_vec();
    let image = seal(&mut sealed)?;
    if sealed != elf {
        let (at, bytes) = seal_of(&FlashImage::read(elf).ok_or("no ELF of the board")?)?;
        let unsealed = word(&bytes, at + NUMBERS_AT) == Some(MISSING);
        return Err(if unsealed {
            "the image is not sealed"
        } else {
            "the image is not the one that was sealed"
        });
    }
    let bytes = FlashImage::read(elf).ok_or("no ELF of the board")?.bytes;
    Ok((image, bytes))
}

/// Offset of an image's seal, and the image's bytes.
fn seal_of(image: &FlashImage) -> Result<(usize, Vec<u8>), &'static str> {
    let marker = MARKER.map(u32::to_le_bytes).concat();
    let mut found = image
        .bytes
        .windows(marker.len())
        .enumerate()
        .filter(|(_, window)| *window == marker);
    let (Some((at, _)), None) = (found.next(), found.next()) else {
        return Err("not exactly one seal in the image");
    };
    Ok((at, image.bytes.clone()))
}

/// Writes the seal's numbers into an ELF, and returns the description of the sealed image. Sealing an ELF again
/// changes nothing.
///
/// # Errors
/// The bytes are not an ELF of the board, or contain no seal, or more than one.
pub fn seal(elf: &mut [u8]) -> Result<SealedImage, &'static str> {
    let mut image = FlashImage::read(elf).ok_or("no ELF of the board")?;
    let (at, _) = seal_of(&image)?;
    let cut_off = "a seal that is cut off";
    let part = |number: usize| half(&image.bytes, at + VERSION_AT + 2 * number).ok_or(cut_off);
    let version = [part(0)?, part(1)?, part(2)?].map(|part| part as u16);
    let build = word(&image.bytes, at + BUILD_AT).ok_or(cut_off)?;
    let board = half(&image.bytes, at + BOARD_AT).ok_or(cut_off)? as u16;
    let at = at + NUMBERS_AT;
    let numbers = image.bytes.get_mut(at..at + NUMBERS_BYTES).ok_or(cut_off)?;
    numbers.fill(ERASED);
    let length = u32::try_from(image.bytes.len()).map_err(|_| "too long an image")?;
    let checksum = checksum(&image.bytes);
    let place = image.in_file(at).ok_or("a seal that no segment holds")?;
    let numbers = [length.to_le_bytes(), checksum.to_le_bytes()].concat();
    elf.get_mut(place..place + NUMBERS_BYTES)
        .ok_or(cut_off)?
        .copy_from_slice(&numbers);
    Ok(SealedImage {
        board,
        version,
        build,
        start: image.start,
        length,
        checksum,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Build 0x04030201, version 5.6.7, board 0x0908.
    const IDENTITY: [u8; 12] = [1, 2, 3, 4, 5, 0, 6, 0, 7, 0, 8, 9];

    /// An ELF with a code segment, a gap, and a segment with the seal.
    fn elf() -> Vec<u8> {
        let sealed = [&MARKER.map(u32::to_le_bytes).concat()[..], &[ERASED; 8], &IDENTITY].concat();
        let code = [1, 2, 3, 4, 5];
        let mut bytes = vec![0; 52 + 2 * 32];
        bytes[..6].copy_from_slice(&MAGIC);
        bytes[PROGRAM_HEADERS] = 52;
        bytes[PROGRAM_HEADER_BYTES] = 32;
        bytes[PROGRAM_HEADER_COUNT] = 2;
        for (n, (address, segment)) in [(FLASH_START, &code[..]), (FLASH_START + 8, &sealed)]
            .into_iter()
            .enumerate()
        {
            let header = 52 + n * 32;
            for (place, value) in [
                (TYPE, LOADED),
                (OFFSET, bytes.len() as u32),
                (ADDRESS, address),
                (FILE_BYTES, segment.len() as u32),
            ] {
                bytes[header + place..header + place + 4].copy_from_slice(&value.to_le_bytes());
            }
            bytes.extend(segment);
        }
        bytes
    }

    #[test]
    fn the_checksum_is_the_standards() {
        assert_eq!(checksum(b"123456789"), 0xE306_9283);
    }

    #[test]
    fn a_seal_holds_length_and_checksum_of_what_the_flash_will_hold() {
        let mut elf = elf();
        let unsealed = elf.clone();
        let sealed = seal(&mut elf).expect("an ELF");
        let mut flash = vec![1, 2, 3, 4, 5, ERASED, ERASED, ERASED];
        flash.extend(MARKER.map(u32::to_le_bytes).concat());
        flash.extend([ERASED; 8]);
        flash.extend(IDENTITY);
        let expected = SealedImage {
            board: 0x0908,
            version: [5, 6, 7],
            build: 0x0403_0201,
            start: FLASH_START,
            length: 44,
            checksum: checksum(&flash),
        };
        assert_eq!(sealed, expected);
        let (rest, numbers) = elf.split_at(elf.len() - NUMBERS_BYTES - IDENTITY.len());
        assert_eq!(rest, &unsealed[..rest.len()]);
        let written = [44_u32.to_le_bytes(), expected.checksum.to_le_bytes()].concat();
        assert_eq!(numbers, [&written[..], &IDENTITY].concat());
        assert_eq!(sealed_image(&unsealed), Err("the image is not sealed"));
        let (image, mut bytes) = sealed_image(&elf).expect("it is sealed");
        assert_eq!((image, bytes.len()), (sealed, 44));
        bytes[24..32].fill(ERASED);
        assert_eq!(bytes, flash);
        let mut changed = elf.clone();
        *changed.last_mut().expect("bytes") ^= 1;
        assert_eq!(sealed_image(&changed), Err("the image is not the one that was sealed"));
        let once = elf.clone();
        assert_eq!(seal(&mut elf), Ok(sealed));
        assert_eq!(elf, once);
    }

    #[test]
    fn what_is_no_firmware_is_refused() {
        assert!(seal(&mut []).is_err());
        assert!(seal(&mut elf()[..60]).is_err());
        let mut cut_off = elf();
        let bytes = 52 + 32 + FILE_BYTES;
        cut_off[bytes] -= 1;
        assert_eq!(seal(&mut cut_off), Err("a seal that is cut off"));
        let mut without = elf();
        let at = without.len() - 24 - IDENTITY.len();
        without[at] ^= 1;
        assert_eq!(seal(&mut without), Err("not exactly one seal in the image"));
    }
}
