//! Colours in a terminal, from outside.

#[path = "support/tool.rs"]
mod tool;
use tool::{WORKSPACE, hil_sim, stderr};

/// What the tool says to a terminal on standard error, with these variables set.
fn on_a_terminal(arguments: &[&str], variables: &[(&str, &str)]) -> String {
    let (mut screen, terminal) = serialport::TTYPort::pair().expect("a pseudo-terminal");
    let path = serialport::SerialPort::name(&terminal).expect("has a name");
    let terminal_file = std::fs::OpenOptions::new().write(true).open(path).expect("opens");
    serialport::SerialPort::set_timeout(&mut screen, std::time::Duration::from_secs(5)).expect("a timeout");
    let status = std::process::Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args(arguments)
        .current_dir(WORKSPACE)
        .env_remove("NO_COLOR")
        .env("TERM", "xterm")
        .envs(variables.iter().copied())
        .stderr(terminal_file)
        .status()
        .expect("runs");
    assert_eq!(status.code(), Some(2));
    let mut text = Vec::new();
    while !text.contains(&b'\n') {
        let mut bytes = [0; 256];
        let count = std::io::Read::read(&mut screen, &mut bytes).expect("a line");
        text.extend(&bytes[..count]);
    }
    String::from_utf8(text).expect("text")
}

/// Colours only repeat what the words say. The tool colours its output on a terminal, unless `NO_COLOR` or the terminal's kind
/// forbids colours; into a pipe it writes none.
#[test]
fn colours_are_for_terminals_that_want_them() {
    let arguments = ["check", "vehicles/missing.toml"];
    let coloured = on_a_terminal(&arguments, &[]);
    assert!(
        coloured.starts_with("\u{1b}[31m") && coloured.contains("error:"),
        "{coloured:?}"
    );
    for unwanted in [("NO_COLOR", "1"), ("TERM", "dumb"), ("CLICOLOR", "0")] {
        let plain = on_a_terminal(&arguments, &[unwanted]);
        assert!(plain.starts_with("error: "), "{unwanted:?}: {plain:?}");
    }
    assert!(stderr(&hil_sim(&arguments)).starts_with("error: "));
}

/// The value of the custom property `name` in the `number`-th block of a style sheet that defines it: the first block is for a
/// light ground, the second for a dark ground.
fn property<'a>(style: &'a str, name: &str, number: usize) -> &'a str {
    let place = style.match_indices(&format!("{name}: ")).nth(number);
    let (at, found) = place.unwrap_or_else(|| panic!("{name}"));
    let rest = &style[at + found.len()..];
    rest.split(';').next().expect("ends")
}

/// Commanded, aimed, estimated and true values each have one colour and one line style on the console, on the page of a run and in
/// its charts; no two of the four share a colour or a line style.
#[test]
fn one_meaning_has_one_colour_and_one_line_everywhere() {
    let read = |path: &str| std::fs::read_to_string(format!("{WORKSPACE}/{path}")).expect(path);
    let (console, plots) = (
        read("hil-sim/console/page/style.css"),
        read("hil-sim/console/page/plots.js"),
    );
    let (page, script) = (
        read("hil-sim/report/src/interactive/page.css"),
        read("hil-sim/report/src/interactive/page.js"),
    );
    let mut seen = Vec::new();
    for meaning in ["commanded", "reference", "estimated", "true"] {
        // The console's curves with this name, or with this word after a quantity's name.
        let named = format!("{meaning}\", \"");
        let curves: Vec<(&str, &str)> = { plots.match_indices(&named) }
            // The curves of slip, all of them true values, tell the sides of the vehicle apart by colour.
            .filter(|(at, _)| !["left, ", "right, "].iter().any(|side| plots[..*at].ends_with(side)))
            .map(|(at, _)| {
                let curve = plots[at..].split(']').next().expect("ends");
                let mut parts = curve.split(", ").skip(2);
                let (colour, line) = (parts.next().expect("a colour"), parts.next().expect("a line"));
                (colour.trim_matches('"'), line)
            })
            .collect();
        let (variable, line) = curves[0];
        assert!(curves.iter().all(|curve| *curve == (variable, line)), "{curves:?}");
        let dashes = plots.split(&format!("const {line} = ")).nth(1).expect("is there");
        let dashes = dashes.split(';').next().expect("ends");
        for ground in 0..2 {
            assert_eq!(
                property(&console, variable, ground),
                property(&page, &format!("--{meaning}"), ground),
                "{meaning}"
            );
        }
        assert!(
            script.contains(&format!("\"--{meaning}\", {dashes}]")),
            "{meaning}: {dashes}"
        );
        let light = property(&page, &format!("--{meaning}"), 0).to_uppercase();
        let chart = report::plot::Chart::new("t", "x", "y").with(report::plot::Series::new(
            format!("slope, {meaning}"),
            &[0.0, 1.0],
            &[0.0, 1.0],
        ));
        assert!(chart.to_svg().expect("draws").contains(&light), "{meaning}: {light}");
        seen.push((light, dashes.to_owned()));
    }
    for (k, (colour, line)) in seen.iter().enumerate() {
        assert!(
            seen[..k].iter().all(|(other, dash)| other != colour && dash != line),
            "{seen:?}"
        );
    }
}
