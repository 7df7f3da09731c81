//! The content of bytes from a board, for the page.

use firmware::protocol::message::{BoardStatus, Identity};
use serde::Serialize;
use virtual_board::link_client::LinkClient;

use crate::recording::RecordingCounts;

/// The content of bytes from the board, for the page.
#[derive(Debug, Serialize)]
pub struct Heard {
    /// Firmware, build and parameters of the board; `None` before the board has sent its identity.
    pub board: Option<String>,
    /// The protocol version of the board, if it differs from this host's.
    pub foreign: Option<u16>,
    /// The statuses, in order.
    pub statuses: Vec<BoardStatus>,
    /// Messages for the operator.
    pub told: Vec<String>,
    /// New lines of the board's log.
    pub log: Vec<String>,
    /// Whether this host gives orders.
    pub operates: bool,
    /// Finished share of the work on the parameters; `None` without such work.
    pub parameter_work: Option<f64>,
    /// Number of complete reads of the set.
    pub parameters_read: u32,
    /// Counts of the recording; `None` without a recording.
    pub recording: Option<RecordingCounts>,
    /// Quality of the link.
    pub quality: HostCounters,
}

/// Counters of the host's end of the link.
#[derive(Debug, Serialize)]
pub struct HostCounters {
    bytes: u64,
    messages: u64,
    unreadable_frames: u64,
    repeated_statuses: u64,
    unidentified: u64,
}

impl HostCounters {
    /// The counters of `client`.
    pub fn of(client: &LinkClient) -> Self {
        Self {
            bytes: client.bytes,
            messages: client.messages,
            unreadable_frames: client.unreadable_frames,
            repeated_statuses: client.repeated_statuses,
            unidentified: client.unidentified,
        }
    }
}

/// A board's firmware, as text for people.
pub fn board_words(identity: &Identity) -> String {
    let about = identity.about;
    let [major, minor, patch] = about.version;
    format!(
        "firmware {major}.{minor}.{patch}, build {:08x}, protocol {}",
        about.build, identity.protocol
    )
}
