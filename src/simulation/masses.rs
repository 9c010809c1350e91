//! Checks at the start of a run whether the mass matrix is indefinite.

use crate::length::RunTimeLength;
use crate::motion::{Node, Warning};
use crate::numbers::largest;
use nalgebra::DMatrix;
use tfe_runtime::family::{self, Block, Entries};
use tfe_runtime::{First, Form, Model};

/// The range of eigenvalues of an indefinite mass matrix, for a Lagrangian of fixed size.
pub(super) fn mass_signs<M: Model<N>, const N: usize>(
    model: &M,
    start: &Node<N>,
) -> Option<Warning> {
    let has_mass = const { matches!(M::FORM, Form::Lagrangian) && M::CONSTRAINTS.is_empty() };
    if !has_mass {
        return None;
    }
    let (mut first, mut mass) = (First::ZERO, [[0.0; N]; N]);
    model.first_and_mass(start.t, &start.q, &start.v, &mut first, &mut mass);
    told(start.t, signs(mass.as_flattened()))
}

/// The same for a Lagrangian of run-time length.
pub(super) fn mass_signs_by_entries<M: family::Model>(
    model: &M,
    start: &Node<0, RunTimeLength>,
) -> Option<Warning> {
    let has_mass = const { matches!(M::FORM, Form::Lagrangian) && !M::CONSTRAINED };
    if !has_mass {
        return None;
    }
    let mut masses = Masses::none(start.q.len());
    model.mass(start.t, &start.q, &start.v, &mut masses);
    told(start.t, masses.signs())
}

fn told(time: f64, signs: Option<(f64, f64)>) -> Option<Warning> {
    let (least, largest) = signs?;
    Some(Warning::MassIndefinite {
        time,
        least,
        largest,
    })
}

/// A symmetric matrix as its diagonal and a list of contributions to the entries above it, in any order.
struct Masses {
    diagonal: Vec<f64>,
    above: Vec<(usize, usize, f64)>,
}

impl Entries<f64> for Masses {
    fn add(&mut self, _: Block, row: usize, column: usize, value: f64) {
        if row == column {
            self.diagonal[row] += value;
        } else if row < column && value != 0.0 {
            self.above.push((row, column, value));
        }
    }
}

impl Masses {
    fn none(size: usize) -> Self {
        Self {
            diagonal: vec![0.0; size],
            above: Vec::new(),
        }
    }

    /// As [`signs`]. For a large matrix that is not diagonal, only the diagonal and the 2×2 minors of coupled
    /// coordinates are examined; their eigenvalues lie between those of the matrix.
    fn signs(mut self) -> Option<(f64, f64)> {
        /// The largest matrix whose eigenvalues are computed where it is not positive definite, which takes about a
        /// millisecond.
        const MAX_DENSE: usize = 64;

        let size = self.diagonal.len();
        if !self.diagonal.iter().all(|mass| mass.is_finite()) {
            return None;
        }
        if !self.above.is_empty() && size <= MAX_DENSE {
            let mut matrix = vec![0.0; size * size];
            for (a, mass) in self.diagonal.iter().enumerate() {
                matrix[a * size + a] = *mass;
            }
            for (row, column, value) in &self.above {
                matrix[row * size + column] += value;
                matrix[column * size + row] += value;
            }
            return signs(&matrix);
        }
        if let Some(ends) = signs_of_diagonal(&self.diagonal) {
            return Some(ends);
        }
        self.above.sort_by_key(|(row, column, _)| (*row, *column));
        let mut pairs = self.above.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
        pairs.find_map(|pair| {
            let (row, column, _) = *pair.first()?;
            let beside: f64 = pair.iter().map(|(.., value)| value).sum();
            let [one, other] = [row, column].map(|a| self.diagonal[a]);
            let may_be = beside.abs() > one.abs().sqrt() * other.abs().sqrt();
            may_be.then(|| signs(&[one, beside, beside, other]))?
        })
    }
}

