//! What the page learns from some bytes of a board.

use firmware::protocol::message::{BoardStatus, Identity};
use serde::Serialize;
use virtual_board::link_client::LinkClient;

use crate::recording::RecordingCounts;

/// What the page learns from some bytes of the board.
#[derive(Debug, Serialize)]
pub struct Heard {
    /// Firmware, build and parameters of the board; none before it has said who it is.
    pub board: Option<String>,
    /// The protocol of a board of another version.
    pub foreign: Option<u16>,
    /// The statuses, in order.
    pub statuses: Vec<BoardStatus>,
    /// What a person should read.
    pub told: Vec<String>,
    /// New lines of the board's log.
    pub log: Vec<String>,
    /// This host gives orders.
    pub operates: bool,
    /// Share of the work on the parameters that is done; none if there is none.
    pub parameter_work: Option<f64>,
    /// How often the set was read whole.
    pub parameters_read: u32,
    /// What is recorded; none if there is no recording.
    pub recording: Option<RecordingCounts>,
    /// How good the link is.
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

/// Which firmware a board runs, in words.
pub fn board_words(identity: &Identity) -> String {
    let about = identity.about;
    let [major, minor, patch] = about.version;
    format!(
        "firmware {major}.{minor}.{patch}, build {:08x}, protocol {}",
        about.build, identity.protocol
    )
}
