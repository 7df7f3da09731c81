//! Nelder and Mead's simplex search (The Computer Journal 7, 1965, p. 308): the largest value of a function without
//! derivatives.

use std::cell::Cell;

/// A point and its value.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Coordinates.
    pub point: Vec<f64>,
    /// The function's value there.
    pub value: f64,
}

/// Climbs from `start`, whose coordinates it first varies by `step` each, with `evaluations` of `function` or a few more;
/// returns the best point seen. The same input gives the same output, bit for bit.
///
/// ```
/// use theory::analysis::simplex::maximise;
/// // A ridge along x = y whose top is at (2, 2).
/// let ridge = |p: &[f64]| -10.0 * (p[0] - p[1]).powi(2) - (p[0] + p[1] - 4.0).powi(2);
/// let top = maximise(ridge, &[0.0, 1.0], 0.5, 200);
/// assert!(top.value > -1e-6 && (top.point[0] - 2.0).abs() < 1e-3, "{top:?}");
/// ```
pub fn maximise(mut function: impl FnMut(&[f64]) -> f64, start: &[f64], step: f64, evaluations: usize) -> Found {
    let left = Cell::new(evaluations);
    let mut at = |point: Vec<f64>| {
        left.set(left.get().saturating_sub(1));
        Found {
            value: function(&point),
            point,
        }
    };
    let mut best = at(start.to_vec());
    let mut others: Vec<Found> = (0..start.len())
        .map(|k| {
            let mut point = start.to_vec();
            point[k] += step;
            at(point)
        })
        .collect();
    while left.get() > 0 {
        others.sort_by(|a, b| b.value.total_cmp(&a.value));
        if others.first().is_some_and(|first| first.value > best.value) {
            std::mem::swap(&mut best, &mut others[0]);
        }
        let Some(worst) = others.pop() else { break };
        let second = others.last().map_or(best.value, |found| found.value);
        let kept = others.len() as f64 + 1.0;
        let centre = |k: usize| (best.point[k] + others.iter().map(|found| found.point[k]).sum::<f64>()) / kept;
        // A point on the line from the worst through the centre of the others.
        let along = |share: f64| -> Vec<f64> {
            let from_worst = |(k, worst): (usize, &f64)| centre(k) + share * (centre(k) - worst);
            worst.point.iter().enumerate().map(from_worst).collect()
        };
        let reflected = at(along(1.0));
        let taken = if reflected.value > best.value {
            let expanded = at(along(2.0));
            Some(if expanded.value > reflected.value {
                expanded
            } else {
                reflected
            })
        } else if reflected.value > second {
            Some(reflected)
        } else {
            let contracted = at(along(if reflected.value > worst.value { 0.5 } else { -0.5 }));
            (contracted.value > worst.value.max(reflected.value)).then_some(contracted)
        };
        if let Some(taken) = taken {
            others.push(taken);
        } else {
            // No way is up: all come half-way to the best.
            others.push(worst);
            for found in &mut others {
                let halved = found.point.iter().zip(&best.point).map(|(a, b)| 0.5 * (a + b));
                *found = at(halved.collect());
            }
        }
    }
    others.push(best);
    others.sort_by(|a, b| b.value.total_cmp(&a.value));
    others.swap_remove(0)
}
