//! The search for a drive that the speed law does not survive, on the sampled planar vehicle.
//!
//! ```sh
//! cargo run --release -p theory --example law_search -- [PLANTS] [DRIVES] [CLIMBS] [FIRST] [eq-3.25]
//! ```
//!
//! PLANTS vehicles (1000 if left out) whose nine parameters are off by up to 20 % step from 0 to 1; DRIVES (100000) drives of
//! random steps on random slopes with random plants and supplies; from the CLIMBS (100) worst of these in which the arm swings
//! beyond where it stands, an
//! optimiser (CMA-ES) moves times and speeds of the commands to where the arm swings furthest, some 200 drives each. Prints the seed of the worst.
//!
//! The seeds of the drives are FIRST (0) and those after it: a long search is as many short ones, one after the other or on as
//! many machines, whose counts add up.

use std::error::Error;

use rayon::prelude::*;

#[path = "../tests/support/sampled.rs"]
mod sampled;
use sampled::{eq_3_25_vehicle, perturbed_step, vehicle, wild_drive, worst_commands};

/// Generations of one climb.
const GENERATIONS: usize = 20;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: u64| arguments.next().map_or(Ok(default), |text| text.parse::<u64>());
    let (plants, drives, climbs) = (number(1000)?, number(100_000)?, number(100)?);
    let mut rest = arguments.peekable();
    let first_seed = rest
        .next_if(|text| text.parse::<u64>().is_ok())
        .map_or(Ok(0), |text| text.parse::<u64>())?;
    let eq_3_25 = match rest.next().as_deref() {
        None => false,
        Some("eq-3.25") => true,
        Some(other) => return Err(format!("{other}: neither a first seed nor eq-3.25").into()),
    };
    let vehicle = if eq_3_25 {
        eq_3_25_vehicle()
    } else {
        vehicle(|p| p.control.speed_max_m_s = 20.0)
    };

    let speed = vehicle.scales().speed_m_s;
    let steps: Vec<_> = (0..plants)
        .into_par_iter()
        .map(|seed| perturbed_step(&vehicle, seed))
        .collect();
    let column = |value: fn(&sampled::Step) -> f64| {
        let mut values: Vec<f64> = steps.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        [0.5, 0.95, 1.0].map(|share| values[((values.len() - 1) as f64 * share) as usize])
    };
    if plants > 0 {
        println!("{plants} plants of +-20 %, median, 95 %, worst:");
        println!("settling, time units  {:.2?}", column(|s| s.settling));
        println!("overshoot             {:.3?}", column(|s| s.overshoot));
        println!("undershoot            {:.3?}", column(|s| s.undershoot));
        println!("phi, deg              {:.1?}", column(|s| s.phi_max_deg));
        println!(
            "ripple, mm/s          {:.1?}",
            column(|s| s.ripple).map(|ripple| 1000.0 * speed * ripple)
        );
        println!("whirled               {}", steps.iter().filter(|s| s.whirled).count());
        let slow = steps.iter().enumerate().filter(|(_, s)| s.settling > 18.0);
        println!(
            "unsettled after 18    {:?}",
            slow.map(|(seed, _)| seed).collect::<Vec<_>>()
        );
    }
    let wild: Vec<_> = (first_seed..first_seed + drives)
        .into_par_iter()
        .map(|seed| wild_drive(&vehicle, seed))
        .collect();
    if let Some((seed, worst)) = wild
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.phi_max.total_cmp(&b.1.phi_max))
    {
        println!(
            "{drives} random drives: worst seed {}, {:.3} rad",
            first_seed + seed as u64,
            worst.phi_max
        );
        println!(
            "whirls                {}",
            wild.iter().filter(|w| w.phi_max > 3.1).count()
        );
        println!(
            "beyond 1.4 rad        {}",
            wild.iter().filter(|w| w.phi_max > 1.4).count()
        );
        let share = wild.iter().map(|w| w.slipping).sum::<f64>() / wild.len() as f64;
        println!("over 0.6 N, mean      {:.3} %", 100.0 * share);
    }
    let mut seeds: Vec<usize> = (0..wild.len()).filter(|seed| wild[*seed].swings).collect();
    seeds.sort_by(|a, b| wild[*b].phi_max.total_cmp(&wild[*a].phi_max));
    seeds.truncate(climbs as usize);
    let climbed: Vec<_> = seeds
        .into_par_iter()
        .map(|seed| first_seed + seed as u64)
        .map(|seed| (seed, worst_commands(&vehicle, seed, GENERATIONS)))
        .collect();
    if let Some((seed, worst)) = climbed.iter().max_by(|a, b| a.1.phi_max.total_cmp(&b.1.phi_max)) {
        println!(
            "{} of the worst optimised: seed {seed}, {:.3} rad",
            climbed.len(),
            worst.phi_max
        );
        let beyond = |angle: f64| climbed.iter().filter(|(_, w)| w.phi_max > angle).count();
        println!("whirls                {}", beyond(3.1));
        println!("beyond 1.4 rad        {}", beyond(1.4));
    }
    Ok(())
}
