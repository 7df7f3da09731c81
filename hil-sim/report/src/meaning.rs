//! One colour for one meaning: in the charts as on the page of a run and on the console.

/// A colour: red, green, blue.
pub type Rgb = (u8, u8, u8);

/// The words that say in a curve's name where its numbers come from, and their colours on a light ground. The page of a run and
/// the console have the same ones in their style sheets (`tests/colours.rs`).
pub const MEANINGS: [(&str, Rgb); 5] = [
    ("commanded", ORANGE),
    ("estimated", BLUE),
    ("dead reckoning", BLUE),
    ("reference", PURPLE),
    ("true", GREEN),
];

const BLUE: Rgb = (20, 80, 140);
const ORANGE: Rgb = (179, 89, 11);
const PURPLE: Rgb = (107, 63, 160);
const GREEN: Rgb = (15, 107, 67);

/// Colours of curves of no such meaning, in order; distinguishable also with deficient colour vision.
const COLOURS: [Rgb; 12] = [
    BLUE,
    ORANGE,
    PURPLE,
    GREEN,
    (168, 50, 110),
    (63, 85, 96),
    (122, 106, 0),
    (11, 114, 133),
    (138, 43, 14),
    (60, 160, 220),
    (215, 95, 130),
    (110, 140, 40),
];

/// The colour of the curve of this name, number `k` of its chart.
pub fn colour(name: &str, k: usize) -> Rgb {
    MEANINGS
        .iter()
        .find(|(word, _)| name.contains(word))
        .map_or(COLOURS[k % COLOURS.len()], |(_, colour)| *colour)
}
