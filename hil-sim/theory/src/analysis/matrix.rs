//! Dense linear algebra on small fixed arrays: products, solves, eigenvalues.
//!
//! A linear-algebra crate would double the time of a first build for matrices of at most 8 by 8; the
//! tests hold these routines against one.

/// A square matrix, row by row.
pub type Matrix<const N: usize> = [[f64; N]; N];

/// The unit matrix.
pub fn identity<const N: usize>() -> Matrix<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))))
}

/// The transpose.
pub fn transposed<const N: usize>(a: &Matrix<N>) -> Matrix<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// `a b`.
pub fn product<const N: usize>(a: &Matrix<N>, b: &Matrix<N>) -> Matrix<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..N).map(|k| a[i][k] * b[k][j]).sum()))
}

/// `a x`.
pub fn applied<const N: usize>(a: &Matrix<N>, x: &[f64; N]) -> [f64; N] {
    a.map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum())
}

/// `a + factor b`.
pub fn sum<const N: usize>(a: &Matrix<N>, factor: f64, b: &Matrix<N>) -> Matrix<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + factor * b[i][j]))
}

/// The largest absolute element.
pub fn largest<const N: usize>(a: &Matrix<N>) -> f64 {
    a.iter().flatten().fold(0.0, |m, x| m.max(x.abs()))
}

/// The solutions `x` of `a x = b` for `M` right-hand sides (the columns of `b`), and the determinant of
/// `a`; `None` if `a` is singular to working precision or not finite.
// Rows against columns: indices read better than iterators here.
#[allow(clippy::needless_range_loop)]
pub fn solved<const N: usize, const M: usize>(mut a: Matrix<N>, mut b: [[f64; M]; N]) -> Option<([[f64; M]; N], f64)> {
    let mut determinant = 1.0;
    for k in 0..N {
        let pivot = (k..N).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs()))?;
        if !(a[pivot][k].abs() > 0.0 && a[pivot][k].is_finite()) {
            return None;
        }
        if pivot != k {
            a.swap(pivot, k);
            b.swap(pivot, k);
            determinant = -determinant;
        }
        determinant *= a[k][k];
        let (upper_a, lower_a) = a.split_at_mut(k + 1);
        let (upper_b, lower_b) = b.split_at_mut(k + 1);
        for (row, right) in lower_a.iter_mut().zip(lower_b) {
            let factor = row[k] / upper_a[k][k];
            for j in k..N {
                row[j] -= factor * upper_a[k][j];
            }
            for j in 0..M {
                right[j] -= factor * upper_b[k][j];
            }
        }
    }
    for k in (0..N).rev() {
        for j in 0..M {
            let known: f64 = (k + 1..N).map(|i| a[k][i] * b[i][j]).sum();
            b[k][j] = (b[k][j] - known) / a[k][k];
        }
    }
    b.iter().flatten().all(|x| x.is_finite()).then_some((b, determinant))
}

/// The inverse and the determinant; `None` if `a` is singular to working precision.
pub fn inverse<const N: usize>(a: &Matrix<N>) -> Option<(Matrix<N>, f64)> {
    solved(*a, identity())
}

/// The eigenvalues as `[re, im]`, by real part, then by imaginary part, ascending; `None` if `a` is not
/// finite.
///
/// Reduction to Hessenberg form by reflections, then the implicit double-shift QR iteration, which
/// keeps conjugate pairs exact.
pub fn eigenvalues<const N: usize>(a: &Matrix<N>) -> Option<[[f64; 2]; N]> {
    if !a.iter().flatten().all(|x| x.is_finite()) {
        return None;
    }
    let mut h = *a;
    for column in 0..N.saturating_sub(2) {
        reflect(&mut h, column + 1, N, column, (0, N));
    }
    let mut found = [[0.0; 2]; N];
    let mut end = N;
    let mut tries = 0;
    while end > 0 {
        let start = (1..end).rev().find(|&i| negligible(&h, i)).unwrap_or(0);
        match end - start {
            1 => found[start] = [h[start][start], 0.0],
            2 => {
                let block = [
                    [h[start][start], h[start][start + 1]],
                    [h[start + 1][start], h[start + 1][start + 1]],
                ];
                [found[start], found[start + 1]] = pair(block);
            }
            _ => {
                tries += 1;
                // Far beyond what any matrix needs: a bound, so that the loop ends whatever comes.
                if tries > 60 * N {
                    return None;
                }
                double_shift_step(&mut h, start, end, tries % 11 == 10);
                continue;
            }
        }
        end = start;
        tries = 0;
    }
    found.sort_by(|p, q| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])));
    Some(found)
}

