//! The status in words: a line each half second, and all of what the vehicle reports if it is asked for.

use std::fmt::Write as _;
use std::io::Write;

use firmware::hardware::ClockSource;
use firmware::protocol::message::{BoardStatus, Identity, LinkCounters, TickCycles};
use model::status::{Status, Terms};
use model::supervise::arming::Mode;
use report::colour::{bad, doubtful};
use report::error::CommandError;

use super::console::Console;
use super::session::Link;
use super::wire::Wire;

/// Time between two displays of the status, us.
pub(super) const SHOW_US: u64 = 500_000;

/// Extent of the displayed status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StatusDetail {
    /// One line.
    Line,
    /// The line; below it place, spar, motors, limits and the terms of the laws.
    All,
}

impl<W: Wire> Link<W> {
    /// Shows the status every half second.
    ///
    /// # Errors
    /// The board falls silent, or the output is closed.
    pub fn show<O: Write>(
        &mut self,
        seconds: f64,
        detail: StatusDetail,
        console: &mut Console<O>,
    ) -> Result<(), CommandError> {
        let from_us = self.wire.now_us();
        let until_us = from_us + (seconds * 1e6) as u64;
        let mut next_us = from_us;
        // A firmware with other parameters than this tool's may have a spar.
        let with_spar = self.has_spar().unwrap_or(true);
        while self.wire.now_us() < until_us && self.interrupts() == 0 {
            let status = self.fresh_status()?;
            if self.wire.now_us() >= next_us {
                console.coloured_line(&line(&status))?;
                if detail == StatusDetail::All {
                    for line in more_lines(&status, with_spar) {
                        console.line(&line)?;
                    }
                }
                next_us += SHOW_US;
            }
        }
        Ok(())
    }
}

/// One line with the board's identity.
pub(in crate::cli) fn who(identity: &Identity) -> String {
    let about = identity.about;
    let [major, minor, patch] = about.version;
    format!(
        "firmware {major}.{minor}.{patch}, build {:08x}, parameters {:08x}, protocol {}",
        about.build, about.schema, identity.protocol
    )
}

/// One line of status.
pub(super) fn line(status: &BoardStatus) -> String {
    let BoardStatus {
        vehicle, link, clock, ..
    } = status;
    format!(
        "{}: {:.2} m/s, phi {:.1} deg, slope {:.1} deg, {:.1} V; faults {}{}; link: {}{}",
        vehicle.mode.name(),
        vehicle.estimate.speed_m_s,
        vehicle.estimate.phi_rad.to_degrees(),
        vehicle.estimate.slope_rad.to_degrees(),
        vehicle.battery_v,
        if vehicle.faults.is_empty() {
            vehicle.faults.to_string()
        } else {
            bad(vehicle.faults)
        },
        blockers(vehicle),
        link_line(link),
        match clock {
            ClockSource::External => "",
            ClockSource::Internal => "; no external clock",
        },
    )
}

/// What the board's end of the link has counted since the boot: its frames, and of what went wrong what there was.
fn link_line(link: &LinkCounters) -> String {
    let mut line = format!("{} frames", link.frames);
    for (count, what) in [
        (link.unreadable_frames(), "unreadable"),
        (link.uart_errors, "UART errors"),
        (link.repeated_frames, "repeated"),
        (link.foreign_frames, "foreign"),
        (link.late_orders, "late"),
        (link.dropped_requests, "requests dropped"),
        (link.dropped_answers, "answers dropped"),
    ] {
        if count > 0 {
            _ = write!(line, ", {}", doubtful(format!("{count} {what}")));
        }
    }
    line
}

/// The blockers of a vehicle that is not armed. For an armed vehicle the blockers have no meaning.
fn blockers(vehicle: &Status) -> String {
    match (vehicle.mode, vehicle.blockers.is_empty()) {
        (Mode::Armed | Mode::Stopping, _) => String::new(),
        (Mode::Disarmed, true) => format!("; blockers {}", vehicle.blockers),
        (Mode::Disarmed, false) => format!("; blockers {}", doubtful(vehicle.blockers)),
    }
}

