//! Covariance matrix adaptation: finds a minimum of a function of some ten numbers without derivatives.
//!
//! The (mu/mu_w, lambda) strategy with rank-one and rank-mu updates and cumulative step-size control, with the standard
//! settings of N. Hansen, "The CMA Evolution Strategy: A Tutorial" (2016). The project has its own implementation
//! because it is only one page on top of `nalgebra`, and because the same random numbers must give the same result on
//! every machine.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

/// The best point found.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    /// The point's coordinates.
    pub at: Vec<f64>,
    /// The function's value there.
    pub value: f64,
}

/// Searches from `start` with the initial deviation `deviation` for `generations` generations, and returns the best of
/// all evaluated points. `normal` returns numbers with mean 0 and deviation 1. A NaN value counts as infinite. The
/// points of a generation are evaluated in parallel.
///
/// ```
/// use theory::analysis::cma_es::minimise;
/// // A narrow bent valley, searched with pseudo-random numbers.
/// let valley = |x: &[f64]| (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2);
/// let mut bits = 1_u64;
/// let mut uniform = move || {
///     bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
///     (bits >> 11) as f64 / (1_u64 << 53) as f64
/// };
/// let normal = move || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
/// let found = minimise(&[-1.5, 2.0], 0.5, 300, normal, valley);
/// assert!((found.at[0] - 1.0).abs() < 1e-6 && (found.at[1] - 1.0).abs() < 1e-6, "{found:?}");
/// ```
pub fn minimise(
    start: &[f64],
    deviation: f64,
    generations: usize,
    mut normal: impl FnMut() -> f64,
    function: impl Fn(&[f64]) -> f64 + Sync,
) -> Minimum {
    let count = start.len();
    let dimension = count as f64;
    let lambda = 4 + libm::floor(3.0 * libm::log(dimension)) as usize;
    let weights = weights(lambda);
    let effective = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
    let rates = Rates::new(dimension, effective);

    let mut mean = DVector::from_column_slice(start);
    let mut sigma = deviation;
    let mut covariance = DMatrix::<f64>::identity(count, count);
    let mut path_sigma = DVector::<f64>::zeros(count);
    let mut path_c = DVector::<f64>::zeros(count);
    let mut best = Minimum {
        at: start.to_vec(),
        value: number(function(start)),
    };
    for generation in 1..=generations {
        let eigen = SymmetricEigen::new(covariance.clone());
        let roots = eigen.eigenvalues.map(|value| libm::sqrt(value.max(1e-20)));
        let steps: Vec<DVector<f64>> = (0..lambda)
            .map(|_| {
                let z = DVector::from_fn(count, |row, _| normal() * roots[row]);
                &eigen.eigenvectors * z
            })
            .collect();
        let mut tried: Vec<(f64, &DVector<f64>)> = steps
            .par_iter()
            .map(|step| (number(function((&mean + step * sigma).as_slice())), step))
            .collect();
        // A stable sort, so that equal values keep the order in which they were drawn.
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        if tried[0].0 < best.value {
            best.value = tried[0].0;
            best.at = (&mean + tried[0].1 * sigma).as_slice().to_vec();
        }
        let chosen = || weights.iter().zip(&tried).map(|(weight, (_, step))| (*weight, *step));
        let mut shift = DVector::<f64>::zeros(count);
        for (weight, step) in chosen() {
            shift += step * weight;
        }
        mean += &shift * sigma;
        let whitened = &eigen.eigenvectors * (eigen.eigenvectors.transpose() * &shift).component_div(&roots);
        path_sigma =
            &path_sigma * (1.0 - rates.sigma) + whitened * libm::sqrt(rates.sigma * (2.0 - rates.sigma) * effective);
        let length = path_sigma.norm() / rates.expected_length;
        let settled = libm::sqrt(1.0 - libm::pow(1.0 - rates.sigma, 2.0 * generation as f64));
        let moves = length / settled < 1.4 + 2.0 / (dimension + 1.0);
        path_c *= 1.0 - rates.path;
        if moves {
            path_c += &shift * libm::sqrt(rates.path * (2.0 - rates.path) * effective);
        }
        let stalled = if moves { 0.0 } else { rates.path * (2.0 - rates.path) };
        covariance *= 1.0 - rates.one - rates.mu + rates.one * stalled;
        covariance += &path_c * path_c.transpose() * rates.one;
        for (weight, step) in chosen() {
            covariance += step * step.transpose() * (rates.mu * weight);
        }
        sigma *= libm::exp((rates.sigma / rates.damping) * (length - 1.0));
    }
    best
}

/// The weights of the better half of a generation.
fn weights(lambda: usize) -> Vec<f64> {
    let parents = lambda / 2;
    let raw: Vec<f64> = (1..=parents)
        .map(|rank| libm::log(parents as f64 + 0.5) - libm::log(rank as f64))
        .collect();
    let sum: f64 = raw.iter().sum();
    raw.into_iter().map(|weight| weight / sum).collect()
}

/// Learning rates of the strategy's parts.
struct Rates {
    path: f64,
    sigma: f64,
    one: f64,
    mu: f64,
    damping: f64,
    /// Expected length of a vector of normal numbers.
    expected_length: f64,
}

impl Rates {
    fn new(n: f64, effective: f64) -> Self {
        let one = 2.0 / ((n + 1.3) * (n + 1.3) + effective);
        let mu = (2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0) * (n + 2.0) + effective)).min(1.0 - one);
        let sigma = (effective + 2.0) / (n + effective + 5.0);
        Self {
            path: (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n),
            sigma,
            one,
            mu,
            damping: 1.0 + 2.0 * (libm::sqrt((effective - 1.0) / (n + 1.0)) - 1.0).max(0.0) + sigma,
            expected_length: libm::sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n)),
        }
    }
}

fn number(value: f64) -> f64 {
    if value.is_nan() { f64::INFINITY } else { value }
}
