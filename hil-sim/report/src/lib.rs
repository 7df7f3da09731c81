//! Presentation of results: charts, tables, pages, JSON, progress bars, and errors with exit codes.
#![forbid(unsafe_code)]

pub mod colour;
pub mod columns;
pub mod error;
pub mod files;
pub mod html;
pub mod interactive;
pub mod meaning;
pub mod output;
pub mod plot;
pub mod reserve;
pub mod visible;
