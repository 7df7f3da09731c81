//! The page that shows every figure beside the thesis's claim: one file, no external resources.

use std::fmt::Write as _;

use super::{Figure, Verdict};

/// The page's style: one column on a phone, chart and text side by side where there is room.
const STYLE: &str = "
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0; font: 16px/1.5 system-ui, sans-serif; color: #1c2430; background: #f3f5f8; }
main, header { max-width: 1320px; margin: 0 auto; padding: 0 16px; }
h1 { font-size: 1.5rem; line-height: 1.25; margin: 24px 0 8px; }
h2 { font-size: 1.2rem; margin: 32px 0 12px; }
h3 { font-size: 1.05rem; line-height: 1.3; margin: 0 0 8px; }
nav { display: flex; flex-wrap: wrap; gap: 6px; margin: 12px 0; }
nav a { display: inline-block; padding: 4px 10px; border-radius: 6px; background: #fff; color: #14508c; text-decoration: none; }
article { background: #fff; border-radius: 10px; padding: 16px; margin: 0 0 16px; display: grid; gap: 16px; }
article > div { min-width: 0; }
@media (min-width: 900px) { article { grid-template-columns: minmax(0, 1.1fr) minmax(0, 1fr); } }
svg { display: block; width: 100%; height: auto; }
svg + svg { margin-top: 12px; }
.verdict { display: inline-block; padding: 1px 10px; border-radius: 999px; font-size: .85rem; font-weight: 600; }
.confirmed { background: #d9f2e1; color: #0b5a2c; }
.corrected { background: #fdecc8; color: #6d4500; }
.refuted { background: #fbdcd9; color: #86160c; }
.added { background: #dde8f8; color: #173f75; }
p { margin: 8px 0; overflow-wrap: anywhere; }
.label { color: #566173; font-size: .85rem; display: block; }
table { width: 100%; border-collapse: collapse; font-size: .92rem; margin: 10px 0; }
th { text-align: left; font-weight: 600; color: #566173; white-space: nowrap; }
th, td { padding: 4px 8px 4px 0; border-bottom: 1px solid #e4e8ee; vertical-align: top; overflow-wrap: break-word; }
td:first-child { width: 45%; }
td + td, th + th { font-variant-numeric: tabular-nums; }
.files a { color: #14508c; margin-right: 12px; }
";

/// The whole page: each figure with the SVG of its charts.
pub fn page(figures: &[(Figure, Vec<String>)]) -> String {
    let mut html = String::from("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
    html.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n");
    html.push_str("<title>The biplanar bicycle: every figure, recomputed</title>\n");
    _ = writeln!(html, "<style>{STYLE}</style>\n</head>\n<body>\n<header>");
    html.push_str("<h1>The biplanar bicycle: every figure of the thesis, recomputed</h1>\n");
    html.push_str(
        "<p>Each figure stands beside what the thesis claims of it, the numbers found here and the verdict. \
         Nondimensional unless a unit is given: lengths in wheel radii, time in &radic;(r/g), forces in (M+m)g, \
         torques in (M+m)gr. Errata (E1 to E38) are proven in docs/errata.md.</p>\n",
    );
    html.push_str(&summary(figures));
    html.push_str("<nav>");
    for (figure, _) in figures {
        _ = write!(html, "<a href=\"#{}\">{}</a>", figure.stem(), escaped(figure.id));
    }
    html.push_str("</nav>\n</header>\n<main>\n");
    let mut chapter = "";
    for (figure, svgs) in figures {
        let number = figure.id.split('.').next().unwrap_or_default();
        if number != chapter {
            chapter = number;
            _ = writeln!(html, "<h2>Chapter {}</h2>", escaped(chapter));
        }
        article(&mut html, figure, svgs);
    }
    html.push_str("</main>\n</body>\n</html>\n");
    html
}

/// How many figures of each verdict there are.
fn summary(figures: &[(Figure, Vec<String>)]) -> String {
    let mut html = String::from("<p>");
    for verdict in [Verdict::Confirmed, Verdict::Corrected, Verdict::Refuted, Verdict::Added] {
        let count = figures.iter().filter(|(f, _)| f.verdict == verdict).count();
        let word = verdict.word();
        _ = write!(html, "<span class=\"verdict {word}\">{count} {word}</span> ");
    }
    html.push_str("</p>\n");
    html
}

fn article(html: &mut String, figure: &Figure, svgs: &[String]) {
    let stem = figure.stem();
    _ = writeln!(html, "<article id=\"{stem}\">\n<div>");
    for (chart, svg) in figure.charts.iter().zip(svgs) {
        let label = format!("<svg role=\"img\" aria-label=\"{}\" ", escaped(&chart.title));
        html.push_str(&svg.replacen("<svg ", &label, 1));
    }
    let word = figure.verdict.word();
    _ = writeln!(
        html,
        "</div>\n<div>\n<h3>{} &nbsp;{}</h3>",
        escaped(figure.id),
        escaped(&figure.title)
    );
    _ = writeln!(html, "<p><span class=\"verdict {word}\">{word}</span></p>");
    if !figure.claim.is_empty() {
        _ = writeln!(
            html,
            "<p><span class=\"label\">The thesis</span>{}</p>",
            escaped(&figure.claim)
        );
    }
    if !figure.numbers.is_empty() {
        // Most of the thesis's figures print no number: a column of blanks would only take width.
        let printed = figure.numbers.iter().any(|n| !n.thesis.is_empty());
        let head = if printed { "<th>thesis</th>" } else { "" };
        _ = writeln!(
            html,
            "<table><thead><tr><th></th>{head}<th>found</th></tr></thead><tbody>"
        );
        for n in &figure.numbers {
            let (name, ours) = (escaped(&n.name), escaped(&n.ours));
            let thesis = if printed {
                format!("<td>{}</td>", escaped(&n.thesis))
            } else {
                String::new()
            };
            _ = writeln!(html, "<tr><td>{name}</td>{thesis}<td>{ours}</td></tr>");
        }
        html.push_str("</tbody></table>\n");
    }
    if !figure.finding.is_empty() {
        _ = writeln!(
            html,
            "<p><span class=\"label\">Found here</span>{}</p>",
            escaped(&figure.finding)
        );
    }
    html.push_str("<p class=\"files\">");
    for k in 0..svgs.len() {
        let part = if svgs.len() == 1 {
            String::new()
        } else {
            format!("-{}", k + 1)
        };
        _ = write!(html, "<a href=\"{stem}{part}.svg\">SVG{}</a>", part.replace('-', " "));
    }
    _ = writeln!(html, "<a href=\"{stem}.csv\">CSV</a></p>\n</div>\n</article>");
}

/// Text that cannot be taken for markup.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
