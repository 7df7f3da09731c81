//! Suggests a name for a misspelt name.

/// "; did you mean `...`?" with the name nearest to `wrong`, or an empty text if none of `names` is near.
pub(super) fn nearest(wrong: &str, names: &[&str]) -> String {
    let distances = names.iter().map(|name| (distance(wrong, name), name));
    match distances.min() {
        Some((distance, name)) if 2 * distance <= name.len() => format!("; did you mean `{name}`?"),
        _ => String::new(),
    }
}

/// The least number of letters to insert, remove or replace to turn `a` into `b` (Levenshtein).
fn distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.chars().count()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut above_left = i;
        let mut left = i + 1;
        if let Some(first) = row.first_mut() {
            *first = left;
        }
        for (cell, to) in row.iter_mut().skip(1).zip(b.chars()) {
            let above = *cell;
            *cell = (above_left + usize::from(from != to)).min(above + 1).min(left + 1);
            (above_left, left) = (above, *cell);
        }
    }
    row.last().copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found_and_nothing_for_nonsense() {
        for (a, b, letters) in [
            ("", "abc", 3),
            ("kitten", "sitting", 3),
            ("jam", "jam", 0),
            ("pusch", "push", 1),
        ] {
            assert_eq!((distance(a, b), distance(b, a)), (letters, letters), "{a} {b}");
        }
        let names = ["phi_peak_deg", "spar_peak_deg", "push", "jam"];
        assert_eq!(nearest("phi_peak", &names), "; did you mean `phi_peak_deg`?");
        assert_eq!(nearest("pusch", &names), "; did you mean `push`?");
        assert_eq!(nearest("levitate", &names), "");
    }
}
