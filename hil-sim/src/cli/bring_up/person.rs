//! The person at the bench, and the person's answers.

use std::io::BufRead;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use report::error::CommandError;

/// A person who carries out the tool's requests and answers its questions.
pub trait Person {
    /// The person's answer to `question`, if it has come. The tool calls this until the answer comes.
    ///
    /// # Errors
    /// The person has left.
    fn reply(&mut self, question: &str) -> Result<Option<String>, CommandError>;
}

impl<P: Person + ?Sized> Person for Box<P> {
    fn reply(&mut self, question: &str) -> Result<Option<String>, CommandError> {
        (**self).reply(question)
    }
}

/// A parsed answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reply {
    /// Done, or yes.
    Yes,
    /// No.
    No,
    /// Leave the step out.
    Skip,
    /// A measured value.
    Number(f64),
}

impl Reply {
    /// Parses an answer; `None` if the text is not an answer.
    pub fn read(text: &str) -> Option<Self> {
        match text.trim() {
            "" | "y" | "yes" => Some(Self::Yes),
            "n" | "no" => Some(Self::No),
            "s" | "skip" => Some(Self::Skip),
            number => match number.parse::<f64>() {
                Ok(number) if number.is_finite() => Some(Self::Number(number)),
                _ => None,
            },
        }
    }
}

/// Longest wait of one read of the standard input.
const KEY_PATIENCE: Duration = Duration::from_millis(20);

/// The person at the terminal. A thread reads the lines, so that the tool can receive the board's messages and
/// Ctrl-C meanwhile.
#[derive(Debug)]
pub struct Terminal(Receiver<String>);

impl Terminal {
    /// Reads the standard input from now on.
    pub fn new() -> Self {
        let (lines, read) = channel();
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines() {
                let Ok(line) = line else { return };
                if lines.send(line).is_err() {
                    return;
                }
            }
        });
        Self(read)
    }
}

impl Default for Terminal {
    fn default() -> Self {
        Self::new()
    }
}

impl Person for Terminal {
    fn reply(&mut self, question: &str) -> Result<Option<String>, CommandError> {
        match self.0.recv_timeout(KEY_PATIENCE) {
            Ok(line) => Ok(Some(line)),
            Err(RecvTimeoutError::Timeout) => Ok(None),
            Err(RecvTimeoutError::Disconnected) => Err(CommandError::Checks(format!("nobody answers: {question}"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_yes_no_skip_or_a_number() {
        let read = ["", "y", " no", "skip", "3.31", "-2e0", "nan", "inf", "maybe"].map(Reply::read);
        let expected = [
            Some(Reply::Yes),
            Some(Reply::Yes),
            Some(Reply::No),
            Some(Reply::Skip),
            Some(Reply::Number(3.31)),
            Some(Reply::Number(-2.0)),
            None,
            None,
            None,
        ];
        assert_eq!(read, expected);
    }
}
