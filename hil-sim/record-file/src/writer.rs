//! A recording in progress, in either kind of file.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use firmware::events::LogBlock;
use firmware::protocol::frame::encode;
use firmware::protocol::message::{BoardMessage, Identity, OrderId, Reading};
use firmware::records::codec::{RecordBlock, Records};
use model::status::Status;
use virtual_board::scenario::StoryEvent;

use crate::log_line::LogLine;
use crate::mcap_writer::{McapWriter, Since, VEHICLE_KEY, VEHICLE_METADATA};
use crate::messages::{EventMessage, LogMessage, StatusMessage, TypedChannel};

/// Kind of a recording's file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordFormat {
    /// The link's own frames, one after the other: the record of every tick, and the log if it came over the link.
    Frames,
    /// MCAP: status, terms, events and log, in addition to the same frames.
    Mcap,
}

impl RecordFormat {
    /// The kind that a file's name requests.
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

/// A recording written to `W`. A file of frames takes identities and blocks, of records and of the log, and ignores
/// the rest.
pub struct RecordWriter<W: Write> {
    kind: Kind<W>,
    /// The present boot, once an identity has named it.
    boot: Option<u32>,
}

enum Kind<W: Write> {
    Frames(W),
    /// The writer, and the time of the last block, us since boot.
    Mcap(McapWriter<W>, u64),
}

impl<W: Write> RecordWriter<W> {
    /// A recording of this kind.
    pub fn new(format: RecordFormat, out: W) -> Self {
        Self {
            kind: match format {
                RecordFormat::Frames => Kind::Frames(out),
                RecordFormat::Mcap => Kind::Mcap(McapWriter::new(out), 0),
            },
            boot: None,
        }
    }

    /// Whether the file stores status, events and vehicle.
    pub fn keeps_all(&self) -> bool {
        matches!(self.kind, Kind::Mcap(..))
    }

    /// Notes a boot of the board: everything taken from now on follows everything taken before. The board was switched
    /// on at `booted_us`, us since the first boot, if known; else at the end of the previous boot.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn boot(&mut self, booted_us: Option<u64>) -> io::Result<()> {
        self.boot = None;
        match &mut self.kind {
            Kind::Frames(_) => Ok(()),
            Kind::Mcap(writer, time_us) => {
                *time_us = 0;
                writer.boot(booted_us.unwrap_or(0))
            }
        }
    }

    /// Takes the board's identity, which precedes its blocks. An identity of another boot than the last begins that
    /// boot.
    ///
    /// # Errors
    /// The message does not fit into a frame, or the output cannot be written.
    pub fn identity(&mut self, identity: &Identity) -> io::Result<()> {
        let boot = identity.about.boot;
        if self.boot.is_some_and(|known| known != boot) {
            self.boot(None)?;
        }
        self.boot = Some(boot);
        if let Kind::Mcap(writer, _) = &mut self.kind {
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
    pub fn block(&mut self, block: RecordBlock) -> io::Result<()> {
        if let Kind::Mcap(_, time_us) = &mut self.kind
            && let Some(Ok(first)) = Records::new(&block.bytes).next()
        {
            *time_us = first.sample.time_us;
        }
        self.message(&BoardMessage::Records(block))
    }

    fn message(&mut self, message: &BoardMessage) -> io::Result<()> {
        let frame = encode(message).map_err(|_| io::Error::other("a message of the board fits no frame"))?;
        match &mut self.kind {
            Kind::Frames(out) => out.write_all(&frame),
            Kind::Mcap(writer, time_us) => writer.frame(*time_us, &frame),
        }
    }

    /// Takes the text of the vehicle file of the set in force.
    ///
    /// # Errors
    /// The output cannot be written.
    pub fn vehicle(&mut self, toml: String) -> io::Result<()> {
        let Kind::Mcap(writer, _) = &mut self.kind else {
            return Ok(());
        };
        writer.metadata(VEHICLE_METADATA, BTreeMap::from([(VEHICLE_KEY.to_owned(), toml)]))
    }

    /// Takes a status, with its terms of the laws.
    ///
    /// # Errors
    /// As [`RecordWriter::vehicle`].
    pub fn status(&mut self, status: &Status) -> io::Result<()> {
        let Kind::Mcap(writer, _) = &mut self.kind else {
            return Ok(());
        };
        writer.typed(
            TypedChannel::Status,
            Since::ThisBoot,
            status.time_us,
            &StatusMessage::from(status),
        )?;
        writer.typed(TypedChannel::Terms, Since::ThisBoot, status.time_us, &status.terms)
    }

    /// Takes an event of the present boot, with its time since that boot.
    ///
    /// # Errors
    /// As [`RecordWriter::vehicle`].
    pub fn event(&mut self, event: &StoryEvent) -> io::Result<()> {
        self.event_since(event, Since::ThisBoot)
    }

    /// Takes an event, with its time since the first boot.
    ///
    /// # Errors
    /// As [`RecordWriter::vehicle`].
    pub fn event_of_run(&mut self, event: &StoryEvent) -> io::Result<()> {
        self.event_since(event, Since::FirstBoot)
    }

    fn event_since(&mut self, event: &StoryEvent, since: Since) -> io::Result<()> {
        let Kind::Mcap(writer, _) = &mut self.kind else {
            return Ok(());
        };
        let message = EventMessage {
            at_s: event.at_s,
            for_s: event.for_s.unwrap_or(0.0),
            kind: event.kind.name(),
            text: &event.text,
        };
        writer.typed(TypedChannel::Events, since, (event.at_s * 1e6).round() as u64, &message)
    }

    /// Takes a line of the log. A file of frames takes the log in the link's own blocks ([`RecordWriter::log_block`]),
    /// and ignores this line.
    ///
    /// # Errors
    /// As [`RecordWriter::vehicle`].
    pub fn log(&mut self, line: &LogLine) -> io::Result<()> {
        let Kind::Mcap(writer, _) = &mut self.kind else {
            return Ok(());
        };
        writer.typed(
            TypedChannel::Log,
            Since::ThisBoot,
            line.time_us,
            &LogMessage::from(line),
        )
    }

    /// Takes a block of the log, as the link delivers it.
    ///
    /// # Errors
    /// As [`RecordWriter::identity`].
    pub fn log_block(&mut self, block: &LogBlock) -> io::Result<()> {
        if self.keeps_all() {
            return block.lines.iter().try_for_each(|line| self.log(&LogLine::of(line)));
        }
        if block.lines.is_empty() {
            return Ok(());
        }
        // Which order the block answered does not matter in a file.
        let id = OrderId {
            session: 0,
            sequence: 0,
        };
        let reading = Reading::Log(block.clone());
        self.message(&BoardMessage::Reading { id, reading })
    }

    /// Completes the recording; returns the output.
    ///
    /// # Errors
    /// As [`RecordWriter::vehicle`].
    pub fn finish(self) -> io::Result<W> {
        match self.kind {
            Kind::Frames(out) => Ok(out),
            Kind::Mcap(writer, _) => writer.finish(),
        }
    }
}
