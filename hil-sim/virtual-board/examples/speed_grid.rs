//! Runs the speed law on the full plant over a grid: steps of speed on slopes, arming with the arm hanging, kerbs, a
//! wall.
//!
//! ```sh
//! cargo run --release -p virtual-board --example speed_grid -- [--vehicle FILE] [steps] [roll-back] [kerbs] [wall] [slopes]
//! ```
//!
//! Without a name all parts run. Each line is one drive; the last lines of a part summarise the part.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use firmware::drive_board::SCALES;
use model::supervise::codes::FaultSet;
use model::vehicle::Vehicle;
use plant::Plant;
use virtual_board::scenario::trace::TraceRow;
use virtual_board::scenario::{Scenario, VirtualBackend, run};

type Failure = Box<dyn Error>;

fn main() -> Result<(), Failure> {
    let mut vehicle = vehicle_file::reference()?;
    let mut parts: Vec<String> = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == "--vehicle" {
            let file = arguments.next().ok_or("--vehicle needs a file")?;
            vehicle = vehicle_file::read_vehicle(Path::new(&file))?;
        } else {
            parts.push(argument);
        }
    }
    let wanted = |part: &str| parts.is_empty() || parts.iter().any(|p| p == part);
    if wanted("steps") {
        steps(&vehicle)?;
    }
    if wanted("roll-back") {
        roll_back(&vehicle)?;
    }
    if wanted("kerbs") {
        kerbs(&vehicle)?;
    }
    if wanted("wall") {
        wall(&vehicle)?;
    }
    if wanted("slopes") {
        slopes(&vehicle)?;
    }
    Ok(())
}

/// A drive on a plane: the vehicle is armed at 2 s and then commanded the speeds from the given times.
struct Drive<'a> {
    slope_deg: f64,
    friction: f64,
    kerb_m: Option<f64>,
    speeds: &'a [(f64, f64)],
    duration_s: f64,
}

impl Drive<'_> {
    fn rows(&self, vehicle: &Vehicle<f64>) -> Result<Vec<TraceRow>, Failure> {
        let mut text = format!(
            "title = 'grid'\nduration_s = {}\nchocked_until_armed = true\n[terrain.plane]\nslope_x_rad = {}\n\
             [terrain.friction]\nleft = {f}\nright = {f}\n",
            self.duration_s,
            self.slope_deg.to_radians(),
            f = self.friction
        );
        if let Some(height) = self.kerb_m {
            write!(
                text,
                "[[terrain.profile]]\nkind = 'step'\nat_m = 3.0\nheight_m = {height}\n"
            )?;
        }
        text += "[[step]]\nat_s = 2.0\naction = 'arm'\n";
        for (at_s, speed) in self.speeds {
            write!(text, "[[step]]\nat_s = {at_s}\naction = 'drive'\nspeed_m_s = {speed}\n")?;
        }
        let scenario = Scenario::parse("grid", &text)?;
        let plant = Plant::new(vehicle, &SCALES, scenario.terrain.clone(), scenario.seed)?;
        let mut backend = VirtualBackend::boot(vehicle, plant)?;
        Ok(run(&scenario, &mut backend, |_| {})?.trace.rows)
    }
}

fn peak(rows: &[TraceRow], value: impl Fn(&TraceRow) -> f64) -> f64 {
    rows.iter().map(value).fold(0.0, |most, x| most.max(x.abs()))
}

fn between(rows: &[TraceRow], from_s: f64, to_s: f64) -> Vec<TraceRow> {
    rows.iter()
        .filter(|r| r.time_s() >= from_s && r.time_s() < to_s)
        .copied()
        .collect()
}

