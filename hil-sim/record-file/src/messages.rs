//! The messages of the typed channels of an MCAP file, as JSON, each with its JSON schema.

use model::estimate::Estimate;
use model::sample::MOTORS;
use model::status::{Status, Terms};
use model::supervise::codes::{Blocker, Fault, Limit};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::log_line::{LogLevel, LogLine};

/// The vehicle's status without the terms of the laws, which have their own channel.
#[derive(Debug, Serialize)]
pub struct StatusMessage {
    tick: u32,
    time_s: f64,
    mode: &'static str,
    faults: Vec<&'static str>,
    blockers: Vec<&'static str>,
    limits: Vec<&'static str>,
    estimate: Estimate,
    speed_reference_m_s: f32,
    yaw_rate_reference_rad_s: f32,
    voltage_v: [f32; MOTORS],
    current_a: [f32; MOTORS],
    battery_v: f32,
    late_ticks: u32,
    refused_arms: u32,
}

impl From<&Status> for StatusMessage {
    fn from(status: &Status) -> Self {
        Self {
            tick: status.tick,
            time_s: status.time_us as f64 * 1e-6,
            mode: status.mode.name(),
            faults: status.faults.iter().map(Fault::name).collect(),
            blockers: status.blockers.iter().map(Blocker::name).collect(),
            limits: status.limits.iter().map(Limit::name).collect(),
            estimate: status.estimate,
            speed_reference_m_s: status.speed_reference_m_s,
            yaw_rate_reference_rad_s: status.yaw_rate_reference_rad_s,
            voltage_v: status.voltage_v,
            current_a: status.current_a,
            battery_v: status.battery_v,
            late_ticks: status.late_ticks,
            refused_arms: status.refused_arms,
        }
    }
}

/// An event.
#[derive(Debug, Default, Serialize)]
pub struct EventMessage<'a> {
    /// Start of the event, s since the board's boot.
    pub at_s: f64,
    /// Duration of the event, s; 0 for an instantaneous event.
    pub for_s: f64,
    /// Kind of the event, one word.
    pub kind: &'a str,
    /// What happened and why, in a sentence.
    pub text: &'a str,
}

/// A line of the log, as `foxglove.Log`, which robotics tools show as text.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct LogMessage {
    timestamp: Timestamp,
    level: u8,
    message: String,
    name: String,
    file: String,
    line: u32,
}

#[derive(Debug, Default, Serialize, Deserialize)]
struct Timestamp {
    sec: u32,
    nsec: u32,
}

/// Levels of `foxglove.Log`.
const INFO: u8 = 2;
const WARNING: u8 = 3;
const ERROR: u8 = 4;

impl From<&LogLine> for LogMessage {
    fn from(line: &LogLine) -> Self {
        Self {
            timestamp: Timestamp {
                sec: (line.time_us / 1_000_000) as u32,
                nsec: (line.time_us % 1_000_000) as u32 * 1000,
            },
            level: match line.level {
                LogLevel::Info => INFO,
                LogLevel::Warning => WARNING,
                LogLevel::Error => ERROR,
            },
            message: line.text.clone(),
            name: "firmware".to_owned(),
            file: String::new(),
            line: 0,
        }
    }
}

impl From<LogMessage> for LogLine {
    fn from(message: LogMessage) -> Self {
        Self {
            time_us: u64::from(message.timestamp.sec) * 1_000_000 + u64::from(message.timestamp.nsec) / 1000,
            level: match message.level {
                ERROR.. => LogLevel::Error,
                WARNING => LogLevel::Warning,
                _ => LogLevel::Info,
            },
            text: message.message,
        }
    }
}

/// A typed channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TypedChannel {
    /// The vehicle's status, [`StatusMessage`].
    Status,
    /// The terms of the control laws, V, [`Terms`].
    Terms,
    /// Events, [`EventMessage`].
    Events,
    /// The board's log, [`LogMessage`].
    Log,
}

