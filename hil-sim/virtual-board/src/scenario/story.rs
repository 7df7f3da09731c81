//! What happened in a run, told in order of time: modes, faults, refusals, and what the vehicle went through.

use std::fmt;

use model::sample::TICK_US;
use model::supervise::arming::Mode;
use model::supervise::codes::{FaultSet, Limit};
use serde::Serialize;

use super::trace::TraceRow;

/// Most events that are kept; the rest is counted.
pub const EVENTS_MAX: usize = 500;
/// Two spells with less between them are one, s: a wheel that slides in jerks slides.
pub const GAP_S: f64 = 0.2;

/// What kind of thing happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// The vehicle changed its mode.
    Mode,
    /// A fault was latched.
    Fault,
    /// The latched faults were cleared.
    Cleared,
    /// The vehicle refused to arm.
    Refusal,
    /// The board started anew.
    Restart,
    /// The arm turned over.
    Whirl,
    /// A wheel slid.
    Slide,
    /// A wheel was off the ground.
    Flight,
    /// Something blocked the vehicle.
    Stall,
    /// The slope was beyond what the vehicle can drive up.
    Slope,
}

impl EventKind {
    /// The kind in a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mode => "mode",
            Self::Fault => "fault",
            Self::Cleared => "cleared",
            Self::Refusal => "refusal",
            Self::Restart => "restart",
            Self::Whirl => "whirl",
            Self::Slide => "slide",
            Self::Flight => "flight",
            Self::Stall => "stall",
            Self::Slope => "slope",
        }
    }

    /// Whether a person who only looks for trouble wants to see it.
    pub fn is_trouble(self) -> bool {
        !matches!(self, Self::Mode | Self::Cleared)
    }
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StoryEvent {
    /// When it began, s since the start of the run.
    pub at_s: f64,
    /// How long it lasted, s; nothing for what has no length.
    pub for_s: Option<f64>,
    /// What kind of thing it was.
    pub kind: EventKind,
    /// What happened and why, in a sentence.
    pub text: String,
}

impl fmt::Display for StoryEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:>9.2} s  {:<8} {}", self.at_s, self.kind.name(), self.text)?;
        match self.for_s {
            Some(for_s) => write!(f, ", for {for_s:.2} s"),
            None => Ok(()),
        }
    }
}

/// Something that lasts: whether a row shows it, and how far it goes there.
struct Spell {
    kind: EventKind,
    text: &'static str,
    shows: fn(&TraceRow) -> bool,
}

/// Everything that lasts and is told with its length.
const SPELLS: [Spell; 4] = [
    Spell {
        kind: EventKind::Slide,
        text: "the wheels slide over the ground",
        shows: |row| row.truth.sliding != [false; 2],
    },
    Spell {
        kind: EventKind::Flight,
        text: "a wheel is off the ground",
        shows: |row| row.truth.lifted != [false; 2],
    },
    Spell {
        kind: EventKind::Stall,
        text: "Stall: told to drive, the vehicle is blocked",
        shows: |row| row.status.limits.contains(Limit::Stall),
    },
    Spell {
        kind: EventKind::Slope,
        text: "SlopeLimit: the slope is beyond what the arm's weight or the grip can hold",
        shows: |row| row.status.limits.contains(Limit::SlopeLimit),
    },
];

/// Collects what happened row by row, in memory that does not grow without bound.
#[derive(Debug, Default)]
pub struct Story {
    events: Vec<StoryEvent>,
    dropped: u64,
    mode: Option<Mode>,
    faults: FaultSet,
    refused_arms: u32,
    tick: u32,
    whirled: bool,
    /// Of each spell under way: its begin and the last time it showed.
    spells: [Option<(f64, f64)>; SPELLS.len()],
}

/// What happened in a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunStory {
    /// In order of the time at which it began.
    pub events: Vec<StoryEvent>,
    /// How much more there was.
    pub dropped: u64,
}

