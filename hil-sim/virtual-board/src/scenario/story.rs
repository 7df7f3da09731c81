//! The events of a run in order of time: modes, faults, refusals, and lasting conditions of the vehicle.

use std::fmt;

use model::sample::TICK_US;
use model::supervise::arming::Mode;
use model::supervise::codes::{FaultSet, Limit};
use serde::Serialize;

mod block;
mod power;
mod sight;
mod slide;
mod whirl;

pub use sight::Sight;

use block::BlockWitness;
use power::PowerWitness;
use slide::SlideWitness;
use whirl::WhirlWitness;

/// Largest number of stored events; further events are only counted.
pub const EVENTS_MAX: usize = 500;
/// Gap, s, below which two spells count as one spell: a wheel that slides in jerks slides.
pub const GAP_S: f64 = 0.2;

/// The kind of an event.
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
    /// The board restarted.
    Restart,
    /// The arm turned over.
    Whirl,
    /// A wheel slid.
    Slide,
    /// A wheel was off the ground.
    Flight,
    /// An obstacle blocked the vehicle.
    Stall,
    /// The vehicle passed the obstacle that had blocked it.
    Freed,
    /// The slope was steeper than the vehicle can drive up.
    Slope,
    /// A motor was hot, or drew more than its limit.
    Heat,
    /// The supply took no more power back.
    Supply,
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
            Self::Freed => "freed",
            Self::Slope => "slope",
            Self::Heat => "heat",
            Self::Supply => "supply",
        }
    }

    /// Whether the event is relevant to a person who looks only for trouble.
    pub fn is_trouble(self) -> bool {
        !matches!(self, Self::Mode | Self::Cleared | Self::Freed)
    }
}

/// An event of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StoryEvent {
    /// Time at which the event began, s since the start of the run.
    pub at_s: f64,
    /// Duration, s; `None` for an event without a duration.
    pub for_s: Option<f64>,
    /// The kind of the event.
    pub kind: EventKind,
    /// The event and its cause, in a sentence.
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

/// A condition that lasts: the test whether a row shows it, and the story's text for it.
struct Spell {
    kind: EventKind,
    shows: fn(Sight<'_>) -> bool,
    told: fn(&Span) -> String,
}

/// All conditions that the story reports with their duration.
const SPELLS: [Spell; 7] = [
    Spell {
        kind: EventKind::Slide,
        shows: |sight| sight.slides(),
        told: |span| span.slide.told(),
    },
    Spell {
        kind: EventKind::Flight,
        shows: |sight| sight.flies(),
        told: |_| "a wheel is off the ground".to_owned(),
    },
    Spell {
        kind: EventKind::Stall,
        shows: |sight| sight.status.limits.contains(Limit::Stall),
        told: |span| span.block.stall(),
    },
    Spell {
        kind: EventKind::Freed,
        shows: |sight| sight.status.limits.contains(Limit::Freed),
        told: |_| {
            "the wheels come past what held them up, and the law forgets the slope that it took it for".to_owned()
        },
    },
    Spell {
        kind: EventKind::Slope,
        shows: |sight| sight.status.limits.contains(Limit::SlopeLimit),
        told: |span| span.block.slope(),
    },
    Spell {
        kind: EventKind::Heat,
        shows: |sight| sight.status.limits.contains(Limit::MotorHeat),
        told: |span| span.power.heat(),
    },
    Spell {
        kind: EventKind::Supply,
        shows: |sight| sight.status.limits.contains(Limit::Regeneration),
        told: |span| span.power.supply(),
    },
];

/// A present spell: its beginning, the last time at which a row showed it, and the observations.
#[derive(Debug, Clone, Copy)]
struct Span {
    begin_s: f64,
    last_s: f64,
    slide: SlideWitness,
    block: BlockWitness,
    power: PowerWitness,
}

impl Span {
    fn begin(sight: Sight<'_>) -> Self {
        let begin_s = sight.time_s();
        let mut span = Self {
            begin_s,
            last_s: begin_s,
            slide: SlideWitness::default(),
            block: BlockWitness::default(),
            power: PowerWitness::default(),
        };
        span.see(sight);
        span
    }

    fn see(&mut self, sight: Sight<'_>) {
        self.last_s = sight.time_s();
        self.slide.see(sight);
        self.block.see(sight);
        self.power.see(sight);
    }
}

/// Collects the events row by row, with bounded memory use.
#[derive(Debug, Default)]
pub struct Story {
    events: Vec<StoryEvent>,
    dropped: u64,
    new: Vec<StoryEvent>,
    mode: Option<Mode>,
    faults: FaultSet,
    refused_arms: u32,
    tick: u32,
    whirled: bool,
    swing: WhirlWitness,
    spells: [Option<Span>; SPELLS.len()],
}

/// The events of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunStory {
    /// The events in the order of their beginnings.
    pub events: Vec<StoryEvent>,
    /// Number of events that were not stored.
    pub dropped: u64,
}

impl Story {
    /// Adds the next sight.
    pub fn add(&mut self, sight: Sight<'_>) {
        self.new.clear();
        let (status, time_s) = (sight.status, sight.time_s());
        if status.tick < self.tick {
            self.tell(time_s, EventKind::Restart, "the board restarts".to_owned());
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
        if let Some(truth) = sight.truth {
            self.swing.see(truth);
        }
        let over = sight.is_over();
        if over && !self.whirled {
            let text = sight
                .truth
                .map_or_else(|| "the arm turns over".to_owned(), |_| self.swing.told());
            self.tell(time_s, EventKind::Whirl, text);
        }
        self.whirled = over;
        for index in 0..SPELLS.len() {
            self.spell(index, sight);
        }
    }

    /// The events of the last sight, each once, including those that are only counted.
    pub fn new_events(&self) -> &[StoryEvent] {
        &self.new
    }

    /// The present spells, as if they ended now.
    pub fn under_way(&self) -> Vec<StoryEvent> {
        let spells = SPELLS.iter().zip(&self.spells);
        spells
            .filter_map(|(spell, span)| Some(spell_event(spell, span.as_ref()?)))
            .collect()
    }

    /// The story, including the present spells.
    pub fn told(mut self) -> RunStory {
        for event in self.under_way() {
            self.keep(event);
        }
        // A spell is added when it ends, but its time is that of its beginning.
        self.events.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
        RunStory {
            events: self.events,
            dropped: self.dropped,
        }
    }

    fn spell(&mut self, index: usize, sight: Sight<'_>) {
        let spell = &SPELLS[index];
        match (&mut self.spells[index], (spell.shows)(sight)) {
            (under_way @ None, true) => *under_way = Some(Span::begin(sight)),
            (Some(span), true) => span.see(sight),
            (Some(span), false) if sight.time_s() - span.last_s > GAP_S => {
                let event = spell_event(spell, span);
                self.spells[index] = None;
                self.keep(event);
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
        self.new.push(event.clone());
        if self.events.len() < EVENTS_MAX {
            self.events.push(event);
        } else {
            self.dropped += 1;
        }
    }
}

/// The event of a spell from its first to its last row. A row covers the time until the next row.
fn spell_event(spell: &Spell, span: &Span) -> StoryEvent {
    const ROW_S: f64 = 10.0 * TICK_US as f64 * 1e-6;
    StoryEvent {
        at_s: span.begin_s,
        for_s: Some(span.last_s - span.begin_s + ROW_S),
        kind: spell.kind,
        text: (spell.told)(span),
    }
}

#[cfg(test)]
mod tests;
