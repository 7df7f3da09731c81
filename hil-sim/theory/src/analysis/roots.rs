//! Roots and maxima of smooth functions of one variable, and the roots of a cubic.

/// The root of `f` between `a` and `b`, at which `f` has different signs, to within `tolerance` in the
/// argument: the secant of the Illinois method, with a bisection every fourth time.
pub fn root_between(mut f: impl FnMut(f64) -> f64, a: f64, b: f64, tolerance: f64) -> f64 {
    let (mut a, mut b) = (a, b);
    let (mut fa, mut fb) = (f(a), f(b));
    for k in 0..200 {
        let width = (b - a).abs();
        if fa == 0.0 || width <= tolerance {
            return a;
        }
        if fb == 0.0 {
            return b;
        }
        let secant = b - fb * (b - a) / (fb - fa);
        let middle = 0.5 * (a + b);
        let inside = (secant - a) * (secant - b) < 0.0;
        let x = if inside && k % 4 != 3 { secant } else { middle };
        let fx = f(x);
        if (fx > 0.0) == (fb > 0.0) {
            (b, fb) = (x, fx);
            fa *= 0.5;
        } else {
            (a, fa) = (b, fb);
            (b, fb) = (x, fx);
        }
    }
    0.5 * (a + b)
}

/// Golden-section steps after which no number lies between the ends of an interval.
const SECTIONS: usize = 80;

/// The place and the value of the only maximum of `f` on `[a, b]`, by golden section, to within `tolerance` in the
/// argument or to its last digits.
pub fn maximum_between(mut f: impl FnMut(f64) -> f64, a: f64, b: f64, tolerance: f64) -> (f64, f64) {
    let g = 0.618_033_988_749_894_8;
    let (mut a, mut b) = (a, b);
    let (mut x1, mut x2) = (b - g * (b - a), a + g * (b - a));
    let (mut f1, mut f2) = (f(x1), f(x2));
    for _ in 0..SECTIONS {
        if b - a <= tolerance {
            break;
        }
        if f1 >= f2 {
            (b, x2, f2) = (x2, x1, f1);
            x1 = b - g * (b - a);
            f1 = f(x1);
        } else {
            (a, x1, f1) = (x1, x2, f2);
            x2 = a + g * (b - a);
            f2 = f(x2);
        }
    }
    if f1 >= f2 { (x1, f1) } else { (x2, f2) }
}

/// The roots of `a3 s^3 + a2 s^2 + a1 s + a0` with real coefficients and `a3 != 0`, as `[re, im]`,
/// the real parts in ascending order, a pair as `-im` then `+im`.
pub fn cubic_roots([a0, a1, a2, a3]: [f64; 4]) -> [[f64; 2]; 3] {
    let (b, c, d) = (a2 / a3, a1 / a3, a0 / a3);
    let value = |s: f64| ((s + b) * s + c) * s + d;
    // A real root lies within Cauchy's bound.
    let bound = 1.0 + b.abs().max(c.abs()).max(d.abs());
    let mut r = if d == 0.0 {
        0.0
    } else {
        root_between(value, -bound, bound, 0.0)
    };
    for _ in 0..3 {
        let slope = (3.0 * r + 2.0 * b) * r + c;
        if slope != 0.0 {
            let better = r - value(r) / slope;
            if value(better).abs() < value(r).abs() {
                r = better;
            }
        }
    }
    // The quadratic factor s^2 + p s + q, by the division that loses no digits.
    let p = b + r;
    let q = if r.abs() > 1.0 && d != 0.0 { -d / r } else { c + p * r };
    let discriminant = p * p - 4.0 * q;
    let mut roots = if discriminant < 0.0 {
        let im = 0.5 * (-discriminant).sqrt();
        [[r, 0.0], [-0.5 * p, -im], [-0.5 * p, im]]
    } else {
        let far = -0.5 * (p + discriminant.sqrt().copysign(p));
        let near = if far == 0.0 { 0.0 } else { q / far };
        [[r, 0.0], [far, 0.0], [near, 0.0]]
    };
    roots.sort_by(|x, y| x[0].total_cmp(&y[0]).then(x[1].total_cmp(&y[1])));
    roots
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_cubic_is_the_product_of_its_roots(r in -60.0_f64..60.0, re in -30.0_f64..30.0, im in 0.01_f64..30.0, a3 in 0.01_f64..9.0) {
            let a = [-r * (re * re + im * im) * a3, (re * re + im * im + 2.0 * r * re) * a3, -(2.0 * re + r) * a3, a3];
            let found = cubic_roots(a);
            for wanted in [[r, 0.0], [re, im], [re, -im]] {
                let near = found.iter().any(|z| (z[0] - wanted[0]).hypot(z[1] - wanted[1]) < 1e-6 * (1.0 + wanted[0].hypot(wanted[1])));
                prop_assert!(near, "{found:?} lacks {wanted:?}");
            }
        }
    }

    #[test]
    fn three_real_roots() {
        let found = cubic_roots([-0.006, 0.11, -0.6, 1.0]);
        for (z, wanted) in found.iter().zip([0.1, 0.2, 0.3]) {
            assert!((z[0] - wanted).abs() < 1e-12 && z[1] == 0.0);
        }
        assert_eq!(cubic_roots([0.0, 0.0, 2.0, 1.0]).map(|z| z[0]), [-2.0, 0.0, 0.0]);
    }

    #[test]
    fn roots_and_maxima_are_found() {
        assert!((root_between(f64::cos, 1.0, 2.0, 1e-14) - std::f64::consts::FRAC_PI_2).abs() < 1e-13);
        let (x, y) = maximum_between(|x| 3.0 - (x - 0.7).powi(2), 0.0, 2.0, 1e-9);
        assert!((x - 0.7).abs() < 1e-7 && (y - 3.0).abs() < 1e-14);
    }

    /// Near 1e9 neighbouring numbers are 1e-7 apart, so no interval there can become as narrow as 1e-12.
    #[test]
    fn a_tolerance_finer_than_the_numbers_ends_at_the_last_digits() {
        let peak = 1e9 + 0.3;
        let (x, _) = maximum_between(|x| -(x - peak).abs(), 1e9, 1e9 + 1.0, 1e-12);
        assert!((x - peak).abs() < 1e-6, "{x}");
        assert!((root_between(|x| x - peak, 1e9, 1e9 + 1.0, 1e-12) - peak).abs() < 1e-6);
    }
}
