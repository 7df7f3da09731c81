//! The curves on the pages of the commands that search a limit or a gain, and runs in space against runs in the plane.

#[allow(dead_code)] // These tests write no vehicle files.
mod vehicle_tool;

use std::path::Path;

use serde_json::Value;
use vehicle_tool::{REFERENCE, hil_sim, json};

/// A curve of a page: name and points.
type Curve = (String, Vec<(f64, f64)>);

/// The data of the page that the command writes, and the lines that it prints.
fn page(name: &str, line: &str, vehicle: Option<&str>) -> (Value, String) {
    let page = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let output = hil_sim(&format!("{line} --html {}", page.display()), vehicle);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let html = std::fs::read_to_string(&page).unwrap();
    let (_, data) = html.split_once("id=\"data\">").unwrap();
    let data = serde_json::from_str(data.split("</script>").next().unwrap()).unwrap();
    (data, String::from_utf8(output.stdout).unwrap())
}

/// The curves of the chart with this vertical axis.
fn curves(data: &Value, y_label: &str) -> Vec<Curve> {
    let charts = data["charts"].as_array().unwrap();
    let chart = charts.iter().find(|chart| chart["y_label"] == y_label).expect(y_label);
    let numbers = |list: &Value| -> Vec<Option<f64>> { list.as_array().unwrap().iter().map(Value::as_f64).collect() };
    let x = numbers(&chart["x"]);
    let curve = |series: &Value| {
        let points = x.iter().zip(numbers(&series["values"]));
        let points = points.filter_map(|(x, y)| (*x).zip(y)).collect();
        (series["name"].as_str().unwrap().to_owned(), points)
    };
    chart["series"].as_array().unwrap().iter().map(curve).collect()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap()
}

/// Just below the limit the arm swings and comes back, just above it turns over; the wheels follow. In SI with a vehicle.
#[test]
fn the_page_of_a_limit_shows_the_response_on_either_side() {
    for (line, vehicle, rate, unit) in [
        ("critical", None, "wheel rate (w)", "U "),
        ("critical --direction reverse", None, "wheel rate (w)", "U "),
        (
            "critical --waveform ramp --ramp-time 2",
            Some(REFERENCE),
            "wheel rate, rad/s",
            " V",
        ),
        (
            "critical --quantity reference --u-max 4",
            Some(REFERENCE),
            "wheel rate, rad/s",
            " m/s",
        ),
    ] {
        let (data, shown) = page("critical.html", line, vehicle);
        let printed = String::from_utf8(hil_sim(line, vehicle).stdout).unwrap();
        assert_eq!(shown.split("wrote ").next().unwrap(), printed, "{line}");
        let result = json(line, vehicle);
        let whirl = number(&result, "whirl_direction");
        let arm = curves(&data, "phi, deg");
        let [(below, swing), (above, whirled)] = arm.as_slice() else {
            panic!("{line}: {arm:?}");
        };
        assert!(below.starts_with("just below: ") && above.starts_with("just above: "));
        assert!(
            below.contains(unit) && above.contains(unit) && below != above,
            "{below}, {above}"
        );
        let turned = |points: &[(f64, f64)]| whirl * (points.last().unwrap().1 - points[0].1);
        assert!((360.0..500.0).contains(&turned(whirled)), "{line}: {}", turned(whirled));
        let from = swing[0].1;
        let furthest = swing.iter().map(|(_, phi)| (phi - from).abs()).fold(0.0, f64::max);
        assert!(
            furthest > 60.0 && furthest < 360.0 && turned(swing).abs() < 100.0,
            "{line}: {furthest}, {}",
            turned(swing)
        );
        // Both start alike, as `simulate` computes them from the same start.
        assert_eq!(from, whirled[0].1, "{line}");
        let wheels = curves(&data, rate);
        assert_eq!(wheels.len(), 2);
        assert!(
            wheels.iter().all(|(_, points)| points[0].1 == 0.0 && points.len() > 50),
            "{line}"
        );
    }
}

