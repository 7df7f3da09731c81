//! The page's work on the board's parameters: one question after the other, each answered before the next.

use std::collections::VecDeque;

use firmware::drive_board::SCALES;
use firmware::protocol::message::{ParameterAnswer, ParameterRequest};
use model::vehicle::VehicleParameters;
use serde::Serialize;
use vehicle_file::diff;
use virtual_board::link_client::{ANSWER_US, STORE_US};
use virtual_board::words::not_changed_words;

/// Number of repetitions of a read question whose answer does not come.
const AGAIN_MAX: u32 = 5;

/// A question that waits for its answer.
#[derive(Debug, Clone, Copy)]
struct OpenQuestion {
    sequence: u32,
    request: ParameterRequest,
    at_us: u64,
    times: u32,
}

/// The questions to come, the question that waits for its answer, and the part of the set that is known.
#[derive(Debug)]
pub struct ParameterWork {
    set: VehicleParameters<f32>,
    questions: VecDeque<ParameterRequest>,
    asked: Option<OpenQuestion>,
    questions_at_first: usize,
    /// Whether a store was requested, so that the set in force has changed since it was last read.
    stores: bool,
}

/// Progress of the work.
#[derive(Debug, PartialEq)]
pub enum WorkProgress {
    /// There is more to do.
    GoesOn,
    /// Everything is done; whether a set was stored.
    Done(bool),
    /// The board refused or did not answer; the reason.
    Failed(String),
}

impl ParameterWork {
    /// Reads every parameter of a set of this kind.
    pub fn reading(kind: &VehicleParameters<f32>) -> Self {
        let questions: VecDeque<_> = (0..kind.count())
            .map(|number| ParameterRequest::Read { number })
            .collect();
        Self::of(kind, questions)
    }

    /// Changes these parameters, stores the set and reads it back.
    pub fn changing(kind: &VehicleParameters<f32>, changes: &[(u16, f32)]) -> Self {
        let mut work = Self::reading(kind);
        work.questions.push_front(ParameterRequest::Store);
        for &(number, value) in changes.iter().rev() {
            work.questions.push_front(ParameterRequest::Write { number, value });
        }
        // Changes that an earlier host staged and abandoned must not be stored with these.
        work.questions.push_front(ParameterRequest::Discard);
        Self::of(kind, work.questions)
    }

    /// Restores the built-in set and reads it.
    pub fn built_in(kind: &VehicleParameters<f32>) -> Self {
        let mut work = Self::reading(kind);
        work.questions.push_front(ParameterRequest::Store);
        work.questions.push_front(ParameterRequest::BuiltIn);
        Self::of(kind, work.questions)
    }

    fn of(set: &VehicleParameters<f32>, questions: VecDeque<ParameterRequest>) -> Self {
        Self {
            set: *set,
            questions_at_first: questions.len(),
            stores: questions.contains(&ParameterRequest::Store),
            questions,
            asked: None,
        }
    }

    /// The set that was read.
    pub fn set(&self) -> VehicleParameters<f32> {
        self.set
    }

    /// The share of answered questions, 0 to 1.
    pub fn share(&self) -> f64 {
        let left = self.questions.len() + usize::from(self.asked.is_some());
        1.0 - left as f64 / self.questions_at_first.max(1) as f64
    }

    /// The question to ask at `now_us`, if any. The caller confirms it with [`Self::was_asked`].
    pub fn question(&mut self, now_us: u64) -> Option<ParameterRequest> {
        match self.asked {
            None => self.questions.front().copied(),
            Some(asked) if asked.overdue(now_us) && asked.can_be_repeated() => Some(asked.request),
            Some(_) => None,
        }
    }

    /// The question was asked as order `sequence`.
    pub fn was_asked(&mut self, sequence: u32, now_us: u64) {
        let (request, times) = match self.asked {
            Some(asked) => (Some(asked.request), asked.times + 1),
            None => (self.questions.pop_front(), 1),
        };
        self.asked = request.map(|request| OpenQuestion {
            sequence,
            request,
            at_us: now_us,
            times,
        });
    }

    /// The order that waits for its answer.
    pub fn awaited(&self) -> Option<u32> {
        self.asked.map(|asked| asked.sequence)
    }

