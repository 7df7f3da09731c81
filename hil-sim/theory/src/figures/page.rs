//! The page that shows every figure beside the thesis's claim: one file, no external resources.

use std::fmt::Write as _;

use super::figure::{Figure, Verdict};
use report::html::{document, escaped, image_address};

/// The labelled drawing of the vehicle, which README and docs/ show too.
const VEHICLE_DRAWING: &str = include_str!("../../../../docs/vehicle.svg");

/// The whole page: each figure with the SVG of its charts.
pub fn page(figures: &[(Figure, Vec<String>)]) -> String {
    let mut html = String::from("<header>\n");
    html.push_str("<h1>The biplanar bicycle: every figure of the thesis, recomputed</h1>\n");
    html.push_str(
        "<p>Each figure stands beside the thesis's claim, the numbers computed here and the verdict. \
         Quantities are nondimensional unless a unit is given: lengths in wheel radii, time in &radic;(r/g), forces in (M+m)g, \
         torques in (M+m)gr. docs/errata.md proves the errata (E1 to E38).</p>\n",
    );
    html.push_str(&summary(figures));
    _ = writeln!(
        html,
        "<details class=\"drawing\"><summary>The vehicle: its parts, angles, axes and signs</summary>\
         <img src=\"{}\" alt=\"Side view, spar enlarged and top view of the vehicle with theta, phi, beta, psi and \
         the axes; docs/glossary.md describes the drawing in words\"></details>",
        image_address(VEHICLE_DRAWING)
    );
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
    html.push_str("</main>\n");
    document("The biplanar bicycle: every figure, recomputed", &html)
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
    _ = writeln!(html, "<article id=\"{stem}\">\n<div class=\"wide\">");
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
        // Most figures of the thesis print no number, and a column of blanks would only take width.
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
