use super::*;
use nalgebra::SMatrix;

/// A fixed sequence of numbers in (-1, 1).
fn numbers(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

fn compare<const N: usize>(a: &Matrix<N>, tolerance: f64) {
    let got = eigenvalues(a).unwrap();
    let dynamic = nalgebra::DMatrix::from_fn(N, N, |i, j| a[i][j]);
    let mut want: Vec<[f64; 2]> = dynamic.complex_eigenvalues().iter().map(|z| [z.re, z.im]).collect();
    for g in got {
        let nearest = (0..want.len())
            .min_by(|&i, &j| {
                let distance = |w: [f64; 2]| (w[0] - g[0]).hypot(w[1] - g[1]);
                distance(want[i]).total_cmp(&distance(want[j]))
            })
            .unwrap();
        let w = want.swap_remove(nearest);
        assert!((w[0] - g[0]).hypot(w[1] - g[1]) < tolerance, "{g:?} {w:?} {a:?}");
    }
}

#[test]
fn eigenvalues_agree_with_a_linear_algebra_library() {
    let mut next = numbers(7);
    for _ in 0..300 {
        compare::<4>(&std::array::from_fn(|_| std::array::from_fn(|_| next())), 1e-10);
        compare::<8>(&std::array::from_fn(|_| std::array::from_fn(|_| next())), 1e-9);
    }
}

#[test]
fn known_eigenvalues() {
    assert_eq!(eigenvalues(&[[3.0]]), Some([[3.0, 0.0]]));
    assert_eq!(eigenvalues(&[[0.0, 1.0], [-4.0, 0.0]]), Some([[0.0, -2.0], [0.0, 2.0]]));
    // A cyclic permutation: the roots of unity, which an unshifted iteration never separates.
    let cycle = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let roots = eigenvalues(&cycle).unwrap();
    for (r, w) in roots
        .iter()
        .zip([[-0.5, -0.75_f64.sqrt()], [-0.5, 0.75_f64.sqrt()], [1.0, 0.0]])
    {
        assert!((r[0] - w[0]).hypot(r[1] - w[1]) < 1e-14, "{roots:?}");
    }
    assert_eq!(eigenvalues(&[[f64::NAN, 0.0], [0.0, 1.0]]), None);
    assert_eq!(eigenvalues(&[[0.0; 5]; 5]), Some([[0.0; 2]; 5]));
}

#[test]
fn solves_and_inverts() {
    let mut next = numbers(3);
    for _ in 0..100 {
        let a: Matrix<5> = std::array::from_fn(|_| std::array::from_fn(|_| next()));
        let (inverted, determinant) = inverse(&a).unwrap();
        let unit = product(&a, &inverted);
        let condition = largest(&a) * largest(&inverted);
        assert!(largest(&sum(&unit, -1.0, &identity())) < 1e-14 * condition.max(1.0));
        let want = SMatrix::<f64, 5, 5>::from_fn(|i, j| a[i][j]).determinant();
        assert!((determinant - want).abs() < 1e-13);
    }
    assert!(inverse(&[[1.0, 2.0], [2.0, 4.0]]).is_none());
}
