//! Converts a board's messages over the link, stored as frames, into a file for other tools.

use std::io::{self, Write};

use firmware::protocol::frame::{Decoder, Received};
use firmware::protocol::message::{BoardMessage, Reading};

use crate::run::StatusStory;
use crate::writer::{RecordFormat, RecordWriter};

/// Writes the contents of `frames` as an MCAP file to `out`: identities, records, statuses with the events that they
/// show, and the log. `vehicle` is the text of the vehicle file of the set in force. Returns the output.
///
/// # Errors
/// The output cannot be written.
pub fn write_mcap<W: Write>(frames: &[u8], vehicle: Option<String>, out: W) -> io::Result<W> {
    let mut out = RecordWriter::new(RecordFormat::Mcap, out);
    let (mut vehicle, mut story, mut boot) = (vehicle, StatusStory::default(), None);
    let mut decoder = Decoder::new();
    let mut rest = frames;
    while let Some(received) = decoder.next_of(&mut rest) {
        let Received::Message(message) = received else {
            continue;
        };
        match message {
            BoardMessage::Identity(identity) => {
                let boots = boot
                    .replace(identity.about.boot)
                    .is_some_and(|boot| boot != identity.about.boot);
                if boots {
                    story.end().iter().try_for_each(|event| out.event(event))?;
                }
                out.identity(&identity)?;
                if boots {
                    out.event(&story.restart())?;
                }
                vehicle.take().map_or(Ok(()), |toml| out.vehicle(toml))?;
            }
            BoardMessage::Records(block) => out.block(block)?,
            BoardMessage::Status(status) => {
                out.status(&status.vehicle)?;
                let events = story.add(&status.vehicle);
                events.iter().try_for_each(|event| out.event(event))?;
            }
            BoardMessage::Reading {
                reading: Reading::Log(block),
                ..
            } => out.log_block(&block)?,
            BoardMessage::Answer { .. } | BoardMessage::Reading { .. } => {}
        }
    }
    story.end().iter().try_for_each(|event| out.event(event))?;
    out.finish()
}
