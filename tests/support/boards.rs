//! The sources that belong to one board, in lines.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::files::files;

/// The folders of the first board and of the second: the program with its board, and the facts.
const FOLDERS: [[&str; 2]; 2] = [
    ["firmware/src/bin/drive-board", "firmware/src/bin/drive-board-f767"],
    [
        "firmware/src/drive_board/nucleo_h743zi",
        "firmware/src/drive_board/nucleo_f767zi",
    ],
];

fn lines(file: &Path) -> usize {
    fs::read_to_string(file).map_or(0, |text| text.lines().count())
}

/// A table of every file that the second board owns, with its lines and those of the first board's file.
pub fn table(root: &Path) -> String {
    let mut text = String::from("| File of the second board | Lines | Lines of the first board's |\n|---|---|---|\n");
    let mut sums = [0; 2];
    for [first, second] in FOLDERS.map(|pair| pair.map(|folder| root.join(folder))) {
        for file in files(&second, &["rs"]) {
            let name = file.strip_prefix(&second).expect("below the folder");
            let counts = [lines(&file), lines(&first.join(name))];
            sums = [sums[0] + counts[0], sums[1] + counts[1]];
            let shown = file.strip_prefix(root).expect("below the root").display();
            let _ = writeln!(text, "| `{shown}` | {} | {} |", counts[0], counts[1]);
        }
    }
    let _ = writeln!(text, "| together | {} | {} |", sums[0], sums[1]);
    text
}
