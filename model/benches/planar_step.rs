//! One RK4 step of the planar vehicle, in f64 and f32, against plain C at -O3 on the same machine.
//!
//! `cargo bench -p model --bench planar_step` compiles `planar_step.c` beside this file with the system's C
//! compiler (`CC`, else `cc`), runs both in turns, and prints the ratio of the shortest times. Whoever has
//! no C compiler gets the Rust times alone.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use criterion::{Criterion, criterion_group, criterion_main};
use model::dynamics::planar::{Planar, PlanarParameters, PlanarState};
use model::real::Real;

/// Steps of one round of the comparison.
const STEPS: u64 = 1_000_000;
/// Rounds of the comparison.
const ROUNDS: u32 = 15;

/// The same run as in C: a step of 4 from near rest, with steps of 1 ms of the reference vehicle.
fn drive<T: Real>(steps: u64) -> (Duration, PlanarState<T>) {
    let planar = Planar::new(black_box(PlanarParameters::<T>::thesis()));
    let mut x = [T::ZERO, T::from_f64(0.12139), T::ZERO, T::ZERO];
    let (u, h) = (black_box(T::from_f64(4.0)), black_box(T::from_f64(0.00625)));
    let start = Instant::now();
    for _ in 0..steps {
        x = planar.rk4(&x, u, h);
    }
    (start.elapsed(), black_box(x))
}

/// Compiles the C program for one number type; `None` without a C compiler.
fn compile(real: &str, sin: &str, cos: &str) -> Option<PathBuf> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/planar_step.c");
    let program = std::env::temp_dir().join(format!("planar-step-{real}-{}", std::process::id()));
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let status = Command::new(compiler)
        .args(["-std=c99", "-O3"])
        .args([format!("-DREAL={real}"), format!("-DSIN={sin}"), format!("-DCOS={cos}")])
        .arg(source)
        .arg("-o")
        .arg(&program)
        .arg("-lm")
        .status();
    matches!(status, Ok(s) if s.success()).then_some(program)
}

/// Runs the C program: its own time for `steps` and its final phi.
fn run(program: &Path, steps: u64) -> (Duration, f64) {
    let output = Command::new(program)
        .arg(steps.to_string())
        .output()
        .expect("the compiled C program runs");
    let text = String::from_utf8_lossy(&output.stdout);
    let mut words = text.split_whitespace();
    let nanoseconds = words.next().and_then(|w| w.parse().ok()).expect("it prints its time");
    let phi = words.nth(1).and_then(|w| w.parse().ok()).expect("it prints its state");
    (Duration::from_nanos(nanoseconds), phi)
}

/// Runs Rust and C in turns and prints the shortest time of each.
fn compare<T: Real>(name: &str, program: &Path, tolerance: f64) {
    let (mut rust, mut c) = (Duration::MAX, Duration::MAX);
    for _ in 0..ROUNDS {
        let (ours, x) = drive::<T>(STEPS);
        let (theirs, phi) = run(program, STEPS);
        assert!(
            (x[1].to_f64() - phi).abs() < tolerance,
            "both compute the same: {} {phi}",
            x[1].to_f64()
        );
        (rust, c) = (rust.min(ours), c.min(theirs));
    }
    let per_step = |d: Duration| d.as_secs_f64() * 1e9 / STEPS as f64;
    let ratio = 100.0 * rust.as_secs_f64() / c.as_secs_f64();
    println!(
        "{name}: Rust {:.1} ns a step, C {:.1} ns a step, {ratio:.1} %",
        per_step(rust),
        per_step(c)
    );
}

fn planar_step(criterion: &mut Criterion) {
    let programs = [compile("double", "sin", "cos"), compile("float", "sinf", "cosf")];
    if let [Some(double), Some(single)] = &programs {
        compare::<f64>("f64", double, 1e-9);
        compare::<f32>("f32", single, 1e-3);
    } else {
        println!("no C compiler: Rust alone");
    }
    let mut group = criterion.benchmark_group("planar RK4 step");
    group.bench_function("f64", |b| b.iter_custom(|n| drive::<f64>(n).0));
    group.bench_function("f32", |b| b.iter_custom(|n| drive::<f32>(n).0));
    for (name, program) in ["f64 in C", "f32 in C"].iter().zip(&programs) {
        if let Some(program) = program {
            group.bench_function(*name, |b| b.iter_custom(|n| run(program, n).0));
        }
    }
    group.finish();
    for program in programs.iter().flatten() {
        _ = std::fs::remove_file(program);
    }
}

criterion_group!(benches, planar_step);
criterion_main!(benches);
