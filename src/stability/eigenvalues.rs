//! Eigenvalues of a real matrix by the QR algorithm, with a limit on its sweeps.

use crate::numbers::larger;
use crate::periodic_schur::{balancing, power_of_two, reflection, times_power_of_two};
use nalgebra::linalg::Hessenberg;
use nalgebra::{Complex, DMatrix};
use std::error::Error;
use std::fmt;

/// Why the eigenvalues of a matrix were not found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum EigenvalueError {
    /// The matrix is not square.
    NotSquare {
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
    },
    /// An entry is infinite or not a number.
    NotFinite {
        /// The row of the entry, from 0.
        row: usize,
        /// The column of the entry.
        column: usize,
    },
    /// The QR iteration did not converge for all eigenvalues.
    NoConvergence,
}

impl fmt::Display for EigenvalueError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotSquare { rows, columns } => {
                write!(
                    f,
                    "a matrix of {rows} × {columns} has no eigenvalues: it must be square"
                )
            }
            Self::NotFinite { row, column } => {
                write!(
                    f,
                    "the entry in row {row}, column {column} of the matrix is not finite"
                )
            }
            Self::NoConvergence => f.write_str("the eigenvalues of the matrix did not converge"),
        }
    }
}

impl Error for EigenvalueError {}

/// Products of three entries between this and its inverse neither overflow nor underflow.
const MODERATE: f64 = 1e100;

/// The eigenvalues of a square matrix: every λ with det(A − λ) = 0, repeated according to its multiplicity.
///
/// For a 2 × 2 matrix they have a closed form,
///
/// ```text
/// λ = (a₁₁ + a₂₂)/2 ± √(((a₁₁ − a₂₂)/2)² + a₁₂a₂₁) ,
/// ```
///
/// so that the eigenvalues of an oscillating symplectic map have modulus one up to rounding. Larger matrices are
/// balanced and reduced by double-shift QR sweeps: the result is exact for a matrix that differs from the balanced one
/// by some ε of its norm. The number of sweeps is limited.
///
/// # Not guaranteed
/// The order, except that complex pairs are adjacent and exact conjugates, positive imaginary part first. An
/// eigenvalue of multiplicity r in one Jordan block is accurate to the r-th root of the rounding unit only, and may
/// come out as a complex pair.
/// # Errors
/// [`EigenvalueError::NotSquare`], [`NotFinite`](EigenvalueError::NotFinite), and
/// [`NoConvergence`](EigenvalueError::NoConvergence) if the sweeps do not converge.
/// # Reference
/// G. H. Golub, C. F. Van Loan, *Matrix Computations*, §7.5.
///
/// ```
/// use nalgebra::DMatrix;
/// use tfe::stability;
///
/// // A cyclic permutation, on which QR without exceptional shifts stalls: the cube roots of one.
/// let cycle = DMatrix::from_row_slice(3, 3, &[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
/// let roots = stability::eigenvalues(&cycle)?;
/// assert_eq!(roots.len(), 3);
/// assert!(roots.iter().all(|root| (root.powi(3) - 1.0).norm() < 1e-14));
/// # Ok::<(), stability::EigenvalueError>(())
/// ```
pub fn eigenvalues(matrix: &DMatrix<f64>) -> Result<Vec<Complex<f64>>, EigenvalueError> {
    let (rows, columns) = matrix.shape();
    if rows != columns {
        return Err(EigenvalueError::NotSquare { rows, columns });
    }
    if let Some(index) = matrix.iter().position(|entry| !entry.is_finite()) {
        return Err(EigenvalueError::NotFinite {
            row: index % rows,
            column: index / rows,
        });
    }
    let largest = matrix.amax();
    let found = if largest == 0.0 || (1.0 / MODERATE..=MODERATE).contains(&largest) {
        eigenvalues_of_finite(matrix)
    } else {
        // Balanced first, since a small entry may be the counterpart of a large one.
        let balanced = balanced(matrix).0;
        let unit = balanced.amax().log2().floor().exp2();
        eigenvalues_of_finite(&(balanced / unit))
            .map(|values| values.into_iter().map(|value| value * unit).collect())
    };
    found.ok_or(EigenvalueError::NoConvergence)
}

