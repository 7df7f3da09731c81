//! The arm's viability kernel against the flown barrier.

use model::control::landing::LandingLaw;
use model::sample::TICK_S;
use model::vehicle::Vehicle;
use theory::analysis::kernel::{Comparison, TorqueLimits, compare};

#[path = "../../../tests/support/generated.rs"]
mod generated;
use generated::shown;

/// The reference vehicle at a supply of U = 5.9, with the kernel's grid of `count` points to either side.
fn compared(theta_rate: f32, beta: f32, count: usize) -> Comparison {
    let file = vehicle_file::reference().expect("the reference vehicle");
    let vehicle = Vehicle::new(file.parameters().cast::<f32>()).expect("a vehicle");
    let law = LandingLaw::new(&vehicle, TICK_S);
    let limits = TorqueLimits {
        balance: *law.balance(),
        zeta: vehicle.planar(0.0).zeta,
        torque: law.barrier().torque(),
        voltage: 5.9,
        wheel_rate: theta_rate,
        beta,
        grip_mu: Some(vehicle.parameters().control.grip_mu),
    };
    compare(&limits, law.barrier(), law.planned_mu(), 1.4, count)
}

/// From at least 99.5 % of the states in which a whirl can be avoided, the barrier avoids it, whatever is commanded. A grid twice as
/// fine gives the same shares.
#[test]
fn the_flown_barrier_avoids_every_avoidable_whirl() {
    let mut least = f64::INFINITY;
    for (theta_rate, beta) in [(0.0, 0.0873), (1.6, 0.0873), (0.0, -0.35)] {
        let (coarse, fine) = (compared(theta_rate, beta, 81), compared(theta_rate, beta, 161));
        println!(
            "theta' {theta_rate}, {beta} rad: avoidable {:.3} {:.3}, avoided {:.4} {:.4}, viable {:.3} {:.3}, kept {:.3} {:.3}",
            coarse.avoidable_share,
            fine.avoidable_share,
            coarse.avoided_share,
            fine.avoided_share,
            coarse.viable_share,
            fine.viable_share,
            coarse.kept_share,
            fine.kept_share
        );
        for found in [&coarse, &fine] {
            least = least.min(found.avoided_share);
            assert!(found.avoided_share >= 0.995, "{}", found.avoided_share);
            // From some states no law can avoid a whirl, and the kernel within grip is smaller.
            assert!(found.avoidable_share < 1.0 && found.viable_share < found.avoidable_share);
        }
        for (one, other) in [
            (coarse.avoidable_share, fine.avoidable_share),
            (coarse.viable_share, fine.viable_share),
            (coarse.kept_share, fine.kept_share),
        ] {
            assert!((one - other).abs() < 0.03, "{one} {other}");
        }
    }
    shown(
        "whirls that current and voltage can avoid",
        &format!(
            "the flown barrier avoids {:.1} % of them, on either grid",
            100.0 * least
        ),
    );
}
