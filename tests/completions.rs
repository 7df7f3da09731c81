//! What the tab key offers in a shell, from the scripts of `hil-sim completions`.

use std::path::{Path, PathBuf};
use std::process::Command;

#[path = "support/tool.rs"]
mod tool;
use tool::{hil_sim, stderr};

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// The completions of a shell.
fn completions(shell: &str) -> String {
    let output = hil_sim(&["completions", shell]);
    assert!(output.status.success(), "{shell}: {}", stderr(&output));
    String::from_utf8(output.stdout).expect("utf-8")
}

/// The lines that bash offers for a command line whose last word, perhaps empty, is the one to complete.
#[cfg(unix)]
fn bash_offers(place: &Path, words: &[&str]) -> Vec<String> {
    // What bash itself does on the tab key: the function, then, where it offers nothing, files.
    let script = format!(
        "{}\nCOMP_WORDS=(\"$@\"); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))\n\
         _hil__sim \"$1\" \"${{COMP_WORDS[COMP_CWORD]}}\" \"${{COMP_WORDS[COMP_CWORD-1]}}\"\n\
         [ ${{#COMPREPLY[@]}} -gt 0 ] || COMPREPLY=($(compgen -f -- \"${{COMP_WORDS[COMP_CWORD]}}\"))\n\
         printf '%s\\n' \"${{COMPREPLY[@]}}\"",
        completions("bash")
    );
    let output = Command::new("bash")
        .args(["-c", &script, "bash"])
        .args(words)
        .current_dir(place)
        .output()
        .expect("bash runs");
    assert!(output.status.success(), "{words:?}: {}", stderr(&output));
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .map(str::to_owned)
        .collect()
}

/// The tab key completes the names of the shipped scenarios and the choices of flags, and still files; the tool still takes
/// both.
#[cfg(unix)]
#[test]
fn a_scenario_is_completed_by_its_name_or_by_its_file() {
    let place = folder("completions");
    let scenario = "title = 'mine'\nduration_s = 0.1\n";
    std::fs::write(place.join("kerb-of-mine.toml"), scenario).expect("writes");
    let offered = |words: &[&str]| bash_offers(&place, words);
    assert!(completions("bash").starts_with("_hil__sim()"));
    assert_eq!(offered(&["hil-sim", "bounds", "ker"]), ["kerb"]);
    assert_eq!(offered(&["hil-sim", "drive", "--json", "slip"]), ["slippery-patch"]);
    assert_eq!(offered(&["hil-sim", "serve", "--scenario", "dead"]), ["dead-man"]);
    assert_eq!(offered(&["hil-sim", "drive", "--board", ""]), ["virtual", "emulated"]);
    assert_eq!(offered(&["hil-sim", "slip-limit", "--mu"]), ["--mu", "--mu-s"]);
    assert_eq!(offered(&["hil-sim", "drive", "kerb-"]), ["kerb-of-mine.toml"]);
    assert_eq!(
        offered(&["hil-sim", "drive", "--vehicle", "kerb"]),
        ["kerb-of-mine.toml"]
    );
    // Zsh takes names and files from one function; fish has a line for each command that takes a scenario.
    let (zsh, fish) = (completions("zsh"), completions("fish"));
    let names = "dead-man emergency-stop figure-of-eight kerb ";
    assert!(zsh.starts_with("#compdef hil-sim\n"));
    assert!(zsh.contains(&format!("shipped scenario:({names}")) && zsh.contains("files:scenario file:_files"));
    // The function and its uses by `drive`, `bounds` and `serve`, nowhere only the names.
    assert_eq!(zsh.matches(":_hil_sim_scenario'").count(), 3);
    assert_eq!(zsh.matches(names).count(), 1);
    for command in ["drive", "bounds"] {
        let line = format!("__fish_hil_sim_using_subcommand {command}\" -a \"{names}");
        assert!(fish.contains(&line), "{command}");
    }
    assert!(fish.contains("-l scenario") && fish.contains("-r -F -a \"dead-man"));
    for scenario in ["kerb", "kerb-of-mine.toml", "./kerb-of-mine.toml"] {
        let output = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
            .args(["drive", scenario, "--no-bounds", "--json"])
            .current_dir(&place)
            .output()
            .expect("runs");
        assert!(output.status.success(), "{scenario}: {}", stderr(&output));
    }
}