impl Story {
    /// Takes the next row of the run.
    pub fn add(&mut self, row: &TraceRow) {
        let (status, time_s) = (&row.status, row.time_s());
        if status.tick < self.tick {
            self.tell(time_s, EventKind::Restart, "the board starts anew".to_owned());
            self.refused_arms = 0;
            self.faults = FaultSet::EMPTY;
        }
        self.tick = status.tick;
        let new = FaultSet::from_bits(status.faults.bits() & !self.faults.bits());
        for fault in new.iter() {
            let text = format!("{}: {}", fault.name(), fault.meaning().trim());
            self.tell(time_s, EventKind::Fault, text);
        }
        if status.faults.is_empty() && !self.faults.is_empty() {
            self.tell(time_s, EventKind::Cleared, format!("cleared: {}", self.faults));
        }
        self.faults = status.faults;
        if status.refused_arms > self.refused_arms {
            let text = format!("not armed: {}", status.blockers);
            self.tell(time_s, EventKind::Refusal, text);
        }
        self.refused_arms = status.refused_arms;
        if self.mode.is_some_and(|mode| mode != status.mode) {
            let text = match status.mode {
                Mode::Armed => "armed",
                Mode::Stopping => "a controlled stop begins",
                Mode::Disarmed => "disarmed, the bridges are open",
            };
            self.tell(time_s, EventKind::Mode, text.to_owned());
        }
        self.mode = Some(status.mode);
        let over = row.truth.phi_rad.abs() > core::f64::consts::PI;
        if over && !self.whirled {
            self.tell(time_s, EventKind::Whirl, "the arm turns over".to_owned());
        }
        self.whirled = over;
        for index in 0..SPELLS.len() {
            self.spell(index, time_s, row);
        }
    }

    /// Takes what is over by now.
    pub fn take(&mut self) -> Vec<StoryEvent> {
        std::mem::take(&mut self.events)
    }

    /// What happened, with what is still under way.
    pub fn told(mut self) -> RunStory {
        for (spell, spans) in SPELLS.iter().zip(self.spells) {
            if let Some((begin_s, last_s)) = spans {
                self.keep(spell_event(spell, begin_s, last_s));
            }
        }
        // A spell is told when it ends, but stands where it began.
        self.events.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        RunStory {
            events: self.events,
            dropped: self.dropped,
        }
    }

    fn spell(&mut self, index: usize, time_s: f64, row: &TraceRow) {
        let spell = &SPELLS[index];
        match (self.spells[index], (spell.shows)(row)) {
            (None, true) => self.spells[index] = Some((time_s, time_s)),
            (Some((begin_s, _)), true) => self.spells[index] = Some((begin_s, time_s)),
            (Some((begin_s, last_s)), false) if time_s - last_s > GAP_S => {
                self.spells[index] = None;
                self.keep(spell_event(spell, begin_s, last_s));
            }
            _ => {}
        }
    }

    fn tell(&mut self, at_s: f64, kind: EventKind, text: String) {
        self.keep(StoryEvent {
            at_s,
            for_s: None,
            kind,
            text,
        });
    }

    fn keep(&mut self, event: StoryEvent) {
        if self.events.len() < EVENTS_MAX {
            self.events.push(event);
        } else {
            self.dropped += 1;
        }
    }
}

