//! Smooth functions of a transition matrix that change sign where stability changes.
//!
//! | matrix | functions |
//! |---|---|
//! | 2 × 2, det A = 1, a₁₁ = a₂₂ | a₁₂ and a₂₁: their product is the next row's, but each has simple zeros |
//! | 2 × 2, det A = 1 | ((a₁₁ − a₂₂)/2)² + a₁₂a₂₁, positive where unstable |
//! | spectrum closed under λ ↦ 1/λ (symplectic, reversible) | det(A − 1), det(A + 1), ∏ (μᵢ − μⱼ)² with μ = λ + 1/λ, i < j ≤ N |
//! | any other | det(A − 1), det(A + 1), ∏ (λᵢλⱼ − 1), i < j |
//!
//! The rounding error of a value is measured by small perturbations of the matrix (see [`Measure::noise`]).

use super::eigenvalues::{balanced, eigenvalues_of_finite, largest_modulus};
use nalgebra::{Complex, DMatrix};

/// The relative size of these perturbations: the error of a condensed and solved element, with a margin.
const PERTURBATION: f64 = 256.0 * f64::EPSILON;

/// The functions whose changes of sign mark the changes of stability; see the table of the module.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Measure {
    EqualDiagonal,
    UnitDeterminant,
    Reciprocal,
    General,
}

impl Measure {
    /// The measure that suits all of several matrices of one size.
    ///
    /// The half of them with the least growth decides: rounding error hides the structure of the others, and a spectrum
    /// that is not reciprocal is visible in all.
    pub(super) fn suiting(samples: &[DMatrix<f64>]) -> Self {
        let mut calm: Vec<&DMatrix<f64>> = samples.iter().collect();
        calm.sort_by(|a, b| growth(a).total_cmp(&growth(b)));
        calm.truncate(samples.len().div_ceil(2));
        if !calm.iter().all(|a| has_reciprocal_spectrum(a)) {
            Self::General
        } else if samples.iter().any(|a| a.nrows() != 2) {
            Self::Reciprocal
        } else if calm.iter().all(|a| has_equal_diagonal(a)) {
            Self::EqualDiagonal
        } else {
            Self::UnitDeterminant
        }
    }

    /// The values of the functions, and the spectral radius; `None` if the eigenvalues do not converge.
    pub(super) fn of(self, a: &DMatrix<f64>) -> Option<(Vec<f64>, f64)> {
        let eigenvalues = eigenvalues_of_finite(a)?;
        let radius = largest_modulus(&eigenvalues);
        let functions = match self {
            Self::EqualDiagonal => vec![a[(0, 1)], a[(1, 0)]],
            Self::UnitDeterminant => vec![discriminant_of_two(a)],
            Self::Reciprocal => vec![
                shifted_determinant(a, -1.0),
                shifted_determinant(a, 1.0),
                collisions(&eigenvalues),
            ],
            Self::General => {
                let product = if a.nrows() == 2 {
                    determinant_of_two(a) - 1.0
                } else {
                    reciprocal_pairs(&eigenvalues)
                };
                vec![
                    shifted_determinant(a, -1.0),
                    shifted_determinant(a, 1.0),
                    product,
                ]
            }
        };
        Some((functions, radius))
    }

