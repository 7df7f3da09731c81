//! Vehicle files.