/// The peaks that every part prints.
fn peaks(rows: &[TraceRow]) -> String {
    let faults = rows.last().map_or(FaultSet::EMPTY, |r| r.status.faults);
    format!(
        "phi {:5.1} deg, spar {:5.2} deg, current {:4.1} A, slip {:5.2} m/s, speed {:5.2} m/s, faults {faults}",
        peak(rows, |r| r.truth.phi_rad).to_degrees(),
        peak(rows, |r| r.truth.spar_rad).to_degrees(),
        peak(rows, |r| r.truth.current_a[0].abs().max(r.truth.current_a[1].abs())),
        peak(rows, |r| r.truth.slip_m_s[0].abs().max(r.truth.slip_m_s[1].abs())),
        peak(rows, |r| r.truth.speed_m_s),
    )
}

/// Time until the speed stays within 2 % of the step, s (infinite: never), and the overshoot.
fn settling(rows: &[TraceRow], at_s: f64, from: f64, to: f64) -> (f64, f64) {
    let error = |r: &TraceRow| (r.truth.speed_m_s - to) / (to - from);
    let settled = match rows.iter().rposition(|r| error(r).abs() > 0.02) {
        Some(last) => rows.get(last + 1).map_or(f64::INFINITY, |r| r.time_s() - at_s),
        None => 0.0,
    };
    (settled, rows.iter().map(error).fold(0.0, f64::max))
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share).round() as usize]
}

fn steps(vehicle: &Vehicle<f64>) -> Result<(), Failure> {
    let (mut times, mut overshoots, mut ripples) = (Vec::new(), Vec::new(), Vec::new());
    for slope_deg in [0.0, 5.0, -5.0, 10.0, -10.0, 20.0, -20.0] {
        for speed in [0.3, 0.8, 1.5, 2.5] {
            let drive = Drive {
                slope_deg,
                friction: 0.8,
                kerb_m: None,
                speeds: &[(16.0, speed), (26.0, 0.0)],
                duration_s: 36.0,
            };
            let rows = drive.rows(vehicle)?;
            let (go, go_over) = settling(&between(&rows, 16.0, 26.0), 16.0, 0.0, speed);
            let (stop, stop_over) = settling(&between(&rows, 26.0, 36.0), 26.0, speed, 0.0);
            let ripple = peak(&between(&rows, 33.0, 36.0), |r| r.truth.speed_m_s);
            println!(
                "{slope_deg:5} deg {speed} m/s: go {go:5.2} s {:4.1} %, stop {stop:5.2} s {:4.1} %, hold {:4.1} mm/s, {}",
                100.0 * go_over,
                100.0 * stop_over,
                1000.0 * ripple,
                peaks(&between(&rows, 15.0, 36.0))
            );
            times.extend([go, stop]);
            overshoots.extend([go_over, stop_over]);
            ripples.push(ripple);
        }
    }
    println!(
        "steps: settling median {:.2} s, worst {:.2} s; overshoot median {:.1} %, worst {:.1} %; hold worst {:.1} mm/s",
        quantile(&mut times, 0.5),
        quantile(&mut times, 1.0),
        100.0 * quantile(&mut overshoots, 0.5),
        100.0 * quantile(&mut overshoots, 1.0),
        1000.0 * quantile(&mut ripples, 1.0)
    );
    Ok(())
}

fn roll_back(vehicle: &Vehicle<f64>) -> Result<(), Failure> {
    for slope_deg in [5.0, 10.0, 20.0, -5.0, -10.0, -20.0] {
        let drive = Drive {
            slope_deg,
            friction: 0.8,
            kerb_m: None,
            speeds: &[],
            duration_s: 16.0,
        };
        let rows = drive.rows(vehicle)?;
        println!(
            "roll-back on {slope_deg:5} deg: {:.3} m, {:.3} m left, {}",
            peak(&rows, |r| r.truth.x_m),
            rows.last().map_or(f64::NAN, |r| r.truth.x_m.abs()),
            peaks(&rows)
        );
    }
    Ok(())
}

