//! Which names a source defines.

/// What may stand before a name where a line defines it.
const BEFORE: [&str; 14] = [
    "pub(super)",
    "pub(crate)",
    "pub",
    "async",
    "unsafe",
    "struct",
    "enum",
    "trait",
    "const",
    "type",
    "fn",
    "static",
    "let",
    "mut",
];

/// Whether a source defines `name`: a line begins with the name, behind visibility and keyword, as an item, a binding, a field,
/// a variant or an entry of a list.
pub fn defines(source: &str, name: &str) -> bool {
    source.lines().any(|line| {
        let mut rest = line.trim_start();
        while let Some(after) = BEFORE
            .iter()
            .find_map(|word| rest.strip_prefix(word)?.strip_prefix(' '))
        {
            rest = after;
        }
        rest.strip_prefix(name)
            .is_some_and(|after| !after.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.'))
    })
}
