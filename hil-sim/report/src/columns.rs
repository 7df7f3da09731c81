//! Tables as CSV, for `--out`.

use std::fmt::Write as _;

/// Named columns of equal length.
#[derive(Debug, Clone, Default)]
pub struct Columns {
    columns: Vec<(String, Vec<f64>)>,
}

impl Columns {
    /// No columns.
    pub fn new() -> Self {
        Self::default()
    }

    /// The columns of `named`, in that order.
    pub fn named(named: &[(&str, &Vec<f64>)]) -> Self {
        let columns = named
            .iter()
            .map(|(name, values)| ((*name).to_owned(), (*values).clone()));
        Self {
            columns: columns.collect(),
        }
    }

    /// The table with one more column.
    #[must_use]
    pub fn with(mut self, name: impl Into<String>, values: impl Into<Vec<f64>>) -> Self {
        self.columns.push((name.into(), values.into()));
        self
    }

    /// Whether there are no columns.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// The table as CSV: a header line, then one line per row, every number with all its digits; cells
    /// beyond the end of a shorter column are empty.
    pub fn to_csv(&self) -> String {
        let mut text = self
            .columns
            .iter()
            .map(|(n, _)| n.as_str())
            .collect::<Vec<_>>()
            .join(",");
        text.push('\n');
        let rows = self.columns.iter().map(|(_, v)| v.len()).max().unwrap_or(0);
        for row in 0..rows {
            for (i, (_, values)) in self.columns.iter().enumerate() {
                let separator = if i == 0 { "" } else { "," };
                match values.get(row) {
                    Some(v) => _ = write!(text, "{separator}{v}"),
                    None => text.push_str(separator),
                }
            }
            text.push('\n');
        }
        text
    }
}