fn kerbs(vehicle: &Vehicle<f64>) -> Result<(), Failure> {
    let (mut runs, mut faulty, mut worst) = (0, 0, 0.0_f64);
    for slope_deg in [0.0, 10.0] {
        for height_mm in [5.0, 10.0, 20.0, 30.0, 40.0, 50.0, -10.0, -20.0, -40.0, -50.0] {
            for speed in [0.3, 0.6, 1.0, 1.5, 2.5] {
                let drive = Drive {
                    slope_deg,
                    friction: 0.8,
                    kerb_m: Some(0.001 * height_mm),
                    speeds: &[(8.0, speed), (20.0, 0.0)],
                    duration_s: 26.0,
                };
                let rows = drive.rows(vehicle)?;
                let over = peak(&between(&rows, 8.0, 26.0), |r| r.truth.speed_m_s) - speed;
                let faults = rows.last().map_or(FaultSet::EMPTY, |r| r.status.faults);
                runs += 1;
                faulty += u32::from(!faults.is_empty());
                worst = worst.max(over);
                let x = rows.last().map_or(f64::NAN, |r| r.truth.x_m);
                println!(
                    "kerb {height_mm:5} mm on {slope_deg:2} deg at {speed} m/s: over {over:5.2} m/s, to {x:5.1} m, {}",
                    peaks(&between(&rows, 8.0, 26.0))
                );
            }
        }
    }
    println!("kerbs: {runs} drives, {faulty} with a fault, overspeed at most {worst:.2} m/s");
    Ok(())
}

fn wall(vehicle: &Vehicle<f64>) -> Result<(), Failure> {
    for push_s in [4.0, 8.0, 20.0] {
        for speed in [0.3, 0.8] {
            let until_s = 12.0 + push_s;
            let drive = Drive {
                slope_deg: 0.0,
                friction: 0.8,
                kerb_m: Some(0.075),
                speeds: &[(4.0, speed), (until_s, -speed)],
                duration_s: until_s + 6.0,
            };
            let rows = drive.rows(vehicle)?;
            let after = between(&rows, until_s, until_s + 6.0);
            let reversed = after
                .iter()
                .find(|r| r.truth.speed_m_s < -0.5 * speed)
                .map_or(f64::INFINITY, |r| r.time_s() - until_s);
            println!(
                "wall for {push_s} s at {speed} m/s: reverses in {reversed:.2} s at up to {:.2} m/s; pushing {}; then {}",
                peak(&after, |r| r.truth.speed_m_s),
                peaks(&between(&rows, until_s - 0.5 * push_s, until_s)),
                peaks(&after)
            );
        }
    }
    Ok(())
}

fn slopes(vehicle: &Vehicle<f64>) -> Result<(), Failure> {
    let mut parameters = *vehicle.parameters();
    parameters.control.grip_mu = 0.9;
    let vehicle = &Vehicle::new(parameters)?;
    for slope_deg in [22.0, 24.0, 26.0, 28.0, 30.0, 31.0, 32.0, 35.0, -28.0, -31.0, -35.0] {
        let drive = Drive {
            slope_deg,
            friction: 0.9,
            kerb_m: None,
            speeds: &[(16.0, 0.3), (24.0, 0.0), (30.0, -0.3), (36.0, 0.0)],
            duration_s: 42.0,
        };
        let rows = drive.rows(vehicle)?;
        let at = |from: f64, to: f64| {
            let rows = between(&rows, from, to);
            rows.iter().map(|r| r.truth.speed_m_s).sum::<f64>() / rows.len().max(1) as f64
        };
        println!(
            "slope {slope_deg:5} deg: roll-back {:.2} m, up {:5.2}, down {:5.2}, held {:5.3} m/s, {}",
            peak(&between(&rows, 0.0, 15.0), |r| r.truth.x_m),
            at(20.0, 24.0),
            at(33.0, 36.0),
            at(40.0, 42.0),
            peaks(&rows)
        );
    }
    Ok(())
}
