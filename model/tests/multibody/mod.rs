//! An oracle without any closed form: point masses whose positions are written as functions of the
//! coordinates, Jacobians by automatic differentiation, and d'Alembert's principle.
#![allow(dead_code)] // Each test binary uses its own part.

use nalgebra::{DMatrix, DVector};
use std::ops::{Add, Mul, Neg, Sub};

/// A truncated Taylor series in time: value, first and second derivative.
#[derive(Debug, Clone, Copy)]
pub struct Jet {
    pub value: f64,
    pub rate: f64,
    pub acceleration: f64,
}

impl Jet {
    pub fn constant(value: f64) -> Self {
        Self {
            value,
            rate: 0.0,
            acceleration: 0.0,
        }
    }
    pub fn sin(self) -> Self {
        let (s, c) = self.value.sin_cos();
        Self {
            value: s,
            rate: c * self.rate,
            acceleration: c * self.acceleration - s * self.rate * self.rate,
        }
    }
    pub fn cos(self) -> Self {
        let (s, c) = self.value.sin_cos();
        Self {
            value: c,
            rate: -s * self.rate,
            acceleration: -s * self.acceleration - c * self.rate * self.rate,
        }
    }
}
impl Add for Jet {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self {
            value: self.value + o.value,
            rate: self.rate + o.rate,
            acceleration: self.acceleration + o.acceleration,
        }
    }
}
impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        Self {
            value: -self.value,
            rate: -self.rate,
            acceleration: -self.acceleration,
        }
    }
}
impl Sub for Jet {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}
impl Mul for Jet {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self {
            value: self.value * o.value,
            rate: self.rate * o.value + self.value * o.rate,
            acceleration: self.acceleration * o.value + 2.0 * self.rate * o.rate + self.value * o.acceleration,
        }
    }
}
impl Mul<Jet> for f64 {
    type Output = Jet;
    fn mul(self, o: Jet) -> Jet {
        Jet::constant(self) * o
    }
}

/// A point mass: its mass and its position.
pub type Point = (f64, [Jet; 3]);

/// A system of point masses and spinning inertias in `N` coordinates.
pub struct Multibody<'a, const N: usize> {
    /// The point masses at given coordinates.
    pub points: &'a dyn Fn(&[Jet; N]) -> Vec<Point>,
    /// Inertias whose spin is a fixed combination of the rates.
    pub spins: &'a [(f64, [f64; N])],
    /// Gravity (an acceleration).
    pub gravity: [f64; 3],
}

/// `M q'' = force`: mass matrix and everything else but the applied generalised forces.
pub struct Equations {
    pub mass: DMatrix<f64>,
    pub force: DVector<f64>,
}

impl<const N: usize> Multibody<'_, N> {
    fn at(&self, q: &[f64; N], rate: &[f64; N]) -> Vec<Point> {
        (self.points)(&std::array::from_fn(|i| Jet {
            value: q[i],
            rate: rate[i],
            acceleration: 0.0,
        }))
    }

    /// Mass matrix J^T m J and force J^T m (gravity - J' q').
    pub fn equations(&self, q: &[f64; N], rates: &[f64; N]) -> Equations {
        let moving = self.at(q, rates);
        let columns: Vec<Vec<Point>> = (0..N)
            .map(|j| self.at(q, &std::array::from_fn(|i| f64::from(u8::from(i == j)))))
            .collect();
        let mut mass = DMatrix::zeros(N, N);
        let mut force = DVector::zeros(N);
        for k in 0..moving.len() {
            let m = moving[k].0;
            for axis in 0..3 {
                for i in 0..N {
                    let ji = columns[i][k].1[axis].rate;
                    force[i] += m * ji * (self.gravity[axis] - moving[k].1[axis].acceleration);
                    for j in 0..N {
                        mass[(i, j)] += m * ji * columns[j][k].1[axis].rate;
                    }
                }
            }
        }
        for (inertia, weights) in self.spins {
            for i in 0..N {
                for j in 0..N {
                    mass[(i, j)] += inertia * weights[i] * weights[j];
                }
            }
        }
        Equations { mass, force }
    }

    /// The energy, by the definition: half the sum of m v^2 plus potential.
    pub fn energy(&self, q: &[f64; N], rates: &[f64; N]) -> f64 {
        let points = self.at(q, rates);
        let translation: f64 = points
            .iter()
            .map(|(m, p)| {
                (0..3)
                    .map(|a| m * (0.5 * p[a].rate * p[a].rate - self.gravity[a] * p[a].value))
                    .sum::<f64>()
            })
            .sum();
        let spin: f64 = self
            .spins
            .iter()
            .map(|(inertia, w)| 0.5 * inertia * (0..N).map(|i| w[i] * rates[i]).sum::<f64>().powi(2))
            .sum();
        translation + spin
    }

    /// The accelerations of the free system under generalised forces `applied`.
    pub fn accelerations(&self, q: &[f64; N], rates: &[f64; N], applied: &[f64; N]) -> [f64; N] {
        let Equations { mass, force } = self.equations(q, rates);
        let solution = mass
            .lu()
            .solve(&(force + DVector::from_row_slice(applied)))
            .expect("regular");
        std::array::from_fn(|i| solution[i])
    }

    /// The accelerations under forces `applied` and constraints `a q' = 0`, by Lagrange multipliers:
    /// `a` gives the constraint matrix as jets along the motion, so that its derivative is exact.
    pub fn constrained<const C: usize>(
        &self,
        q: &[f64; N],
        rates: &[f64; N],
        applied: &[f64; N],
        a: &dyn Fn(&[Jet; N]) -> [[Jet; N]; C],
    ) -> ([f64; N], [f64; C]) {
        let Equations { mass, force } = self.equations(q, rates);
        let rows = a(&std::array::from_fn(|i| Jet {
            value: q[i],
            rate: rates[i],
            acceleration: 0.0,
        }));
        let mut system = DMatrix::zeros(N + C, N + C);
        let mut right = DVector::zeros(N + C);
        system.view_mut((0, 0), (N, N)).copy_from(&mass);
        for i in 0..N {
            right[i] = force[i] + applied[i];
        }
        for (c, row) in rows.iter().enumerate() {
            for i in 0..N {
                system[(N + c, i)] = row[i].value;
                system[(i, N + c)] = -row[i].value;
                right[N + c] -= row[i].rate * rates[i];
            }
        }
        let solution = system.lu().solve(&right).expect("regular");
        (
            std::array::from_fn(|i| solution[i]),
            std::array::from_fn(|c| solution[N + c]),
        )
    }
}