    /// The change of a quantity if every entry of the matrix is perturbed by a few ε of its scale (see [`scale_of`]).
    ///
    /// First-order bounds would suffice for determinants, but not for double eigenvalues, which change by √ε if
    /// defective and by ε otherwise. Actual perturbations give the right size in both cases.
    pub(super) fn noise(
        a: &DMatrix<f64>,
        scale: &DMatrix<f64>,
        quantity: impl Fn(&DMatrix<f64>) -> Option<f64>,
    ) -> f64 {
        let Some(value) = quantity(a) else {
            return f64::INFINITY;
        };
        let mut random = 0x9E37_79B9_7F4A_7C15_u64;
        (0..4).fold(0.0, |most: f64, _| {
            let perturbed = DMatrix::from_fn(a.nrows(), a.ncols(), |row, column| {
                random = random
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                let size = 0.5 + 0.5 * (random >> 40) as f64 / (1_u64 << 24) as f64;
                let signed = if random >> 39 & 1 == 0 { size } else { -size };
                a[(row, column)] + signed * PERTURBATION * scale[(row, column)]
            });
            // A value that is not finite is not significant; `max` would ignore NaN.
            let change = quantity(&perturbed).map_or(f64::INFINITY, |other| (other - value).abs());
            if change.is_nan() {
                f64::INFINITY
            } else {
                most.max(change)
            }
        })
    }
}

/// tr |A||A⁻¹|, which does not depend on units; infinite if there is no inverse.
fn growth(a: &DMatrix<f64>) -> f64 {
    let inverse = a.clone().try_inverse();
    let growth = inverse.map_or(f64::INFINITY, |inverse| (a.abs() * inverse.abs()).trace());
    if growth.is_nan() {
        f64::INFINITY
    } else {
        growth
    }
}

/// Whether tr Aᵏ = tr A⁻ᵏ for k = 1..N and det A = 1 up to rounding error, so that with λ also 1/λ is an eigenvalue.
///
/// The errors are relative to tr |A|ᵏ and tr |A||A⁻¹|, which like the spectrum do not depend on the units of momenta
/// and coordinates.
fn has_reciprocal_spectrum(a: &DMatrix<f64>) -> bool {
    const ROUND_OFF: f64 = 1e-10;
    let size = a.nrows();
    if !size.is_multiple_of(2) {
        return false;
    }
    if size == 2 {
        let scale = (a[(0, 0)] * a[(1, 1)]).abs() + (a[(0, 1)] * a[(1, 0)]).abs();
        return (determinant_of_two(a) - 1.0).abs() <= 0.1 * ROUND_OFF * scale.max(1.0);
    }
    let Some(inverse) = a
        .clone()
        .try_inverse()
        .filter(|inverse| inverse.iter().all(|entry| entry.is_finite()))
    else {
        return false;
    };
    let condition = (a.abs() * inverse.abs()).trace();
    if (a.determinant() - 1.0).abs() > ROUND_OFF * condition {
        return false;
    }
    // If the map grows strongly, its entries have lost digits in the element, and the inverse loses as many again.
    let round_off = ROUND_OFF.max(1024.0 * f64::EPSILON * condition);
    let (size_of_a, size_of_inverse) = (a.abs(), inverse.abs());
    let (mut power, mut inverse_power) = (a.clone(), inverse.clone());
    let (mut bound, mut inverse_bound) = (size_of_a.clone(), size_of_inverse.clone());
    for _ in 0..size / 2 {
        let defect = (power.trace() - inverse_power.trace()).abs();
        if defect > round_off * (bound.trace() + inverse_bound.trace()) {
            return false;
        }
        (power, inverse_power) = (&power * a, &inverse_power * &inverse);
        (bound, inverse_bound) = (&bound * &size_of_a, &inverse_bound * &size_of_inverse);
    }
    true
}

fn has_equal_diagonal(a: &DMatrix<f64>) -> bool {
    const ROUND_OFF: f64 = 1e-12;
    (a[(0, 0)] - a[(1, 1)]).abs() <= ROUND_OFF * a[(0, 0)].abs().max(1.0)
}

fn determinant_of_two(a: &DMatrix<f64>) -> f64 {
    a[(0, 0)] * a[(1, 1)] - a[(0, 1)] * a[(1, 0)]
}

/// (λ₁ − λ₂)²/4 of a 2 × 2 matrix, without cancellation where a₁₁ = a₂₂.
fn discriminant_of_two(a: &DMatrix<f64>) -> f64 {
    let half_difference = 0.5 * (a[(0, 0)] - a[(1, 1)]);
    half_difference * half_difference + a[(0, 1)] * a[(1, 0)]
}

