//! The rows of a run: the trace as CSV, and the rows for the charts.

use std::io;

use virtual_board::scenario::trace::{COLUMNS, Trace, TraceRow};

/// Writes the first line of a trace as CSV: the columns' names.
///
/// # Errors
/// The errors of `out`.
pub fn write_header(out: &mut impl io::Write) -> io::Result<()> {
    let names: Vec<&str> = COLUMNS.iter().map(|(name, _)| *name).collect();
    writeln!(out, "{}", names.join(","))
}

/// Writes one row of a trace as CSV, every number with all its digits.
///
/// # Errors
/// The errors of `out`.
pub fn write_row(out: &mut impl io::Write, row: &TraceRow) -> io::Result<()> {
    for (i, (_, value)) in COLUMNS.iter().enumerate() {
        let separator = if i == 0 { "" } else { "," };
        write!(out, "{separator}{}", value(row))?;
    }
    writeln!(out)
}

/// Largest number of rows for the charts.
const CHART_ROWS_MAX: usize = 16_384;

/// The rows for the charts: all rows up to `CHART_ROWS_MAX`, which is 160 s; for a longer run every second, fourth,
/// ... row, so that the memory does not grow with the run.
#[derive(Debug)]
pub struct ChartRows {
    /// The stored rows.
    pub trace: Trace,
    /// One of this many rows is stored.
    pub stride: usize,
    seen: usize,
}

impl Default for ChartRows {
    fn default() -> Self {
        Self {
            trace: Trace::default(),
            stride: 1,
            seen: 0,
        }
    }
}

impl ChartRows {
    /// Takes the next row of the run.
    pub fn add(&mut self, row: &TraceRow) {
        if self.seen.is_multiple_of(self.stride) {
            if self.trace.rows.len() == CHART_ROWS_MAX {
                let mut index = 0;
                self.trace.rows.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
                self.stride *= 2;
            }
            if self.seen.is_multiple_of(self.stride) {
                self.trace.rows.push(*row);
            }
        }
        self.seen += 1;
    }
}

#[cfg(test)]
pub(super) mod tests {
    use report::plot::Columns;
    use virtual_board::scenario::{Scenario, VirtualBackend, run};

    use super::*;

    /// A row of a real run.
    pub(in crate::cli::drive) fn row() -> TraceRow {
        let scenario = Scenario::parse("row", "title = \"row\"\nduration_s = 0.5").expect("good");
        let vehicle = vehicle_file::reference().expect("good");
        let plant = scenario.plant(&vehicle).expect("drivable");
        let mut backend = VirtualBackend::boot(&vehicle, plant).expect("boots");
        let outcome = run(&scenario, &mut backend, |_| {}).expect("valid");
        *outcome.trace.rows.last().expect("rows")
    }

    #[test]
    fn the_rows_of_a_long_run_are_thinned_evenly_and_bounded() {
        let mut rows = ChartRows::default();
        let count = 3 * CHART_ROWS_MAX;
        let mut row = row();
        for index in 0..count {
            row.status.tick = index as u32;
            rows.add(&row);
            assert!(rows.trace.rows.len() <= CHART_ROWS_MAX);
        }
        assert_eq!(rows.stride, 4);
        let ticks: Vec<u32> = rows.trace.rows.iter().map(|row| row.status.tick).collect();
        let expected: Vec<u32> = (0..count as u32).step_by(4).collect();
        assert_eq!(ticks, expected);
    }

    #[test]
    fn rows_written_one_by_one_are_the_whole_table() {
        let trace = Trace { rows: vec![row(); 3] };
        let mut text = Vec::new();
        write_header(&mut text).expect("memory");
        for row in &trace.rows {
            write_row(&mut text, row).expect("memory");
        }
        let whole = COLUMNS.iter().fold(Columns::new(), |columns, (name, value)| {
            columns.with(*name, trace.values(value))
        });
        assert_eq!(String::from_utf8(text).expect("text"), whole.to_csv());
    }
}