/// The eigenvalues of a finite square matrix, if the iteration converges. For 2 × 2 they are in closed form, so that a
/// symplectic map has spectral radius 1 up to rounding error.
///
/// Otherwise by QR on the balanced matrix. The implementation of nalgebra is not used: its shifts suffer from
/// cancellation for matrices close to the identity, as those of short steps, and the iteration then stalls.
pub(super) fn eigenvalues_of_finite(a: &DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    const MAX_SWEEPS: u32 = 200;
    /// The number of sweeps without a converged eigenvalue after which an exceptional shift is used.
    const EXCEPTIONAL: u32 = 10;
    let size = a.nrows();
    match size {
        0 => return Some(Vec::new()),
        1 => return Some(vec![Complex::new(a[(0, 0)], 0.0)]),
        2 => {
            return Some(
                eigenvalues_of_two([[a[(0, 0)], a[(0, 1)]], [a[(1, 0)], a[(1, 1)]]]).to_vec(),
            );
        }
        _ => {}
    }
    let mut h = Hessenberg::new(balanced(a).0).unpack_h();
    let norm: f64 = h.iter().map(|entry| entry.abs()).sum();
    let mut values = Vec::with_capacity(size);
    let mut active = size;
    let mut sweeps = 0;
    while active > 0 {
        let first = (1..active)
            .rev()
            .find(|&row| is_negligible(&h, row, norm))
            .unwrap_or(0);
        match active - first {
            1 => values.push(Complex::new(h[(first, first)], 0.0)),
            2 => {
                let last = first + 1;
                values.extend(eigenvalues_of_two([
                    [h[(first, first)], h[(first, last)]],
                    [h[(last, first)], h[(last, last)]],
                ]));
            }
            _ if sweeps < MAX_SWEEPS => {
                sweeps += 1;
                double_shift_sweep(
                    &mut h,
                    first,
                    active - 1,
                    sweeps.is_multiple_of(EXCEPTIONAL),
                );
                continue;
            }
            _ => return None,
        }
        active = first;
        sweeps = 0;
    }
    values
        .iter()
        .all(|value| value.re.is_finite() && value.im.is_finite())
        .then_some(values)
}

/// Whether the subdiagonal entry of this row is negligible.
fn is_negligible(h: &DMatrix<f64>, row: usize, norm: f64) -> bool {
    let around = h[(row - 1, row - 1)].abs() + h[(row, row)].abs();
    let size = if around == 0.0 { norm } else { around };
    h[(row, row - 1)].abs() <= f64::EPSILON * size
}

/// One implicit double-shift QR sweep on the rows first..=last, at least three, of a Hessenberg matrix [GVL, §7.5].
///
/// Only the diagonal block is transformed, since the blocks beside it do not influence the eigenvalues. An exceptional
/// sweep uses arbitrary shifts, for matrices such as permutations, which the usual shifts leave unchanged.
fn double_shift_sweep(h: &mut DMatrix<f64>, first: usize, last: usize, is_exceptional: bool) {
    let (x, y, w) = if is_exceptional {
        let size = h[(last, last - 1)].abs() + h[(last - 1, last - 2)].abs();
        (
            h[(last, last)] + 0.75 * size,
            h[(last, last)] + 0.75 * size,
            -0.4375 * size * size,
        )
    } else {
        (
            h[(last, last)],
            h[(last - 1, last - 1)],
            h[(last, last - 1)] * h[(last - 1, last)],
        )
    };
    // The first column of (H − s₁)(H − s₂) divided by h₂₁, where s are the eigenvalues of the last 2 × 2 block [[y, ·],
    // [·, x]]. Written with differences of diagonal entries: with trace and determinant it would suffer from
    // cancellation near the identity, and the sweeps would stall.
    let z = h[(first, first)];
    let (r, s) = (x - z, y - z);
    let mut v = [
        (r * s - w) / h[(first + 1, first)] + h[(first, first + 1)],
        h[(first + 1, first + 1)] - z - r - s,
        h[(first + 2, first + 1)],
    ];
    for k in first..last {
        let rows = (last - k + 1).min(3);
        if k > first {
            v = std::array::from_fn(|i| if i < rows { h[(k + i, k - 1)] } else { 0.0 });
        }
        let (factor, _) = reflection(&mut v[..rows]);
        if factor == 0.0 {
            continue;
        }
        for j in k.saturating_sub(1).max(first)..=last {
            let sum: f64 = (0..rows).map(|i| v[i] * h[(k + i, j)]).sum();
            for i in 0..rows {
                h[(k + i, j)] -= factor * sum * v[i];
            }
        }
        for i in first..=(k + 3).min(last) {
            let sum: f64 = (0..rows).map(|j| v[j] * h[(i, k + j)]).sum();
            for j in 0..rows {
                h[(i, k + j)] -= factor * sum * v[j];
            }
        }
        if k > first {
            for i in 1..rows {
                h[(k + i, k - 1)] = 0.0;
            }
        }
    }
}

