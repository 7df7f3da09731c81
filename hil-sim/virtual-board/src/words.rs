//! The board's refusals and log lines in words for an operator.

use firmware::events::{Event, Line};
use firmware::protocol::message::{ParameterAnswer, Refusal, UpdateRefusal};
use model::supervise::codes::Fault;

/// The meaning of a refusal in words.
pub fn refusal_words(refusal: Refusal) -> String {
    match refusal {
        Refusal::UnknownSession => "refused: another host drives the board, or the board has booted since".into(),
        Refusal::Late => "refused: the order reached the board too late; the link is slow".into(),
        Refusal::Busy => "refused: the board is busy with earlier orders".into(),
        Refusal::Blocked(blockers) => format!("not armed: blocked by {blockers}"),
        Refusal::Stopping => "not armed: the vehicle is making a controlled stop".into(),
        Refusal::Disarmed => "not armed: a Disarm came at the same time".into(),
        Refusal::NotDisarmed => "refused: the vehicle is not disarmed".into(),
        Refusal::StatusRate { max_hz } => format!("refused: the line carries {max_hz} statuses per second at most"),
    }
}

/// The board's answer to a refused change of parameters, in words.
pub fn not_changed_words(answer: &ParameterAnswer) -> String {
    match answer {
        ParameterAnswer::Armed => "refused: the vehicle is armed".into(),
        ParameterAnswer::FlashFailed => "the board's flash failed; the set in force stays".into(),
        ParameterAnswer::OutOfRange { min, max } => format!("refused: allowed is {min} to {max}"),
        ParameterAnswer::Inconsistent { number } => {
            format!("refused: the set contradicts itself at parameter {number} of `parameters list`, counted from 0")
        }
        other => format!("refused: {other:?}"),
    }
}

/// Why the board refuses to continue an update, in words.
pub fn update_refusal_words(refusal: UpdateRefusal) -> String {
    match refusal {
        UpdateRefusal::NotDisarmed => "refused: the vehicle is not disarmed".into(),
        UpdateRefusal::LowSupply => {
            "refused: the battery is outside its range, or the board's own supply is low; charge or connect it".into()
        }
        UpdateRefusal::WrongBoard { board } => format!("refused: the image is for another board than this, {board}"),
        UpdateRefusal::WrongSize { max } => format!("refused: the board has room for an image of {max} bytes"),
        UpdateRefusal::WrongChecksum => {
            "refused: what the board has stored is not the file's image; send it again".into()
        }
        UpdateRefusal::OutOfOrder { next } => format!("refused: the board waits for byte {next}"),
        UpdateRefusal::NotBegun => "refused: the board has restarted meanwhile; send the image again".into(),
        UpdateRefusal::OnTrial => "refused: the board's firmware is on trial; wait until it is confirmed".into(),
        UpdateRefusal::SelfTest => "refused: the board's self-test has failed; `link log` tells why".into(),
        UpdateRefusal::FlashFailed => "the board's flash failed; the firmware that runs stays".into(),
        UpdateRefusal::WrongPlace { start } => {
            format!("refused: the image is linked for another address than this board's, {start:#010x}; rebuild it")
        }
        UpdateRefusal::NoRoom => "refused: this board has no place for an update; flash it with a probe".into(),
    }
}

/// A fault's number and name.
pub fn fault_name(number: u8) -> String {
    match Fault::ALL.iter().find(|fault| **fault as u8 == number) {
        Some(fault) => format!("fault {number}: {}", fault.name()),
        None => format!("fault {number}"),
    }
}

/// One line of the log in words.
pub fn log_line(line: &Line) -> String {
    let what = event_words(line.event);
    format!("{:>4}.{:06} {what}", line.time_us / 1_000_000, line.time_us % 1_000_000)
}

/// Whether a log line is relevant to a person who looks only for trouble.
pub fn is_trouble(event: Event) -> bool {
    match event {
        Event::Booted(_)
        | Event::Calibrated
        | Event::Mode(_)
        | Event::SetStored
        | Event::ImuStarted(_)
        | Event::SetMigrated { .. } => false,
        Event::InternalClock
        | Event::Crashed
        | Event::Fault(_)
        | Event::NotArmed(_)
        | Event::FlashFailed
        | Event::ImuLost(_)
        | Event::ImuNotStarted(_)
        | Event::SetLost => true,
    }
}

/// A log line's event in words.
pub fn event_words(event: Event) -> String {
    match event {
        Event::Booted(cause) => format!("booted, reset by {}", cause.name()),
        Event::InternalClock => "no external clock: the board runs from its own oscillator".into(),
        Event::Crashed => "the last run ended in a panic or a hardware fault".into(),
        Event::Calibrated => "gyros calibrated".into(),
        Event::Mode(mode) => mode.name().into(),
        Event::Fault(number) => fault_name(number),
        Event::NotArmed(blockers) => format!("not armed: blocked by {blockers}"),
        Event::SetStored => "parameters: new set stored and in force".into(),
        Event::FlashFailed => "parameters: not stored, the flash failed".into(),
        Event::ImuStarted(place) => format!("{} IMU: started", place.name()),
        Event::ImuLost(place) => format!("{} IMU: no samples, restarting", place.name()),
        Event::ImuNotStarted(place) => format!("{} IMU: does not start", place.name()),
        Event::SetMigrated { as_built_in, dropped } => format!(
            "parameters: set of another firmware, read by name: {as_built_in} new ones as built in, {dropped} unknown ones \
             dropped"
        ),
        Event::SetLost => "parameters: the stored set cannot be believed, built-in set, arming is blocked".into(),
    }
}
