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

/// Colours say what the words say too: a terminal shows them, unless `NO_COLOR` or its kind forbids; a pipe has none.
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
