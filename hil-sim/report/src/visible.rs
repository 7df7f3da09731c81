//! Makes text from files, paths and boards safe to show: a character that would move a terminal's cursor, change its
//! colours or title, or change the direction of writing is replaced by its number.

use std::borrow::Cow;
use std::fmt::Write as _;

/// `text` with every control character but line feed and tab, and every character that changes the direction of writing,
/// shown as `\u{1b}`.
pub fn visible(text: &str) -> Cow<'_, str> {
    shown(
        text,
        |character| matches!(character, '\n' | '\t'),
        |code| format!("\\u{{{code:x}}}"),
    )
}

/// As [`visible`], for text that must stay on one line: line feeds and tabs are also replaced by their numbers.
pub fn visible_line(text: &str) -> Cow<'_, str> {
    shown(text, |_| false, |code| format!("\\u{{{code:x}}}"))
}

/// JSON with these characters as JSON escapes: the meaning stays the same, and a terminal can show the text safely.
pub fn visible_json(json: &str) -> Cow<'_, str> {
    shown(
        json,
        |character| matches!(character, '\n' | '\t'),
        |code| format!("\\u{code:04x}"),
    )
}

fn shown(text: &str, passes: impl Fn(char) -> bool, by_number: impl Fn(u32) -> String) -> Cow<'_, str> {
    let acts = |character: char| acts_on_a_terminal(character) && !passes(character);
    if !text.contains(acts) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for character in text.chars() {
        if acts(character) {
            _ = write!(shown, "{}", by_number(u32::from(character)));
        } else {
            shown.push(character);
        }
    }
    Cow::Owned(shown)
}

/// Control characters (C0, DEL, C1) and the marks, embeddings, overrides and isolates of bidirectional text.
fn acts_on_a_terminal(character: char) -> bool {
    character.is_control()
        || matches!(character, '\u{061C}' | '\u{200E}' | '\u{200F}' | '\u{2028}'..='\u{202E}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_acts_on_a_terminal_passes() {
        // Every control character of ASCII and Latin-1, and Unicode's list of bidirectional controls and separators.
        let controls = ('\0'..'\u{20}').chain('\u{7f}'..='\u{9f}');
        let directions = "\u{61c}\u{200e}\u{200f}\u{2028}\u{2029}\u{202a}\u{202b}\u{202c}\u{202d}\u{202e}\u{2066}\u{2067}\u{2068}\u{2069}";
        for hostile in controls.chain(directions.chars()) {
            let text = format!("a{hostile}b");
            let number = format!("a\\u{{{:x}}}b", u32::from(hostile));
            assert_eq!(visible_line(&text), number);
            if !matches!(hostile, '\n' | '\t') {
                assert_eq!(visible(&text), number);
                assert!(!visible_json(&text).contains(hostile), "{number}");
            }
        }
        assert_eq!(visible("a\u{1b}[2J\tb\nc"), "a\\u{1b}[2J\tb\nc");
        assert_eq!(visible_line("a\tb\nc"), "a\\u{9}b\\u{a}c");
    }

    #[test]
    fn harmless_text_stays_as_it_is() {
        for text in ["", "Fährt über Grün", "φ = 3°, 日本", "{\"a\": [1, 2]}"] {
            assert!(matches!(visible_line(text), Cow::Borrowed(same) if same == text));
        }
    }

    #[test]
    fn json_keeps_its_meaning() {
        let value = serde_json::json!({"title": "\u{1b}[2J\u{9b}\u{7f}\u{202e}"});
        let shown = visible_json(&value.to_string()).into_owned();
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).expect("JSON"), value);
    }
}