    /// Takes the answer to the question.
    pub fn answered(&mut self, answer: &ParameterAnswer) -> WorkProgress {
        let Some(asked) = self.asked.take() else {
            return WorkProgress::GoesOn;
        };
        match (asked.request, answer) {
            (
                ParameterRequest::Read { number },
                ParameterAnswer::Value {
                    number: echoed, value, ..
                },
            ) if number == *echoed => {
                if self.set.set(number, *value).is_err() {
                    return WorkProgress::Failed(format!("the board's parameter {number} is {value}, out of range"));
                }
            }
            (
                ParameterRequest::Write { number, value },
                ParameterAnswer::Value {
                    number: echoed,
                    value: changed,
                    ..
                },
            ) if number == *echoed && value.to_bits() == changed.to_bits() => {}
            (ParameterRequest::Store, ParameterAnswer::Stored)
            | (ParameterRequest::Discard, ParameterAnswer::Discarded)
            | (ParameterRequest::BuiltIn, ParameterAnswer::BuiltInReady) => {}
            (_, ParameterAnswer::Inconsistent { number }) => return WorkProgress::Failed(self.contradiction(*number)),
            _ => return WorkProgress::Failed(not_changed_words(answer)),
        }
        if self.questions.is_empty() {
            WorkProgress::Done(self.stores)
        } else {
            WorkProgress::GoesOn
        }
    }

    /// Checks whether the board has failed to answer in time.
    pub fn late(&self, now_us: u64) -> WorkProgress {
        match self.asked {
            Some(asked) if asked.overdue(now_us) && !asked.can_be_repeated() => {
                WorkProgress::Failed("the board did not answer a question about parameters".to_owned())
            }
            _ => WorkProgress::GoesOn,
        }
    }

    fn contradiction(&self, number: u16) -> String {
        match self.set.field(number) {
            Some((table, field)) => format!("refused: the set contradicts itself at {table}.{}", field.name),
            None => not_changed_words(&ParameterAnswer::Inconsistent { number }),
        }
    }
}

impl OpenQuestion {
    fn overdue(&self, now_us: u64) -> bool {
        let within_us = if self.request == ParameterRequest::Store {
            STORE_US
        } else {
            ANSWER_US
        };
        now_us.saturating_sub(self.at_us) > within_us
    }

    /// Whether the question may be repeated: it only reads.
    fn can_be_repeated(&self) -> bool {
        matches!(self.request, ParameterRequest::Read { .. }) && self.times < AGAIN_MAX
    }
}

/// One parameter for the page.
#[derive(Debug, Serialize)]
pub struct ParameterRow {
    number: u16,
    table: &'static str,
    name: &'static str,
    meaning: &'static str,
    value: f32,
    /// The value as the vehicle file writes it.
    text: String,
    min: f64,
    max: f64,
    choices: &'static [&'static str],
}

/// Every parameter of a set, in order.
pub fn rows(set: &VehicleParameters<f32>) -> Vec<ParameterRow> {
    let row = |number| {
        let (table, field) = set.field(number)?;
        let value = set.value(number)?;
        Some(ParameterRow {
            number,
            table,
            name: field.name,
            meaning: field.meaning.trim(),
            value,
            text: field
                .choice(f64::from(value))
                .map_or_else(|| format!("{value}"), str::to_owned),
            min: field.min,
            max: field.max,
            choices: field.choices,
        })
    };
    (0..set.count()).filter_map(row).collect()
}

/// The parameters in which a vehicle file differs from `set`: number and the file's value.
///
/// # Errors
/// What is wrong with the file, or that its vehicle is of another kind.
pub fn differences(set: &VehicleParameters<f32>, file: &str) -> Result<Vec<(u16, f32)>, String> {
    let vehicle = vehicle_file::parse_vehicle_for("vehicle file", file, &SCALES.sensor_ranges());
    let wanted = vehicle.map_err(|error| error.to_string())?.parameters().cast::<f32>();
    if wanted.spar.is_some() != set.spar.is_some() {
        return Err("the file's vehicle is of another kind: one of the two has a spar, the other has none".to_owned());
    }
    let numbered = diff(set, &wanted)
        .into_iter()
        .filter_map(|difference| Some((set.number_of(difference.table, difference.name)?, difference.after?)));
    Ok(numbered.collect())
}