impl TypedChannel {
    /// Every channel.
    pub const ALL: [Self; 4] = [Self::Status, Self::Terms, Self::Events, Self::Log];

    /// The channel's topic.
    pub fn topic(self) -> &'static str {
        match self {
            Self::Status => "/status",
            Self::Terms => "/terms",
            Self::Events => "/events",
            Self::Log => "/log",
        }
    }

    /// The name of the channel's schema.
    pub fn schema_name(self) -> &'static str {
        match self {
            Self::Status => "biplanar.Status",
            Self::Terms => "biplanar.Terms",
            Self::Events => "biplanar.Event",
            Self::Log => "foxglove.Log",
        }
    }

    /// The JSON schema of the channel's messages. The schema is derived from an example message, so the
    /// two cannot differ.
    ///
    /// # Errors
    /// A message that cannot be encoded as JSON, which does not happen.
    pub fn schema(self) -> serde_json::Result<Value> {
        let status = Status::default();
        let example = match self {
            Self::Status => serde_json::to_value(StatusMessage::from(&status)),
            Self::Terms => serde_json::to_value(Terms::default()),
            Self::Events => serde_json::to_value(EventMessage::default()),
            Self::Log => serde_json::to_value(LogMessage::default()),
        }?;
        let mut schema = schema_of(&example);
        schema["title"] = self.schema_name().into();
        Ok(schema)
    }
}

/// The schema of values like `example`. A list that may be empty is a list of names.
fn schema_of(example: &Value) -> Value {
    match example {
        Value::Null => json!({}),
        Value::Bool(_) => json!({ "type": "boolean" }),
        Value::Number(number) if number.is_f64() => json!({ "type": "number" }),
        Value::Number(_) => json!({ "type": "integer" }),
        Value::String(_) => json!({ "type": "string" }),
        Value::Array(items) => {
            let item = items.first().map_or_else(|| json!({ "type": "string" }), schema_of);
            json!({ "type": "array", "items": item })
        }
        Value::Object(fields) => {
            let properties: serde_json::Map<_, _> = fields
                .iter()
                .map(|(name, value)| (name.clone(), schema_of(value)))
                .collect();
            let required: Vec<_> = fields.keys().collect();
            json!({ "type": "object", "properties": properties, "required": required })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_schema_has_every_field_with_its_type() {
        let schema = TypedChannel::Status.schema().expect("JSON");
        let of = |path: &str| schema.pointer(path).cloned().unwrap_or_default();
        assert_eq!(of("/title"), "biplanar.Status");
        assert_eq!(of("/properties/tick/type"), "integer");
        assert_eq!(of("/properties/mode/type"), "string");
        assert_eq!(of("/properties/faults/items/type"), "string");
        assert_eq!(of("/properties/voltage_v/items/type"), "number");
        assert_eq!(of("/properties/estimate/properties/speed_m_s/type"), "number");
        assert_eq!(of("/properties/estimate/properties/sliding/type"), "boolean");
        let log = TypedChannel::Log.schema().expect("JSON");
        assert_eq!(log["properties"]["timestamp"]["properties"]["nsec"]["type"], "integer");
        assert_eq!(log["required"].as_array().map(Vec::len), Some(6));
    }

    #[test]
    fn a_line_of_the_log_has_its_time_and_level() {
        for (level, number) in [(LogLevel::Info, 2), (LogLevel::Warning, 3), (LogLevel::Error, 4)] {
            let line = LogLine {
                time_us: 12_345_678,
                level,
                text: "hot".to_owned(),
            };
            let message = serde_json::to_value(LogMessage::from(&line)).expect("JSON");
            assert_eq!(message["timestamp"], json!({ "sec": 12, "nsec": 345_678_000 }));
            assert_eq!(
                (&message["level"], &message["message"]),
                (&json!(number), &json!("hot"))
            );
            let read: LogMessage = serde_json::from_value(message).expect("a message");
            assert_eq!(LogLine::from(read), line);
        }
    }
}
