//! Errors of a campaign.

use thiserror::Error;

use crate::board::VirtualBoardError;
use crate::scenario::ScenarioError;

/// Why a campaign cannot run.
#[derive(Debug, Error)]
pub enum CampaignError {
    /// A scenario is wrong, with or without the overrides.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A vehicle is wrong, with or without the overrides.
    #[error(transparent)]
    Vehicle(#[from] vehicle_file::VehicleFileError),
    /// The board does not boot.
    #[error(transparent)]
    Board(#[from] VirtualBoardError),
    /// A file cannot be read.
    #[error("{0}: {1}")]
    Unreadable(String, String),
    /// An override is invalid.
    #[error("--set {0}: {1}")]
    Override(String, String),
    /// The campaign has more runs or combinations than allowed.
    #[error("{0}: allowed are at most {1}")]
    TooMany(&'static str, u64),
}