/// Eigenvalues below this fraction of the largest are taken for rounding errors of the entries.
const MIN_PART: f64 = 1e-14;

/// Whether two numbers have different signs, and the smaller one is not negligible relative to the larger one.
fn are_of_both((least, largest): (f64, f64), part: f64) -> bool {
    let size = least.abs().max(largest.abs());
    least < -part * size && largest > part * size
}

/// The least and the largest number, if they have different signs.
fn signs_of_diagonal(masses: &[f64]) -> Option<(f64, f64)> {
    let masses = || masses.iter().copied();
    let least = masses().fold(f64::INFINITY, f64::min);
    let largest = masses().fold(f64::NEG_INFINITY, f64::max);
    let ends = (least, largest);
    are_of_both(ends, MIN_PART).then_some(ends)
}

/// The least and the largest eigenvalue of a symmetric matrix, if they have different signs beyond rounding error.
fn signs(matrix: &[f64]) -> Option<(f64, f64)> {
    /// The rounding error of eigenvalues relative to the largest, after scaling to a unit diagonal.
    const ROUNDING: f64 = 1e-9;

    if !matrix.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let size = matrix.len().isqrt();
    let mut entries = matrix.iter().enumerate();
    if entries.all(|(at, entry)| at / size == at % size || *entry == 0.0) {
        let diagonal: Vec<f64> = matrix.iter().step_by(size + 1).copied().collect();
        return signs_of_diagonal(&diagonal);
    }
    let matrix = DMatrix::from_row_slice(size, size, matrix);
    // By Sylvester's law the signs do not depend on the units of coordinates, but rounding errors do: scaled, a light
    // body beside a heavy one has its own.
    let unit = |a: usize| {
        let row = matrix.column(a);
        let sizes = [row[a].abs(), largest(row.as_slice())];
        let size = sizes.into_iter().find(|size| *size > 0.0);
        size.unwrap_or(1.0).sqrt()
    };
    let units: Vec<f64> = (0..size).map(unit).collect();
    let scaled = DMatrix::from_fn(size, size, |a, b| matrix[(a, b)] / units[a] / units[b]);
    if !scaled.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    // Nearly all mass matrices are positive definite. Then no eigenvalue is below zero by more than a rounding error,
    // and factors are found in a small part of the time of eigenvalues.
    if scaled.clone().cholesky().is_some() {
        return None;
    }
    let values = scaled.symmetric_eigenvalues();
    if !are_of_both((values.min(), values.max()), ROUNDING) {
        return None;
    }
    let values = matrix.symmetric_eigenvalues();
    let ends = (values.min(), values.max());
    if are_of_both(ends, ROUNDING) {
        return Some(ends);
    }
    // The smaller eigenvalue is lost in the rounding error of the larger one. The Rayleigh quotient x·Mx/x·x of the
    // scaled eigenvector x shows its sign instead.
    let eigen = scaled.symmetric_eigen();
    let quotient = |place: usize| {
        let parts = eigen.eigenvectors.column(place);
        let parts = parts.iter().zip(&units).map(|(x, unit)| x / unit);
        eigen.eigenvalues[place] / parts.map(|x| x * x).sum::<f64>()
    };
    let (least, largest) = ends;
    let ends = match least.abs() < largest.abs() {
        true => (quotient(eigen.eigenvalues.imin()), largest),
        false => (least, quotient(eigen.eigenvalues.imax())),
    };
    are_of_both(ends, MIN_PART).then_some(ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(found: Option<(f64, f64)>, expected: Option<(f64, f64)>) {
        match (found, expected) {
            (None, None) => {}
            (Some(found), Some(expected)) => {
                for (found, expected) in [(found.0, expected.0), (found.1, expected.1)] {
                    // A few ulps of each.
                    let off = (found - expected).abs();
                    assert!(off <= 1e-13 * expected.abs(), "{found} {expected}");
                }
            }
            _ => panic!("{found:?} {expected:?}"),
        }
    }

    #[test]
    fn a_light_body_beside_a_heavy_one_has_a_sign() {
        check(signs(&[1e12, 0.0, 0.0, -1.0]), Some((-1.0, 1e12)));
        check(signs(&[1.0, 0.0, 0.0, -1e-12]), Some((-1e-12, 1.0)));
        check(signs(&[-1e12, 0.0, 0.0, 1.0]), Some((-1e12, 1.0)));
        // Rounding errors of cancelled entries have either sign.
        check(signs(&[1.0, 0.0, 0.0, -1e-17]), None);
        check(signs(&[1.0, 1.0, 1.0, 1.0 - 1e-12]), None);
        check(signs(&[1e12, 0.5e6, 0.5e6, 1.0]), None);
        check(signs(&[1.0, 0.0, 0.0, f64::NAN]), None);
        check(signs(&[0.0; 4]), None);
        let found = signs(&[1e12, 1e3, 1e3, -1.0]);
        let (least, largest) = found.expect("a light body of the wrong sign");
        // The eigenvalue is −1 − 1e6/1e12; the Rayleigh quotient is as close.
        assert!((least + 1.0).abs() < 1e-5 && (largest - 1e12).abs() < 1.0);
        // The coupling of two coordinates exceeds the geometric mean of their masses, so that the quotient takes both
        // signs.
        let found = signs(&[1e12, 2e6, 2e6, 1.0]);
        let (least, largest) = found.expect("a determinant of −3e12");
        assert!((-3.0 - 1e-9..-0.1).contains(&least) && largest > 1e11);
    }

    /// Ones on the diagonal and c beside it: the eigenvalues are 1 + (n − 1) c and 1 − c.
    #[test]
    fn matrices_next_to_singular_ones_have_their_signs() {
        for size in [3, 16, 64] {
            let last = (size - 1) as f64;
            let of = |least: f64| {
                let beside = (least - 1.0) / last;
                let entry = |at: usize| if at / size == at % size { 1.0 } else { beside };
                let matrix: Vec<f64> = (0..size * size).map(entry).collect();
                (signs(&matrix), 1.0 - beside)
            };
            for least in [1e-3, 1e-8, 1e-12, -1e-12] {
                assert_eq!(of(least).0, None, "{size} {least}");
            }
            for least in [-1e-8, -1e-3, -2.0] {
                let (found, largest) = of(least);
                let found = found.expect("both signs");
                assert!((found.0 - least).abs() <= 1e-12, "{size}: {found:?}");
                assert!(
                    (found.1 - largest).abs() <= 1e-12 * largest,
                    "{size}: {found:?}"
                );
            }
        }
    }

    #[test]
    fn masses_entry_by_entry() {
        let of = |masses: &[f64], above: &[(usize, usize, f64)]| {
            let mut found = Masses::none(masses.len());
            for (a, mass) in masses.iter().enumerate() {
                // In several contributions, as kernels write them.
                found.add(Block::ZZ, a, a, 0.25 * mass);
                found.add(Block::ZZ, a, a, 0.75 * mass);
            }
            for (row, column, value) in above {
                found.add(Block::ZZ, *row, *column, *value);
                found.add(Block::ZZ, *column, *row, *value);
            }
            found.signs()
        };
        for size in [2, 3, 100] {
            let ones = vec![1.0; size];
            let mut mixed = ones.clone();
            mixed[size - 1] = -2.0;
            check(of(&ones, &[]), None);
            check(of(&mixed, &[]), Some((-2.0, 1.0)));
            check(of(&vec![-1.0; size], &[]), None);
            // The eigenvalues are 1 ∓ 1.5 and ones.
            let coupled = [(0, 1, 0.5), (0, 1, 1.0)];
            check(of(&ones, &coupled), Some((-0.5, 2.5)));
            check(of(&ones, &[(0, 1, 0.5), (0, 1, 0.25)]), None);
            check(of(&ones, &[(0, 1, 1.5), (0, 1, -1.5)]), None);
            mixed[0] = f64::NAN;
            check(of(&mixed, &[]), None);
        }
    }
}
