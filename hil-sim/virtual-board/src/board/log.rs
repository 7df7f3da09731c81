//! The firmware's log on the host: lines with virtual time, kept separately per thread's vehicle.

use std::cell::RefCell;
use std::sync::Once;

use embassy_time::Instant;
use log::{LevelFilter, Log, Metadata, Record};

thread_local! {
    static LINES: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

struct Collector;

impl Log for Collector {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.target().starts_with("firmware")
    }

    fn log(&self, record: &Record<'_>) {
        if self.enabled(record.metadata()) {
            let us = Instant::now().as_micros();
            let line = format!(
                "{:>4}.{:06} {:<5} {}",
                us / 1_000_000,
                us % 1_000_000,
                record.level(),
                record.args()
            );
            LINES.with_borrow_mut(|lines| lines.push(line));
        }
    }

    fn flush(&self) {}
}

/// Collects the firmware's log from now on and discards the lines that this thread had collected.
pub fn start() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // If the process has another logger, that logger stays and no lines are collected here.
        if log::set_logger(&Collector).is_ok() {
            log::set_max_level(LevelFilter::Info);
        }
    });
    LINES.with_borrow_mut(Vec::clear);
}

/// Takes this thread's lines.
pub fn take() -> Vec<String> {
    LINES.with_borrow_mut(std::mem::take)
}