/// The spar comes back from 5 deg, and the poles are those of the table.
#[test]
fn the_page_of_the_regulator_shows_its_response_and_its_poles() {
    for (vehicle, volts, imaginary, poles) in [
        (None, "v", "imaginary part, w_c", "poles"),
        (
            Some(REFERENCE),
            "voltage of the ballast motor, V",
            "imaginary part, 1/s",
            "poles_per_s",
        ),
    ] {
        let (data, shown) = page("lqr.html", "lqr", vehicle);
        let printed = String::from_utf8(hil_sim("lqr", vehicle).stdout).unwrap();
        assert_eq!(shown.split("wrote ").next().unwrap(), printed);
        let result = json("lqr", vehicle);
        let angles = curves(&data, "angle, deg");
        let (first, last) = (angles[0].1[0], *angles[0].1.last().unwrap());
        assert_eq!((angles[0].0.as_str(), first), ("spar", (0.0, 5.0)));
        assert!(last.1.abs() < 0.05, "{last:?}");
        // At rest in the tilt the voltage is the gain on the spar's angle alone.
        let gain = match vehicle {
            Some(_) => result["gains_v"][0].as_f64().unwrap(),
            None => result["gains"][0].as_f64().unwrap(),
        };
        let (_, voltage) = &curves(&data, volts)[0];
        let want = -gain * 5_f64.to_radians();
        assert!((voltage[0].1 / want - 1.0).abs() < 1e-4, "{} for {want}", voltage[0].1);
        let mut marks: Vec<(f64, f64)> = { curves(&data, imaginary) }
            .into_iter()
            .map(|(_, points)| points[0])
            .collect();
        let mut want: Vec<(f64, f64)> = { result[poles].as_array().unwrap().iter() }
            .map(|pole| (pole[0].as_f64().unwrap(), pole[1].as_f64().unwrap()))
            .collect();
        let by_place = |a: &(f64, f64), b: &(f64, f64)| a.partial_cmp(b).unwrap();
        marks.sort_by(by_place);
        want.sort_by(by_place);
        assert_eq!(marks.len(), 4);
        for (mark, want) in marks.iter().zip(&want) {
            // A page has six digits.
            let off = (mark.0 - want.0).abs() + (mark.1 - want.1).abs();
            assert!(off < 1e-4 * (want.0.abs() + want.1.abs()), "{mark:?} for {want:?}");
        }
    }
}

/// With a vehicle file both count the whole mass: straight up a slope the vehicle in space is the one in the plane, whose arm
/// leans further for the spar's weight.
#[test]
fn in_space_as_in_the_plane_the_vehicle_carries_its_spar() {
    let slope = 0.0873;
    let planar = json(
        "simulate --voltage 2 --phi0 0.1 --beta 0.0873 --t-end 20 --sample 1",
        Some(REFERENCE),
    );
    let start = format!("0,0,0,0,0,{},0,0,0", 0.1 - slope);
    let line = format!("spatial --u-right 1 --u-left 1 --slope-x {slope} --state0 {start} --t-end 20 --sample 1");
    let space = json(&line, Some(REFERENCE));
    for unit in ["time_unit_s", "voltage_unit_v", "speed_unit_m_s"] {
        assert_eq!(planar[unit], space[unit], "{unit}");
    }
    let at = |run: &Value, key: &str, k: usize| run[key][k].as_f64().unwrap();
    for k in 0..=20 {
        let angle = at(&planar, "phi", k) - slope - at(&space, "phi", k);
        let rolled = at(&planar, "theta", k) - at(&space, "theta_r", k);
        assert!(angle.abs() < 1e-7 && rolled.abs() < 1e-6, "{k}: {angle}, {rolled}");
    }
    assert!(at(&planar, "theta", 20) > 5.0);
}