/// The eigenvalues of a 2 × 2 matrix with entries of any size; the off-diagonal ones enter only by their product.
pub(super) fn eigenvalues_of_two([[a, b], [c, d]]: [[f64; 2]; 2]) -> [Complex<f64>; 2] {
    let is_moderate = |x: f64| x == 0.0 || (1.0 / MODERATE..=MODERATE).contains(&x.abs());
    if [a, b, c, d].into_iter().all(is_moderate) {
        return of_moderate_two([[a, b], [c, d]]);
    }
    let coupling = b.abs().sqrt() * c.abs().sqrt();
    let unit = a.abs().max(d.abs()).max(coupling);
    if unit == 0.0 {
        return [Complex::new(0.0, 0.0); 2];
    }
    let part = coupling / unit;
    let scaled = [[a / unit, part.copysign(b)], [part.copysign(c), d / unit]];
    of_moderate_two(scaled).map(|value| value * unit)
}

fn of_moderate_two([[a, b], [c, d]]: [[f64; 2]; 2]) -> [Complex<f64>; 2] {
    let (mean, half_difference) = (f64::midpoint(a, d), 0.5 * (a - d));
    let discriminant = half_difference * half_difference + b * c;
    if discriminant < 0.0 {
        let imaginary = (-discriminant).sqrt();
        return [
            Complex::new(mean, imaginary),
            Complex::new(mean, -imaginary),
        ];
    }
    let root = discriminant.sqrt();
    // The sum with equal signs keeps all digits; the other eigenvalue follows from the determinant.
    let large = mean + root.copysign(mean);
    let small = if large == 0.0 {
        0.0
    } else {
        (a * d - b * c) / large
    };
    [large.max(small), large.min(small)].map(|value| Complex::new(value, 0.0))
}

/// A similar matrix D⁻¹AD with rows and columns of comparable size, and the diagonal of D, which consists of powers of
/// two.
///
/// Momenta and coordinates have different units, and QR is only accurate relative to the largest entry. A free
/// coordinate has only a column of zeros, and a conserved momentum only a row of zeros, beside the diagonal: entries in
/// such a row or column are made no larger than the others in all units; see [`balancing`].
pub(super) fn balanced(a: &DMatrix<f64>) -> (DMatrix<f64>, Vec<f64>) {
    let n = a.nrows();
    let mut exponents = vec![0; n];
    balancing(a.abs().as_mut_slice(), 0.0, &mut exponents);
    let scaled = |i, j| times_power_of_two(a[(i, j)], exponents[j] - exponents[i]);
    let balanced = DMatrix::from_fn(n, n, scaled);
    (balanced, exponents.into_iter().map(power_of_two).collect())
}

/// The scale of the rounding errors of QR in each entry, zeros included: the largest entry in balanced units.
pub(super) fn backward_error(a: &DMatrix<f64>) -> DMatrix<f64> {
    let (balanced, units) = balanced(a);
    let largest = balanced.amax();
    DMatrix::from_fn(a.nrows(), a.ncols(), |row, column| {
        largest * units[row] / units[column]
    })
}

