//! Helpers of the tests: random chains with known spectrum, and checks of a decomposition.

use super::*;
use std::f64::consts::TAU;

mod accuracy;
mod limits;

/// A linear congruential generator: reproducible, and random enough for matrices.
struct Random(u64);

impl Random {
    /// Uniform in (−1, 1).
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn matrix(&mut self, n: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |_, _| self.next())
    }

    fn orthogonal(&mut self, n: usize) -> DMatrix<f64> {
        self.matrix(n).qr().q()
    }

    /// A matrix with condition number of at most about 10.
    fn well_conditioned(&mut self, n: usize) -> DMatrix<f64> {
        let skew = DMatrix::from_fn(
            n,
            n,
            |i, j| if i < j { self.next() / n as f64 } else { 0.0 },
        );
        let stretch = DMatrix::from_fn(n, n, |i, j| {
            if i == j {
                1.25 + 0.75 * self.next()
            } else {
                0.0
            }
        });
        self.orthogonal(n) * (stretch + skew)
    }
}

/// One real eigenvalue or one complex pair of a product that a test builds.
#[derive(Clone, Copy)]
enum Part {
    /// log₁₀ of the modulus, and the sign.
    Real(f64, f64),
    /// log₁₀ of the modulus, and the argument.
    Pair(f64, f64),
}

/// Factors X_{k+1} D_k X_k⁻¹ whose product has the given eigenvalues; D_k contains the m-th root of each, up to sign.
fn chain_of(parts: &[Part], m: usize, random: &mut Random) -> Vec<DMatrix<f64>> {
    let n = parts
        .iter()
        .map(|part| if matches!(part, Part::Real(..)) { 1 } else { 2 })
        .sum();
    let first = random.well_conditioned(n);
    let mut right = first.clone();
    (0..m)
        .map(|k| {
            let left = if k + 1 == m {
                first.clone()
            } else {
                random.well_conditioned(n)
            };
            let mut d = DMatrix::zeros(n, n);
            let mut row = 0;
            for part in parts {
                match *part {
                    Part::Real(log, sign) => {
                        d[(row, row)] =
                            10f64.powf(log / m as f64) * if k == 0 { sign } else { 1.0 };
                        row += 1;
                    }
                    Part::Pair(log, argument) => {
                        let (sin, cos) = (argument / m as f64).sin_cos();
                        let size = 10f64.powf(log / m as f64);
                        for (i, j, x) in [(0, 0, cos), (0, 1, -sin), (1, 0, sin), (1, 1, cos)] {
                            d[(row + i, row + j)] = size * x;
                        }
                        row += 2;
                    }
                }
            }
            let inverse = right
                .clone()
                .try_inverse()
                .expect("the condition number is bounded");
            let factor = &left * d * inverse;
            right = left;
            factor
        })
        .collect()
}

/// The largest relative distance of the computed multipliers from the parts, which are sorted by decreasing modulus.
#[track_caller]
fn distance(found: &[Multiplier], parts: &[Part]) -> f64 {
    let expected: Vec<(f64, f64)> = parts
        .iter()
        .flat_map(|part| match *part {
            Part::Real(log, sign) => vec![(log, if sign < 0.0 { PI } else { 0.0 })],
            Part::Pair(log, argument) => vec![(log, argument), (log, -argument)],
        })
        .collect();
    assert_eq!(found.len(), expected.len());
    let ten = 10f64.ln();
    found
        .iter()
        .zip(expected)
        .fold(0.0, |most, (found, (log, argument))| {
            let turn = (found.argument - argument).rem_euclid(TAU);
            most.max((found.log_modulus - log * ten).abs())
                .max(turn.min(TAU - turn))
        })
}

/// The error bound for well-conditioned chains: m factors with an error of a few n ε each, amplified by the condition
/// numbers of the factor and of the eigenvectors, each about ten.
fn bound(m: usize, n: usize) -> f64 {
    100.0 * (m * n) as f64 * f64::EPSILON
}

/// Checks the order: decreasing moduli, pairs adjacent and conjugate, arguments in range.
#[track_caller]
fn check_order(found: &[Multiplier]) {
    assert!(
        found
            .windows(2)
            .all(|pair| pair[0].log_modulus >= pair[1].log_modulus)
    );
    let mut row = 0;
    while row < found.len() {
        let argument = found[row].argument;
        assert!(argument > -PI && argument <= PI && !found[row].log_modulus.is_nan());
        if argument == 0.0 || argument == PI {
            row += 1;
        } else {
            assert!(argument > 0.0);
            assert_eq!(
                found[row + 1],
                Multiplier {
                    argument: -argument,
                    ..found[row]
                }
            );
            row += 2;
        }
    }
}

/// Checks A_k Q_k = Q_{k+1} T_k, orthogonality and the shape of T_k.
#[track_caller]
fn check_schur(factors: &[DMatrix<f64>]) {
    let (n, m) = (factors[0].nrows(), factors.len());
    let schur = PeriodicSchur::new(factors).expect("converges");
    let (q, t) = (schur.orthogonal(), schur.triangular());
    // About ten QR steps for each eigenvalue, with n reflections each.
    let tolerance = 10.0 * (n * n).max(10) as f64 * f64::EPSILON;
    for k in 0..m {
        assert!((q[k].transpose() * &q[k] - DMatrix::identity(n, n)).norm() < tolerance);
        assert!(
            (&factors[k] * &q[k] - &q[(k + 1) % m] * &t[k]).norm() <= tolerance * factors[k].norm()
        );
        for j in 0..n {
            for i in j + 1..n {
                assert!(
                    t[k][(i, j)] == 0.0 || (k + 1 == m && i == j + 1),
                    "T_{k} is filled at ({i}, {j})"
                );
            }
        }
    }
    assert!((2..n).all(|i| t[m - 1][(i, i - 1)] == 0.0 || t[m - 1][(i - 1, i - 2)] == 0.0));
    check_order(schur.multipliers());
}

#[track_caller]
fn check_parts(parts: &[Part], m: usize, seed: u64) {
    let factors = chain_of(parts, m, &mut Random(seed));
    let n = factors[0].nrows();
    let found = multipliers(&factors).expect("converges");
    check_order(&found);
    let error = distance(&found, parts);
    assert!(
        error < bound(m, n),
        "error {error:e} of seed {seed}, m = {m}"
    );
    if m <= 100 {
        check_schur(&factors);
        let schur = PeriodicSchur::new(&factors).expect("converges");
        assert!(distance(schur.multipliers(), parts) < bound(m, n));
    }
}
