//! A recording under way, in either kind of file.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

use firmware::protocol::frame::encode;
use firmware::protocol::message::{BoardMessage, Identity};
use firmware::records::codec::{RecordBlock, Records};
use model::status::Status;
use report::error::CommandError;
use virtual_board::scenario::StoryEvent;

use super::mcap_writer::{McapWriter, VEHICLE_KEY, VEHICLE_METADATA};
use super::messages::{EventMessage, LogMessage, StatusMessage, TypedChannel};

/// What kind of file holds a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordFormat {
    /// The link's own frames, one after the other: the record of every tick, and nothing else.
    Frames,
    /// MCAP: status, terms, events and log beside the same frames.
    Mcap,
}

impl RecordFormat {
    /// The kind that a file's name asks for.
    pub fn of(path: &Path) -> Self {
        if path
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("mcap"))
        {
            Self::Mcap
        } else {
            Self::Frames
        }
    }
}

/// A recording that goes to `W`. A file of frames takes identities and blocks, and leaves the rest.
pub struct RecordWriter<W: Write>(Kind<W>);

enum Kind<W: Write> {
    Frames(W),
    /// And the time of the last block, us since boot.
    Mcap(McapWriter<W>, u64),
}

impl<W: Write> RecordWriter<W> {
    /// A recording of this kind.
    pub fn new(format: RecordFormat, out: W) -> Self {
        Self(match format {
            RecordFormat::Frames => Kind::Frames(out),
            RecordFormat::Mcap => Kind::Mcap(McapWriter::new(out), 0),
        })
    }

    /// Whether status, events, log and vehicle are kept.
    pub fn keeps_all(&self) -> bool {
        matches!(self.0, Kind::Mcap(..))
    }

    /// Takes who the board is, which stands before its blocks.
    ///
    /// # Errors
    /// [`CommandError::Other`]: the message fits no frame, or the output takes no more.
    pub fn identity(&mut self, identity: &Identity) -> Result<(), CommandError> {
        if let Kind::Mcap(writer, _) = &mut self.0 {
            let about = identity.about;
            let [major, minor, patch] = about.version;
            let words = [
                ("firmware", format!("{major}.{minor}.{patch}")),
                ("build", format!("{:08x}", about.build)),
                ("parameters", format!("{:08x}", about.schema)),
                ("protocol", identity.protocol.to_string()),
            ];
            writer.metadata(
                "board",
                words.into_iter().map(|(name, word)| (name.to_owned(), word)).collect(),
            )?;
        }
        self.message(&BoardMessage::Identity(*identity))
    }

    /// Takes the next block of records.
    ///
    /// # Errors
    /// As [`RecordWriter::identity`].
    pub fn block(&mut self, block: RecordBlock) -> Result<(), CommandError> {
        if let Kind::Mcap(_, time_us) = &mut self.0
            && let Some(Ok(first)) = Records::new(&block.bytes).next()
        {
            *time_us = first.sample.time_us;
        }
        self.message(&BoardMessage::Records(block))
    }

    fn message(&mut self, message: &BoardMessage) -> Result<(), CommandError> {
        let frame = encode(message).map_err(|_| CommandError::Other("a message of the board fits no frame".into()))?;
        match &mut self.0 {
            Kind::Frames(out) => out
                .write_all(&frame)
                .map_err(|error| CommandError::Other(format!("output: {error}"))),
            Kind::Mcap(writer, time_us) => writer.frame(*time_us, &frame),
        }
    }

    /// Takes the text of the vehicle file of the set in force.
    ///
    /// # Errors
    /// [`CommandError::Other`]: the output takes no more.
    pub fn vehicle(&mut self, toml: String) -> Result<(), CommandError> {
        let Kind::Mcap(writer, _) = &mut self.0 else {
            return Ok(());
        };
        writer.metadata(VEHICLE_METADATA, BTreeMap::from([(VEHICLE_KEY.to_owned(), toml)]))
    }

    /// Takes a status and the terms of the laws in it.
    ///
    /// # Errors
    /// As [`RecordWriter::vehicle`].
    pub fn status(&mut self, status: &Status) -> Result<(), CommandError> {
        let Kind::Mcap(writer, _) = &mut self.0 else {
            return Ok(());
        };
        writer.typed(TypedChannel::Status, status.time_us, &StatusMessage::from(status))?;
        writer.typed(TypedChannel::Terms, status.time_us, &status.terms)
    }

    /// Takes something that happened.
    ///
    /// # Errors
    /// As [`RecordWriter::vehicle`].
    pub fn event(&mut self, event: &StoryEvent) -> Result<(), CommandError> {
        let Kind::Mcap(writer, _) = &mut self.0 else {
            return Ok(());
        };
        let message = EventMessage {
            at_s: event.at_s,
            for_s: event.for_s.unwrap_or(0.0),
            kind: event.kind.name(),
            text: &event.text,
        };
        writer.typed(TypedChannel::Events, (event.at_s * 1e6).round() as u64, &message)
    }

    /// Takes a line of the log, of the time `time_us`, us since boot; `level` as the firmware's log names it.
    ///
    /// # Errors
    /// As [`RecordWriter::vehicle`].
    pub fn log(&mut self, time_us: u64, level: &str, text: &str) -> Result<(), CommandError> {
        let Kind::Mcap(writer, _) = &mut self.0 else {
            return Ok(());
        };
        writer.typed(TypedChannel::Log, time_us, &LogMessage::new(time_us, level, text))
    }

    /// Completes the recording; its output.
    ///
    /// # Errors
    /// As [`RecordWriter::vehicle`].
    pub fn finish(self) -> Result<W, CommandError> {
        match self.0 {
            Kind::Frames(out) => Ok(out),
            Kind::Mcap(writer, _) => writer.finish(),
        }
    }
}