/// max |λ|; NaN if one eigenvalue is NaN.
pub(super) fn largest_modulus(eigenvalues: &[Complex<f64>]) -> f64 {
    eigenvalues
        .iter()
        .map(|value| value.norm())
        .fold(0.0, larger)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(matrix: &DMatrix<f64>, expected: &[(f64, f64)], tolerance: f64) {
        let mut found = eigenvalues(matrix).expect("converges");
        assert_eq!(found.len(), expected.len());
        for &(re, im) in expected {
            let value = Complex::new(re, im);
            let nearest = (0..found.len())
                .min_by(|&i, &j| {
                    (found[i] - value)
                        .norm()
                        .total_cmp(&(found[j] - value).norm())
                })
                .expect("as many as expected");
            let error = (found.swap_remove(nearest) - value).norm();
            assert!(error <= tolerance, "{value}: error {error:.1e}");
        }
    }

    #[test]
    fn plain_shifts_stall_on_a_cyclic_permutation() {
        let cycle = DMatrix::from_fn(
            5,
            5,
            |row, column| if row == (column + 1) % 5 { 1.0 } else { 0.0 },
        );
        let root = |k: f64| (k * std::f64::consts::TAU / 5.0).sin_cos();
        let expected = [0.0, 1.0, 2.0, 3.0, 4.0].map(|k| (root(k).1, root(k).0));
        check(&cycle, &expected, 20.0 * f64::EPSILON);
    }

    #[test]
    fn plain_shifts_cancel_near_the_identity() {
        // Two rotations by 1e-9 and 2e-9, in planes that are mixed by an orthogonal matrix.
        let rotations = DMatrix::from_row_slice(
            4,
            4,
            &[
                0.0, -1e-9, 0.0, 0.0, 1e-9, 0.0, 0.0, 0.0, //
                0.0, 0.0, 0.0, -2e-9, 0.0, 0.0, 2e-9, 0.0,
            ],
        );
        let mixing = DMatrix::from_fn(4, 4, |row, column| match (row / 2, column / 2) {
            _ if row % 2 != column % 2 => 0.0,
            (0, 1) => -0.8,
            (1, 0) => 0.8,
            _ => 0.6,
        });
        let near = DMatrix::identity(4, 4) + &mixing * rotations * mixing.transpose();
        let expected = [(1.0, 1e-9), (1.0, -1e-9), (1.0, 2e-9), (1.0, -2e-9)];
        check(&near, &expected, 10.0 * f64::EPSILON);
    }

    #[test]
    fn trivial_matrices() {
        check(&DMatrix::zeros(0, 0), &[], 0.0);
        check(&DMatrix::from_element(1, 1, -3.0), &[(-3.0, 0.0)], 0.0);
        check(&DMatrix::zeros(3, 3), &[(0.0, 0.0); 3], 0.0);
        let upper = DMatrix::from_row_slice(3, 3, &[1.0, 5.0, 6.0, 0.0, 2.0, 7.0, 0.0, 0.0, 3.0]);
        check(&upper, &[(1.0, 0.0), (2.0, 0.0), (3.0, 0.0)], 0.0);
    }

    #[test]
    fn entries_near_the_ends_of_the_range() {
        for unit in [1e-300, 1e-200, 1e200, 1e300] {
            // Eigenvalues 3 and ±i.
            let companion =
                DMatrix::from_row_slice(3, 3, &[3.0, -1.0, 3.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0])
                    * unit;
            let expected = [(3.0 * unit, 0.0), (0.0, unit), (0.0, -unit)];
            check(&companion, &expected, 50.0 * f64::EPSILON * unit);
            // One large and one small entry: their product is 4.
            let skew = DMatrix::from_row_slice(2, 2, &[0.0, 4.0 * unit, 1.0 / unit, 0.0]);
            check(&skew, &[(2.0, 0.0), (-2.0, 0.0)], 4.0 * f64::EPSILON);
        }
    }

    #[test]
    fn free_coordinates_of_any_mass() {
        // p₁ and q₁ turn by 0.3; p₂ is conserved, nothing depends on q₂.
        let (sin, cos) = 0.3_f64.sin_cos();
        for mass in [1e-150, 1e-20, 1e-10, 1.0, 1e20, 1e150] {
            let step = DMatrix::from_row_slice(
                4,
                4,
                &[
                    cos,
                    0.1,
                    -mass * sin,
                    0.0, //
                    0.0,
                    1.0,
                    0.0,
                    0.0, //
                    sin / mass,
                    0.4 / mass,
                    cos,
                    0.0, //
                    0.3 / mass,
                    1.0 / mass,
                    0.2,
                    1.0,
                ],
            );
            // The double eigenvalue 1 belongs to a Jordan block and is known to √ε.
            let expected = [(cos, sin), (cos, -sin), (1.0, 0.0), (1.0, 0.0)];
            check(&step, &expected, 1e-6);
        }
    }

    #[test]
    fn bad_matrices_are_errors() {
        assert_eq!(
            eigenvalues(&DMatrix::zeros(2, 3)),
            Err(EigenvalueError::NotSquare {
                rows: 2,
                columns: 3
            })
        );
        let mut broken = DMatrix::zeros(3, 3);
        broken[(1, 2)] = f64::NAN;
        assert_eq!(
            eigenvalues(&broken),
            Err(EigenvalueError::NotFinite { row: 1, column: 2 })
        );
    }

    #[test]
    fn the_small_one_of_two_has_all_digits() {
        let of = |a: [[f64; 2]; 2]| eigenvalues_of_two(a).map(|one| one.re);
        assert_eq!(of([[1.0, 0.0], [0.0, 1e-17]]), [1.0, 1e-17]);
        assert_eq!(of([[-1e8, 3.0], [0.0, 1e-8]]), [1e-8, -1e8]);
        assert_eq!(of([[0.0, 0.0], [0.0, 0.0]]), [0.0, 0.0]);
        assert_eq!(of([[2e200, 3e200], [0.0, -1e200]]), [2e200, -1e200]);
        assert_eq!(of([[1e-200, 1.0], [0.0, 2e-200]]), [2e-200, 1e-200]);
        assert_eq!(of([[0.0, 1e-300], [0.0, 0.0]]), [0.0, 0.0]);
        let [large, small] = of([[1e9, 1.0], [1.0, 1.0]]);
        assert!((large * small - (1e9 - 1.0)).abs() < 1e-6 && small < 1.0);
    }
}