/// det(A + s). Near an eigenvalue −s it is as accurate as the small entries of A + s, unlike the characteristic
/// polynomial.
pub(super) fn shifted_determinant(a: &DMatrix<f64>, shift: f64) -> f64 {
    let mut shifted = a.clone();
    for i in 0..a.nrows() {
        shifted[(i, i)] += shift;
    }
    if a.nrows() == 2 {
        determinant_of_two(&shifted)
    } else {
        shifted.lu().determinant()
    }
}

/// ∏ (μᵢ − μⱼ)² over the N values μ = λ + 1/λ of a reciprocal spectrum; each occurs twice, and the two are averaged.
fn collisions(eigenvalues: &[Complex<f64>]) -> f64 {
    let mut twice: Vec<Trace> = eigenvalues
        .iter()
        .map(|&lambda| Trace::of(lambda))
        .collect();
    let mut once = Vec::with_capacity(twice.len() / 2);
    while let Some(first) = twice.pop() {
        let distance = |other: &Trace| other.minus(first).norm_sqr();
        let nearest =
            (0..twice.len()).min_by(|&i, &j| distance(&twice[i]).total_cmp(&distance(&twice[j])));
        if let Some(nearest) = nearest {
            let twin = twice.swap_remove(nearest);
            once.push(Trace {
                beyond: first.beyond + twin.minus(first) * 0.5,
                ..first
            });
        }
    }
    over_pairs(&once, |first, second| {
        first.minus(second) * first.minus(second)
    })
}

/// μ = λ + 1/λ in the form ±2 + (λ ∓ 1)²/λ: near ±1, as for the eigenvalues of short steps, μ itself would be rounded
/// to ±2.
#[derive(Clone, Copy, Debug)]
struct Trace {
    /// The constant 2 or −2.
    nearest: f64,
    beyond: Complex<f64>,
}

impl Trace {
    fn of(lambda: Complex<f64>) -> Self {
        let one = 1.0_f64.copysign(lambda.re);
        Self {
            nearest: 2.0 * one,
            beyond: (lambda - one) * (lambda - one) / lambda,
        }
    }

    fn minus(self, other: Self) -> Complex<f64> {
        self.beyond - other.beyond + (self.nearest - other.nearest)
    }
}

/// ∏ (λᵢλⱼ − 1) over all pairs: zero where a complex pair crosses the unit circle.
fn reciprocal_pairs(eigenvalues: &[Complex<f64>]) -> f64 {
    over_pairs(eigenvalues, |first, second| first * second - 1.0)
}

/// The product over all pairs of a symmetric function; real because eigenvalues come in conjugate pairs.
fn over_pairs<T: Copy>(values: &[T], factor: impl Fn(T, T) -> Complex<f64>) -> f64 {
    let mut product = Complex::new(1.0, 0.0);
    for (i, &first) in values.iter().enumerate() {
        for &second in &values[i + 1..] {
            product *= factor(first, second);
        }
    }
    product.re
}

/// The scale of the rounding errors in the entries of several neighbouring matrices.
///
/// It is the largest absolute value of each entry, but at least what corresponds to one in balanced units, since a
/// small entry may be the difference of larger terms. Entries that are zero in all matrices are taken as exact, so that
/// uncoupled modes stay uncoupled.
pub(super) fn scale_of<'a>(
    matrices: impl Iterator<Item = &'a DMatrix<f64>>,
    size: usize,
) -> DMatrix<f64> {
    let largest = matrices.fold(DMatrix::zeros(size, size), |most, a| most.sup(&a.abs()));
    let (_, units) = balanced(&largest);
    DMatrix::from_fn(size, size, |row, column| match largest[(row, column)] {
        0.0 => 0.0,
        entry => entry.max(units[row] / units[column]),
    })
}
