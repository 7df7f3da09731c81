//! The person at the bench: what they answer.

use std::io::BufRead;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use report::error::CommandError;

/// Who carries out what the tool asks for, and answers.
pub trait Person {
    /// What the person says to `question`, if they have answered yet. Called again until they have.
    ///
    /// # Errors
    /// Nobody is there any more.
    fn reply(&mut self, question: &str) -> Result<Option<String>, CommandError>;
}

impl<P: Person + ?Sized> Person for Box<P> {
    fn reply(&mut self, question: &str) -> Result<Option<String>, CommandError> {
        (**self).reply(question)
    }
}

/// An answer, understood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reply {
    /// Done, or yes.
    Yes,
    /// No.
    No,
    /// The step is left out.
    Skip,
    /// A measured value.
    Number(f64),
}

impl Reply {
    /// Reads an answer; `None` if it is none.
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

/// How long one look at the standard input takes at most.
const KEY_PATIENCE: Duration = Duration::from_millis(20);

/// The person at the terminal. A thread reads the lines, so that the tool hears the board and Ctrl-C meanwhile.
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