/// Whether the element below the diagonal in row `i` is lost beside its neighbours.
fn negligible<const N: usize>(h: &Matrix<N>, i: usize) -> bool {
    let near = h[i][i].abs() + h[i - 1][i - 1].abs();
    let scale = if near > 0.0 { near } else { largest(h) };
    h[i][i - 1].abs() <= f64::EPSILON * scale
}

/// Applies from both sides the reflection of rows `first..last` that leaves only the first of them in
/// `column`; columns and rows outside `active` are not needed any more.
fn reflect<const N: usize>(h: &mut Matrix<N>, first: usize, last: usize, column: usize, active: (usize, usize)) {
    let v: Vec<f64> = h[first..last].iter().map(|row| row[column]).collect();
    reflect_along(h, first, v, active);
}

/// Applies from both sides the reflection that turns `v` (in rows from `first` on) into its first axis.
#[allow(clippy::needless_range_loop)] // A column of every row.
fn reflect_along<const N: usize>(h: &mut Matrix<N>, first: usize, mut v: Vec<f64>, active: (usize, usize)) {
    let length = v.iter().fold(0.0_f64, |m, x| m.hypot(*x));
    if length == 0.0 || v[1..].iter().all(|x| *x == 0.0) {
        return;
    }
    v[0] += length.copysign(v[0]);
    let square: f64 = v.iter().map(|x| x * x).sum();
    for j in active.0..active.1 {
        let dot: f64 = v.iter().enumerate().map(|(k, v)| v * h[first + k][j]).sum();
        for (k, v) in v.iter().enumerate() {
            h[first + k][j] -= 2.0 * dot / square * v;
        }
    }
    for row in &mut h[active.0..active.1] {
        let dot: f64 = v.iter().enumerate().map(|(k, v)| v * row[first + k]).sum();
        for (k, v) in v.iter().enumerate() {
            row[first + k] -= 2.0 * dot / square * v;
        }
    }
}

/// One double-shift QR step on the unreduced block `start..end` (at least 3 by 3).
fn double_shift_step<const N: usize>(h: &mut Matrix<N>, start: usize, end: usize, exceptional: bool) {
    let (p, q) = (end - 2, end - 1);
    let (mut trace, mut determinant) = (h[p][p] + h[q][q], h[p][p] * h[q][q] - h[p][q] * h[q][p]);
    if exceptional {
        // A shift unlike the others, in case they cycle.
        let w = h[q][p].abs() + h[p][p - 1].abs();
        trace = 1.5 * w;
        determinant = w * w;
    }
    let s = start;
    let mut v = vec![
        h[s][s] * (h[s][s] - trace) + h[s][s + 1] * h[s + 1][s] + determinant,
        h[s + 1][s] * (h[s][s] + h[s + 1][s + 1] - trace),
        h[s + 1][s] * h[s + 2][s + 1],
    ];
    for k in start..end - 1 {
        reflect_along(h, k, v, (start, end));
        if k + 2 >= end {
            break;
        }
        // The bulge, in the column the next reflection clears.
        v = h[k + 1..end.min(k + 4)].iter().map(|row| row[k]).collect();
    }
    for i in start + 2..end {
        for element in &mut h[i][start..i - 1] {
            *element = 0.0;
        }
    }
}

/// The eigenvalues of a 2 by 2 block, without cancellation.
fn pair(block: Matrix<2>) -> [[f64; 2]; 2] {
    let [[a, b], [c, d]] = block;
    let (mean, half) = (0.5 * (a + d), 0.5 * (a - d));
    let discriminant = half * half + b * c;
    if discriminant < 0.0 {
        let im = (-discriminant).sqrt();
        return [[mean, -im], [mean, im]];
    }
    let far = half + discriminant.sqrt().copysign(half);
    // The eigenvalue farther from d, then the other one from the product of their distances to d.
    let near = if far == 0.0 { 0.0 } else { -b * c / far };
    [[d + far, 0.0], [d + near, 0.0]]
}

#[cfg(test)]
#[path = "matrix_tests.rs"]
mod tests;
