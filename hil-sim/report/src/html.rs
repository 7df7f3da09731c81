//! Pages: one file each, no external resources, readable on a phone and on a desk.

use crate::visible::visible;

/// The page's style: one column on a phone, chart and text side by side where there is room.
pub const STYLE: &str = "
:root {
  color-scheme: light dark;
  --page: #f3f5f8; --card: #ffffff; --ink: #1c2430; --quiet: #566173; --line: #e4e8ee; --accent: #14508c;
  --confirmed: #d9f2e1; --confirmed-ink: #0b5a2c; --corrected: #fdecc8; --corrected-ink: #6d4500;
  --refuted: #fbdcd9; --refuted-ink: #86160c; --added: #dde8f8; --added-ink: #173f75;
}
@media (prefers-color-scheme: dark) {
  :root {
    --page: #0f141a; --card: #182029; --ink: #e6ebf1; --quiet: #a5b1bf; --line: #334050; --accent: #6cb6ff;
    --confirmed: #12361f; --confirmed-ink: #7fdca4; --corrected: #3d2f10; --corrected-ink: #ffcb6b;
    --refuted: #44191a; --refuted-ink: #ff9a8f; --added: #1b2f4a; --added-ink: #9cc9ff;
  }
  /* A chart is drawn on white paper: its lightness is turned over, its hues stay. */
  .wide > svg, .stacked svg { filter: invert(.9) hue-rotate(180deg); }
}
* { box-sizing: border-box; }
body { margin: 0; font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--page); }
main, header { max-width: 1320px; margin: 0 auto; padding: 0 16px; }
h1 { font-size: 1.5rem; line-height: 1.25; margin: 24px 0 8px; }
h2 { font-size: 1.2rem; margin: 32px 0 12px; }
h3 { font-size: 1.05rem; line-height: 1.3; margin: 0 0 8px; }
nav { display: flex; flex-wrap: wrap; gap: 6px; margin: 12px 0; }
nav a { display: inline-block; padding: 4px 10px; border-radius: 6px; background: var(--card); color: var(--accent); text-decoration: none; }
article { background: var(--card); border-radius: 10px; padding: 16px; margin: 0 0 16px; display: grid; gap: 16px; grid-template-columns: minmax(0, 1fr); }
article > div { min-width: 0; }
@media (min-width: 900px) { article { grid-template-columns: minmax(0, 1.1fr) minmax(0, 1fr); } }
svg { display: block; width: 100%; height: auto; }
.wide > svg { min-width: 560px; }
svg + svg { margin-top: 12px; }
.verdict { display: inline-block; padding: 1px 10px; border-radius: 999px; font-size: .85rem; font-weight: 600; }
.confirmed { background: var(--confirmed); color: var(--confirmed-ink); }
.corrected { background: var(--corrected); color: var(--corrected-ink); }
.refuted { background: var(--refuted); color: var(--refuted-ink); }
.added { background: var(--added); color: var(--added-ink); }
p { margin: 8px 0; overflow-wrap: anywhere; }
.label { color: var(--quiet); font-size: .85rem; display: block; }
table { width: 100%; border-collapse: collapse; font-size: .92rem; margin: 10px 0; }
th { text-align: left; font-weight: 600; color: var(--quiet); white-space: nowrap; }
th, td { padding: 4px 8px 4px 0; border-bottom: 1px solid var(--line); vertical-align: top; overflow-wrap: anywhere; }
td:first-child { width: 45%; }
.events td { white-space: nowrap; }
.events td:first-child { width: auto; }
.events td:last-child { width: 100%; white-space: normal; }
td + td, th + th { font-variant-numeric: tabular-nums; }
.wide { overflow-x: auto; }
.numbers td:first-child { width: auto; white-space: nowrap; }
.numbers th { white-space: normal; vertical-align: bottom; }
.numbers th:not(:first-child), .numbers td:not(:first-child) { text-align: right; }
article.stacked { grid-template-columns: minmax(0, 1fr); }
.stacked svg { max-width: 760px; }
pre { overflow-x: auto; background: var(--card); border-radius: 10px; padding: 16px; font-size: .8rem; }
.drawing { background: var(--card); border-radius: 10px; padding: 10px 16px; margin: 12px 0; }
.drawing summary { cursor: pointer; color: var(--accent); }
.drawing img { display: block; width: 100%; max-width: 760px; margin: 12px auto; }
.files a { color: var(--accent); margin-right: 12px; }
";

/// A whole page of the `body`.
pub fn document(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        escaped(title)
    )
}

/// The drawing `svg` as the address of an image. A drawing shown as an image keeps its styles to itself.
///
/// ```
/// assert_eq!(report::html::image_address("<a b=\"#c\"/>"), "data:image/svg+xml,%3Ca b=%22%23c%22/%3E");
/// ```
pub fn image_address(svg: &str) -> String {
    let data = svg
        .replace('%', "%25")
        .replace('#', "%23")
        .replace('"', "%22")
        .replace('<', "%3C")
        .replace('>', "%3E")
        .replace('\n', "%0A");
    format!("data:image/svg+xml,{data}")
}

/// `text` with the characters of markup escaped, and with control characters replaced by their numbers.
pub fn escaped(text: &str) -> String {
    visible(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
