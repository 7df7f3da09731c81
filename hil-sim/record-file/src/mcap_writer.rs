//! Writes records as an MCAP file (<https://mcap.dev>), which common robotics tools open: typed channels of JSON, and
//! the record of every tick as the link's own frames.

use std::collections::BTreeMap;
use std::io::{self, Write};

use mcap::records::MessageHeader;
use mcap::write::{Metadata, NoSeek};
use mcap::{McapError, WriteOptions, Writer};
use serde::Serialize;

use crate::messages::TypedChannel;

/// The channel of the link's own frames.
pub const FRAMES_TOPIC: &str = "/records";
/// Encoding of its messages: each message is one frame.
const FRAMES_ENCODING: &str = "biplanar-frame";
/// The metadata with the vehicle file of the set in force, and the key of its text.
pub const VEHICLE_METADATA: &str = "vehicle";
/// The key of the vehicle file's text.
pub const VEHICLE_KEY: &str = "vehicle.toml";

/// Time after which a written message must be readable whatever happens, us of the file's time.
const FLUSH_US: u64 = 500_000;

/// The boot of the board from which a time counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Since {
    /// The present boot.
    ThisBoot,
    /// The first boot in the file.
    FirstBoot,
}

/// An MCAP file that is being written. The first message starts the file: a file without messages stays empty.
pub struct McapWriter<W: Write> {
    /// The output, until the file begins.
    out: Option<W>,
    begun: Option<Box<BegunFile<W>>>,
}

struct BegunFile<W: Write> {
    writer: Writer<NoSeek<W>>,
    frames: Sequence,
    typed: [Sequence; TypedChannel::ALL.len()],
    /// Start of the present boot, and time of the latest message, in the file's time: us since the first boot.
    booted_us: u64,
    latest_us: u64,
    flushed_us: u64,
}

/// A channel's number, and the number of its next message.
#[derive(Debug, Clone, Copy, Default)]
struct Sequence {
    id: u16,
    next: u32,
}

impl<W: Write> McapWriter<W> {
    /// A file written to `out`.
    pub fn new(out: W) -> Self {
        Self {
            out: Some(out),
            begun: None,
        }
    }

    fn begun(&mut self) -> io::Result<&mut BegunFile<W>> {
        if let Some(out) = self.out.take() {
            self.begun = Some(Box::new(BegunFile::begin(out).map_err(not_written)?));
        }
        self.begun.as_deref_mut().ok_or_else(failed_before)
    }

    /// Notes a boot of the board. Following times count from this boot. In the file they start at `booted_us`, us
    /// since the first boot, or after the latest message, whichever is later. The present chunk ends.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn boot(&mut self, booted_us: u64) -> io::Result<()> {
        let begun = self.begun()?;
        begun.booted_us = begun.latest_us.max(booted_us);
        begun.flushed_us = begun.booted_us;
        begun.writer.flush().map_err(not_written)
    }

    /// Writes one frame of the link with the time `time_us`, us since the board's boot.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn frame(&mut self, time_us: u64, frame: &[u8]) -> io::Result<()> {
        let begun = self.begun()?;
        let time_us = begun.in_file(time_us);
        let header = begun.frames.header(time_us);
        begun.message(&header, time_us, frame).map_err(not_written)
    }

    /// Writes a message of a typed channel with the time `time_us`, us since the boot that `since` names.
    ///
    /// # Errors
    /// As [`McapWriter::frame`].
    pub fn typed(
        &mut self,
        channel: TypedChannel,
        since: Since,
        time_us: u64,
        message: &impl Serialize,
    ) -> io::Result<()> {
        let json = serde_json::to_vec(message)?;
        let begun = self.begun()?;
        let time_us = match since {
            Since::ThisBoot => begun.in_file(time_us),
            Since::FirstBoot => time_us,
        };
        let header = begun.typed[channel as usize].header(time_us);
        begun.message(&header, time_us, &json).map_err(not_written)
    }

    /// Writes metadata of the whole file: texts by name.
    ///
    /// # Errors
    /// As [`McapWriter::frame`].
    pub fn metadata(&mut self, name: &str, words: BTreeMap<String, String>) -> io::Result<()> {
        let metadata = Metadata {
            name: name.to_owned(),
            metadata: words,
        };
        self.begun()?.writer.write_metadata(&metadata).map_err(not_written)
    }

    /// Writes the file's index; returns the output.
    ///
    /// # Errors
    /// As [`McapWriter::frame`].
    pub fn finish(self) -> io::Result<W> {
        match (self.out, self.begun) {
            (Some(out), _) => Ok(out),
            (None, Some(mut begun)) => {
                begun.writer.finish().map_err(not_written)?;
                Ok(begun.writer.into_inner().into_inner())
            }
            (None, None) => Err(failed_before()),
        }
    }
}

impl<W: Write> BegunFile<W> {
    /// Chunks end by time and stay in memory until they are whole, so everything that was flushed stays readable.
    fn begin(out: W) -> Result<Self, McapError> {
        let options = WriteOptions::new()
            .compression(None)
            .chunk_size(None)
            .disable_seeking(true)
            .library("hil-sim");
        let mut writer = options.create(NoSeek::new(out))?;
        let none = BTreeMap::new();
        let frames = Sequence::of(writer.add_channel(0, FRAMES_TOPIC, FRAMES_ENCODING, &none)?);
        let mut typed = [Sequence::default(); TypedChannel::ALL.len()];
        for (slot, channel) in typed.iter_mut().zip(TypedChannel::ALL) {
            let schema = channel.schema().map_err(std::io::Error::from)?.to_string();
            let schema = writer.add_schema(channel.schema_name(), "jsonschema", schema.as_bytes())?;
            *slot = Sequence::of(writer.add_channel(schema, channel.topic(), "json", &none)?);
        }
        Ok(Self {
            writer,
            frames,
            typed,
            booted_us: 0,
            latest_us: 0,
            flushed_us: 0,
        })
    }

    /// The file's time of an event `time_us` after the present boot.
    fn in_file(&self, time_us: u64) -> u64 {
        self.booted_us.saturating_add(time_us)
    }

    fn message(&mut self, header: &MessageHeader, time_us: u64, bytes: &[u8]) -> Result<(), McapError> {
        self.latest_us = self.latest_us.max(time_us);
        let flushed = if time_us.abs_diff(self.flushed_us) >= FLUSH_US {
            self.flushed_us = time_us;
            self.writer.flush()
        } else {
            Ok(())
        };
        // An output that is full and still has room for the file's end takes this message with that end.
        let written = self.writer.write_to_known_channel(header, bytes);
        flushed.and(written)
    }
}

impl Sequence {
    fn of(id: u16) -> Self {
        Self { id, next: 0 }
    }

    /// The header of the channel's next message, at `time_us` of the file's time. MCAP times are in ns.
    fn header(&mut self, time_us: u64) -> MessageHeader {
        let sequence = self.next;
        self.next = sequence.wrapping_add(1);
        let time_ns = time_us.saturating_mul(1000);
        MessageHeader {
            channel_id: self.id,
            sequence,
            log_time: time_ns,
            publish_time: time_ns,
        }
    }
}

fn failed_before() -> io::Error {
    io::Error::other("output: the file has failed before")
}

pub fn not_written(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        error => io::Error::other(format!("output: {error}")),
    }
}