/// A spell from its first row to its last: a row stands for the time to the next.
fn spell_event(spell: &Spell, begin_s: f64, last_s: f64) -> StoryEvent {
    const ROW_S: f64 = 10.0 * TICK_US as f64 * 1e-6;
    StoryEvent {
        at_s: begin_s,
        for_s: Some(last_s - begin_s + ROW_S),
        kind: spell.kind,
        text: spell.text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use firmware::protocol::message::LinkCounters;
    use model::status::Status;
    use model::supervise::codes::{Blocker, BlockerSet, Fault, LimitSet};
    use plant::Truth;

    use super::*;

    /// A row at a tick of 1 ms, changed as `change` says.
    fn row(tick: u32, change: impl FnOnce(&mut TraceRow)) -> TraceRow {
        let mut row = TraceRow {
            commanded: [0.0; 2],
            status: Status {
                tick,
                time_us: u64::from(tick) * 1000,
                ..Status::default()
            },
            link: LinkCounters::default(),
            truth: Truth::default(),
            bridges_on: false,
        };
        change(&mut row);
        row
    }

    fn told(rows: impl IntoIterator<Item = TraceRow>) -> RunStory {
        let mut story = Story::default();
        for row in rows {
            story.add(&row);
        }
        story.told()
    }

    #[test]
    fn a_fault_a_refusal_and_a_mode_are_told_with_time_and_reason() {
        let mut faults = FaultSet::EMPTY;
        faults.insert(Fault::ImuStale);
        let mut blockers = BlockerSet::EMPTY;
        blockers.insert(Blocker::NotAtRest);
        let told = told([
            row(10, |_| {}),
            row(20, |row| {
                row.status.refused_arms = 1;
                row.status.blockers = blockers;
            }),
            row(30, |row| {
                row.status.refused_arms = 1;
                row.status.mode = Mode::Armed;
            }),
            row(40, |row| {
                row.status.refused_arms = 1;
                row.status.faults = faults;
            }),
            row(50, |row| row.status.refused_arms = 1),
        ]);
        let lines: Vec<_> = told.events.iter().map(StoryEvent::to_string).collect();
        let expected = [
            "     0.02 s  refusal  not armed: NotAtRest",
            "     0.03 s  mode     armed",
            "     0.04 s  fault    ImuStale: The arm IMU gave no sample in time.",
            "     0.04 s  mode     disarmed, the bridges are open",
            "     0.05 s  cleared  cleared: ImuStale",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn a_slide_in_jerks_is_one_and_a_later_one_another() {
        let slides = |tick: u32| (100..200).contains(&tick) || (350..360).contains(&tick) || tick >= 900;
        let told = told((0..100).map(|n| {
            row(n * 10, |row| {
                row.truth.sliding = [slides(n * 10), false];
                if n == 50 {
                    row.status.limits = LimitSet::EMPTY;
                    row.status.limits.insert(Limit::Stall);
                }
            })
        }));
        let spans: Vec<_> = told.events.iter().map(|e| (e.kind, e.at_s, e.for_s)).collect();
        let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert_eq!(spans.len(), 3, "{spans:?}");
        assert!(spans[0].0 == EventKind::Slide && near(spans[0].1, 0.1) && near(spans[0].2.unwrap_or(0.0), 0.26));
        assert!(spans[1].0 == EventKind::Stall && near(spans[1].1, 0.5) && near(spans[1].2.unwrap_or(0.0), 0.01));
        assert!(spans[2].0 == EventKind::Slide && near(spans[2].1, 0.9) && near(spans[2].2.unwrap_or(0.0), 0.1));
    }

    #[test]
    fn a_whirl_is_told_once_a_turn_and_a_restart_once() {
        let told = told([
            row(10, |_| {}),
            row(20, |row| row.truth.phi_rad = 3.2),
            row(30, |row| row.truth.phi_rad = 4.0),
            row(5, |row| row.status.time_us = 40_000),
        ]);
        let kinds: Vec<_> = told.events.iter().map(|event| event.kind).collect();
        assert_eq!(kinds, [EventKind::Whirl, EventKind::Restart]);
    }

    #[test]
    fn what_is_too_much_is_counted() {
        let modes = [Mode::Armed, Mode::Disarmed];
        let told = told((0..EVENTS_MAX as u32 + 11).map(|n| row(n, |row| row.status.mode = modes[n as usize % 2])));
        assert_eq!((told.events.len(), told.dropped), (EVENTS_MAX, 10));
    }
}