/// The other reports of the vehicle, one line per group; those of the spar only if there is a spar.
fn more_lines(status: &BoardStatus, with_spar: bool) -> Vec<String> {
    let vehicle = &status.vehicle;
    let estimate = &vehicle.estimate;
    let motors = |values: [f32; 3], unit: &str| {
        let [left, right, ballast] = values;
        let ballast = if with_spar {
            format!(", ballast {ballast:.2} {unit}")
        } else {
            String::new()
        };
        format!("left {left:.2} {unit}, right {right:.2} {unit}{ballast}")
    };
    let [speed_terms, steering_terms, spar_terms] = term_lines(&vehicle.terms);
    let place = format!(
        "  place: distance {:.3} m, x {:.3} m, y {:.3} m, heading {:.1} deg, yaw rate {:.3} rad/s",
        estimate.distance_m,
        estimate.x_m,
        estimate.y_m,
        estimate.heading_rad.to_degrees(),
        estimate.yaw_rate_rad_s
    );
    let spar = format!(
        "  spar: {:.2} deg, ballast {:.2} deg",
        estimate.spar_rad.to_degrees(),
        estimate.ballast_rad.to_degrees()
    );
    [
        Some(place),
        with_spar.then_some(spar),
        Some(format!("  currents: {}", motors(vehicle.current_a, "A"))),
        Some(format!("  voltages: {}", motors(vehicle.voltage_v, "V"))),
        Some(format!("  limits: {}", vehicle.limits)),
        Some(format!(
            "  ticks: {}, {} late",
            cycle_words(&status.cycles),
            vehicle.late_ticks
        )),
        Some(speed_terms),
        Some(steering_terms),
        with_spar.then_some(spar_terms),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// The cost of a tick, where the board counts cycles.
fn cycle_words(cycles: &TickCycles) -> String {
    if cycles.are_counted() {
        format!("{} cycles, worst {}", cycles.total, cycles.worst)
    } else {
        "- cycles (this board counts none)".to_owned()
    }
}

/// The terms of the three laws, V.
fn term_lines(terms: &Terms) -> [String; 3] {
    let Terms { speed, steering, spar } = terms;
    let line = |law: &str, terms: &[(&str, f32)]| {
        let terms: Vec<String> = terms.iter().map(|(name, volts)| format!("{name} {volts:.2}")).collect();
        format!("  terms of the {law} law, V: {}", terms.join(", "))
    };
    [
        line(
            "speed",
            &[
                ("feed-forward", speed.feed_forward_v),
                ("weight", speed.weight_v),
                ("speed feedback", speed.speed_feedback_v),
                ("swing rate", speed.swing_rate_v),
                ("swing damping", speed.swing_damping_v),
                ("friction", speed.friction_v),
                ("guard", speed.guard_v),
                ("trim", speed.trim_v),
                ("governed", speed.governed_v),
            ],
        ),
        line(
            "steering",
            &[
                ("feed-forward", steering.feed_forward_v),
                ("proportional", steering.proportional_v),
                ("integral", steering.integral_v),
                ("hold", steering.hold_v),
            ],
        ),
        line(
            "spar",
            &[
                ("spar", spar.spar_v),
                ("ballast", spar.ballast_v),
                ("spar rate", spar.spar_rate_v),
                ("ballast rate", spar.ballast_rate_v),
                ("feed-forward", spar.feed_forward_v),
            ],
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::supervise::codes::{Blocker, BlockerSet};

    #[test]
    fn cycles_that_nobody_counted_are_no_number() {
        let counted = TickCycles {
            total: 41_000,
            worst: 52_000,
            ..TickCycles::default()
        };
        assert_eq!(cycle_words(&counted), "41000 cycles, worst 52000");
        let told = cycle_words(&TickCycles::default());
        assert!(told.starts_with("- ") && !told.contains('0'), "{told}");
    }

    #[test]
    fn blockers_are_told_only_of_a_vehicle_that_could_be_armed() {
        let mut vehicle = Status::default();
        vehicle.blockers.insert(Blocker::NotAtRest);
        for (mode, told) in [(Mode::Disarmed, true), (Mode::Armed, false), (Mode::Stopping, false)] {
            vehicle.mode = mode;
            assert_eq!(blockers(&vehicle).contains("NotAtRest"), told, "{mode:?}");
        }
        vehicle.mode = Mode::Disarmed;
        vehicle.blockers = BlockerSet::EMPTY;
        assert_eq!(blockers(&vehicle), "; blockers none");
    }
}
