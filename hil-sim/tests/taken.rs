//! The numbers that the analysis commands use where the user gives none.

use std::path::Path;

mod vehicle_tool;
use vehicle_tool::{REFERENCE, file, hil_sim, json, reference_with};

/// The tool reports every number that affects a result and that the user did not give: in the table, in JSON and on the page.
#[test]
fn what_nobody_gave_is_told_with_where_it_comes_from() {
    let slope = "--beta 0.0873 (the thesis's slope, rad)";
    let grip = "--mu-s 0.6 (control.grip_mu of the vehicle file)";
    let planar = file(
        "planar-taken.toml",
        "[planar]\nl = 0.8\nalpha = 0.9\nzeta = 2.2\nmu = 0.066\nbeta = 0.1\n",
    );
    for (line, vehicle, told) in [
        ("slip-limit", Some(REFERENCE), vec![slope, grip]),
        ("critical", Some(REFERENCE), vec![slope]),
        ("critical --quantity reference --u-max 3", Some(REFERENCE), vec![slope]),
        ("equilibrium", Some(REFERENCE), vec![slope]),
        (
            "simulate --voltage 0.5 --t-end 1 --sample 1",
            Some(REFERENCE),
            vec![slope],
        ),
        ("coupled --t-end 1 --sample 1", Some(REFERENCE), vec![slope]),
        ("slip-limit", Some(&planar), vec!["--mu-s 0.8 (rubber on dry concrete)"]),
        ("slip-limit --mu-s 0.7 --beta 0.1", Some(REFERENCE), vec![]),
        ("critical", Some(&planar), vec![]),
        (
            "critical --quantity reference --u-max 3",
            Some(&planar),
            vec!["--kp 0.8 (the thesis's vehicle)", "--kd 10 (the thesis's vehicle)"],
        ),
        (
            "critical --l 0.8 --beta 0.1",
            None,
            vec![
                "--alpha 0.9 (the thesis's vehicle)",
                "--zeta 2.2",
                "--mu 0.066",
                "--nu 0",
            ],
        ),
    ] {
        let page = Path::new(env!("CARGO_TARGET_TMPDIR")).join("taken.html");
        let _ = std::fs::remove_file(&page);
        let shown = hil_sim(&format!("{line} --html {}", page.display()), vehicle);
        let text = String::from_utf8(shown.stdout).unwrap();
        let page = std::fs::read_to_string(&page).unwrap();
        for part in &told {
            assert!(text.contains(part), "{line}: {part}: {text}");
            assert!(page.contains(part), "{line}: {part} is not on the page");
        }
        assert_eq!(told.is_empty(), !text.contains("not given, taken"), "{line}: {text}");
        let json = json(line, vehicle);
        let taken = json.get("taken").map_or(0, |taken| taken.as_array().unwrap().len());
        assert_eq!(taken, told.len(), "{line}: {json}");
    }
    // The vehicle's own grip decides.
    let slippery = reference_with("slippery.toml", &[("grip_mu = 0.6", "grip_mu = 0.3")]);
    let own = json("slip-limit", Some(&slippery));
    assert_eq!(own["mu_s"], 0.3);
    let given = json("slip-limit --mu-s 0.3", Some(&slippery));
    assert_eq!(own["critical_voltage"], given["critical_voltage"]);
}
