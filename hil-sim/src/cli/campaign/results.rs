//! Files of results: the contents of their lines.

use std::io::Write as _;

use report::error::CommandError;
use report::files::NewFile;
use serde::{Deserialize, Serialize};
use theory::analysis::random_drive::SearchedLaw;
use virtual_board::campaign::CampaignIdentity;

/// The first line of a file of results.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Header {
    /// What was run.
    pub(super) campaign: CampaignKind,
    /// Range of run numbers; the end is excluded.
    pub(super) range: [u64; 2],
}

/// Writes `value` as a line of JSON.
pub(super) fn write_line(file: &mut NewFile, value: &impl Serialize) -> Result<(), CommandError> {
    let text = serde_json::to_string(value).map_err(|error| CommandError::Other(error.to_string()))?;
    Ok(writeln!(file, "{text}")?)
}

/// Kind of the campaign. The two kinds share only the fields `version`, `files` and `runs`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub(super) enum CampaignKind {
    /// Scenarios.
    Scenarios(CampaignIdentity),
    /// A search.
    Search(SearchIdentity),
}

impl CampaignKind {
    /// Number of lines after the first.
    pub(super) fn runs(&self) -> u64 {
        match self {
            Self::Scenarios(campaign) => campaign.runs,
            Self::Search(search) => search.runs,
        }
    }
}

/// Identity of a search: two searches with equal values are the same.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct SearchIdentity {
    /// Version of the program.
    pub(super) version: String,
    /// The vehicle's file.
    pub(super) vehicle: String,
    /// FNV-1a hash of its text.
    pub(super) files: String,
    /// The law.
    pub(super) law: SearchedLaw,
    /// Seed of the first drive.
    pub(super) first_seed: u64,
    /// Random drives.
    pub(super) drives: u64,
    /// Climbs per thousand drives.
    pub(super) climbs: u16,
    /// Vehicles with parameters up to 20 % off.
    pub(super) plants: u64,
    /// Number of lines, one per thousand drives.
    pub(super) runs: u64,
}
