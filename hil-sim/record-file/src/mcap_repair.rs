//! Rewrites a truncated MCAP file with its end: the index by which other tools find what it contains.

use std::io::{self, Write};

use mcap::records::Record;
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, Writer};

use crate::mcap_reader::{ChunkCoding, each_record};
use crate::mcap_writer::not_written;

/// Writes what is whole in the MCAP file `bytes` to `out`, message by message, with an index; returns the output and the number
/// of messages. `None` if the file is not MCAP, or if its chunks are compressed.
///
/// # Errors
/// The output cannot be written.
pub fn repair<W: Write>(bytes: &[u8], out: W) -> io::Result<Option<(W, u64)>> {
    let options = WriteOptions::new()
        .compression(None)
        .disable_seeking(true)
        .library("hil-sim");
    let mut writer = options.create(NoSeek::new(out)).map_err(not_written)?;
    let mut messages = 0;
    let mut written = Ok(());
    let coding = each_record(bytes, |record| {
        if written.is_ok() {
            written = copy(&mut writer, record).map(|count| messages += count);
        }
    });
    written.map_err(not_written)?;
    if coding != Some(ChunkCoding::Plain) {
        return Ok(None);
    }
    writer.finish().map_err(not_written)?;
    Ok(Some((writer.into_inner().into_inner(), messages)))
}

/// Copies one record; returns the number of messages in it. A damaged file may have a message or a channel that refers to
/// nothing, or contradicts another: it is left out.
fn copy<W: Write>(writer: &mut Writer<NoSeek<W>>, record: Record<'_>) -> Result<u64, McapError> {
    let copied = match record {
        Record::Schema { header, data } => writer
            .add_schema_with_id(header.id, &header.name, &header.encoding, &data)
            .map(|_| 0),
        Record::Channel(channel) => writer
            .add_channel_with_id(
                channel.id,
                channel.schema_id,
                &channel.topic,
                &channel.message_encoding,
                &channel.metadata,
            )
            .map(|_| 0),
        Record::Message { header, data } => writer.write_to_known_channel(&header, &data).map(|()| 1),
        Record::Metadata(metadata) => writer.write_metadata(&metadata).map(|()| 0),
        _ => Ok(0),
    };
    match copied {
        Err(McapError::Io(error)) => Err(McapError::Io(error)),
        Err(_) => Ok(0),
        copied => copied,
    }
}
