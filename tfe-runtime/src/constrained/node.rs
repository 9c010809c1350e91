//! Constraints at one instant: the velocity that belongs to a momentum, and whether the mass matrix determines it.

use crate::constrained::constrains::Constrains;
use crate::constrained::rows::{DEPENDENT, Rows, in_units, norm, scaled, subtract_part, unit};
use crate::constrained::scaled::{factor_scaled, scale_of_constraints};
use crate::error::{ConstraintError, LegendreError, StepError};
use crate::lu;
use crate::model::Form;

/// The largest number of iterations of Newton's method for the velocity of a momentum; one suffices where the energy is
/// quadratic in z.
pub(crate) const MAX: u32 = 50;

/// Whether these iterations end: the step is a rounding error of the solution, or it is small and no longer decreases.
#[inline]
pub(crate) fn is_settled(step: f64, last: f64, scale: f64) -> bool {
    step <= 4.0 * f64::EPSILON * scale || (step >= last && step <= 1e-10 * scale)
}

/// Working memory of [`solve_velocity`]: (N + m)² numbers, N + m numbers, and as many indices.
pub(crate) struct Bordered<'a> {
    pub(crate) matrix: &'a mut [f64],
    pub(crate) vector: &'a mut [f64],
    pub(crate) pivots: &'a mut [usize],
}

/// The velocity that belongs to a momentum under constraints (T-74):
///
/// ```text
/// L_v(q, v, t) + Aᵀν = p ,     A v + a = 0 .
/// ```
///
/// `rows` holds A and a at (t, q); only marked constraints are used. The mass matrix may be singular where the
/// constraints determine the motion.
pub(crate) fn solve_velocity<const N: usize>(
    model: &dyn Constrains<N>,
    t: f64,
    (q, p): (&[f64; N], &[f64; N]),
    guess: &[f64; N],
    rows: &Rows<'_, N>,
    active: &[usize],
    memory: &mut Bordered<'_>,
) -> Result<[f64; N], StepError> {
    let size = N + active.len();
    let matrix = &mut memory.matrix[..size * size];
    let vector = &mut memory.vector[..size];
    let pivots = &mut memory.pivots[..size];
    let (mut v, mut momentum) = (*guess, *p);
    let mut last = f64::INFINITY;
    for _ in 0..MAX {
        matrix.fill(0.0);
        let (by_velocity, zz) = model.momentum_and_mass(t, q, &v, &mut momentum)?;
        border(matrix, &zz, rows, active);
        for a in 0..N {
            vector[a] = p[a] - by_velocity[a];
        }
        for (c, mark) in active.iter().enumerate() {
            vector[N + c] = if *mark == 0 { 0.0 } else { -rows.psi(c, &v) };
        }
        factor_bordered::<N>(size, matrix, pivots)?;
        let is_suspect = (0..size).any(|a| lu::is_lost(size, matrix, a, ROUNDINGS));
        if is_suspect && is_singular_where_allowed(&zz, rows, active) {
            return Err(ConstraintError::SingularMass.into());
        }
        // The multiplier is solved for anew in each iteration: it enters linearly.
        lu::solve(size, matrix, pivots, vector);
        let (mut step, mut scale) = (0.0_f64, 0.0_f64);
        for a in 0..N {
            v[a] += vector[a];
            step = step.max(vector[a].abs());
            scale = scale.max(v[a].abs());
        }
        if !v.iter().all(|v| v.is_finite()) {
            return Err(StepError::NonFinite);
        }
        if is_settled(step, last, scale) || (model.is_quadratic() && last.is_finite()) {
            return Ok(v);
        }
        last = step;
    }
    Err(LegendreError::Stalled {
        iterations: MAX,
        residual: last,
    }
    .into())
}

/// A pivot below this fraction of the terms subtracted from it is a rounding error.
const ROUNDINGS: f64 = 64.0 * f64::EPSILON;

/// Whether the mass matrix is singular, up to rounding, for the velocities that the marked rows allow. Rows that are
/// nearly dependent lead to small pivots as well, but leave the velocity determined.
///
/// With coordinates in units of their inertias, P M P + 1 − P is factored, where P projects on the allowed velocities.
/// False where a coordinate has no inertia of its own, and so no such unit.
#[cold]
#[inline(never)]
fn is_singular_where_allowed<const N: usize>(
    zz: &[[f64; N]; N],
    rows: &Rows<'_, N>,
    active: &[usize],
) -> bool {
    let mut units = [1.0; N];
    for a in 0..N {
        let root = crate::real::Real::sqrt(zz[a][a].abs());
        if !(root > 0.0 && root.is_finite()) {
            return false;
        }
        units[a] = 1.0 / root;
    }
    let (mut basis, mut rank) = ([[0.0; N]; N], 0);
    for (c, mark) in active.iter().enumerate() {
        let mut row = in_units(&rows.rows[c], &units);
        let length = norm(&row);
        if *mark == 0 || !(length > 0.0) || rank == N {
            continue;
        }
        row = scaled(&row, length);
        for direction in &basis[..rank] {
            subtract_part(&mut row, direction);
        }
        if norm(&row) > DEPENDENT {
            basis[rank] = unit(&row);
            rank += 1;
        }
    }
    let mut mass = *zz;
    for a in 0..N {
        for b in 0..N {
            mass[a][b] *= units[a] * units[b];
        }
    }
    // M P, and then (M P)ᵀ P
    for _ in 0..2 {
        for row in &mut mass {
            for direction in &basis[..rank] {
                subtract_part(row, direction);
            }
        }
        let rows = mass;
        for a in 0..N {
            for b in 0..N {
                mass[a][b] = rows[b][a];
            }
        }
    }
    for direction in &basis[..rank] {
        for a in 0..N {
            for b in 0..N {
                mass[a][b] += direction[a] * direction[b];
            }
        }
    }
    // A NaN counts as singular.
    lu::factor(N, mass.as_flattened_mut(), &mut [0; N]).is_err()
        || !(0..N).all(|a| mass[a][a].abs() > ROUNDINGS)
}

/// Writes [ L_vv Aᵀ ; A 0 ] with the marked rows into zeros, and a one on the diagonal for each of the other rows.
pub(super) fn border<const N: usize>(
    matrix: &mut [f64],
    zz: &[[f64; N]; N],
    rows: &Rows<'_, N>,
    active: &[usize],
) {
    let size = N + active.len();
    for (row, masses) in matrix.chunks_exact_mut(size).zip(zz) {
        row[..N].copy_from_slice(masses);
    }
    for (c, mark) in active.iter().enumerate() {
        let row = N + c;
        if *mark == 0 {
            matrix[row * size + row] = 1.0;
            continue;
        }
        for a in 0..N {
            matrix[row * size + a] = rows.rows[c][a];
            matrix[a * size + row] = rows.rows[c][a];
        }
    }
}

/// Factors [ M ±Aᵀ ; A 0 ] of any size from N on.
///
/// # Errors
/// [`ConstraintError::SingularMass`].
pub(super) fn factor_bordered<const N: usize>(
    size: usize,
    matrix: &mut [f64],
    pivots: &mut [usize],
) -> Result<(), ConstraintError> {
    let scale = scale_of_constraints(size, matrix, 0..N, N..size);
    let is_constraint = |row: usize| row >= N;
    factor_scaled(size, matrix, pivots, (scale, &is_constraint))
        .map_err(|_| ConstraintError::SingularMass)
}

/// If a pivot of the mass matrix is below this fraction of its column, and of the terms subtracted from it, the
/// velocity of a momentum is determined with the constraints.
const SINGULAR: f64 = 1e-10;

/// Whether the mass matrix alone determines the velocity of a momentum.
pub(crate) fn is_regular<const N: usize>(mut zz: [[f64; N]; N]) -> bool {
    if let Some(is_regular) = is_definite(zz) {
        return is_regular;
    }
    // Columns have the units of their coordinates, and so do rows: a pivot is small only relative to its column and to
    // the terms subtracted from it.
    let mut scales = [0.0_f64; N];
    for row in &zz {
        for (scale, entry) in scales.iter_mut().zip(row) {
            *scale = scale.max(entry.abs());
        }
    }
    if lu::factor(N, zz.as_flattened_mut(), &mut [0; N]).is_err() {
        return false;
    }
    (0..N).all(|a| {
        zz[a][a].abs() > SINGULAR * scales[a] || !lu::is_lost(N, zz.as_flattened(), a, SINGULAR)
    })
}

/// Whether a mass matrix is regular, if it has no negative eigenvalue; `None` if it may have one.
///
/// Pivots are those of the diagonal that have lost the fewest digits. An exchange of rows alone may take a row that has
/// nothing but rounding errors in this column, which have cancelled with nothing: the mass of a unit quaternion
/// (c, s, ε, ε) would seem to be regular.
fn is_definite<const N: usize>(mut zz: [[f64; N]; N]) -> Option<bool> {
    let own: [f64; N] = core::array::from_fn(|a| zz[a][a]);
    if !own.iter().all(|mass| *mass > 0.0) {
        return None;
    }
    let mut rest = [true; N];
    for _ in 0..N {
        let (mut pivot, mut most) = (0, f64::NEG_INFINITY);
        for a in 0..N {
            let kept = zz[a][a] / own[a];
            if rest[a] && !(kept <= most) {
                (pivot, most) = (a, kept);
            }
        }
        if !(most > SINGULAR) {
            // Of a matrix without negative eigenvalues, all that is left vanishes with the largest pivot.
            let vanishes =
                |a: usize, b: usize| (zz[a][b] / own[a]) * (zz[a][b] / own[b]) <= SINGULAR;
            let left = || (0..N).filter(|a| rest[*a]);
            let all_vanish = left().all(|a| left().all(|b| vanishes(a, b)));
            return all_vanish.then_some(false);
        }
        rest[pivot] = false;
        for row in 0..N {
            let factor = zz[row][pivot] / zz[pivot][pivot];
            for column in 0..N {
                if rest[row] && rest[column] {
                    zz[row][column] -= factor * zz[pivot][column];
                }
            }
        }
    }
    Some(true)
}

/// The velocity that belongs to a momentum without regard to the constraints; `v` is the one with them, which is the
/// same if the state is consistent.
///
/// Where the mass matrix is singular up to rounding, as for quaternions, the momentum alone does not determine a
/// velocity: then the result is `v`.
///
/// # Errors
/// [`LegendreError`] if none is found although the mass matrix is regular.
pub(crate) fn own_velocity<const N: usize>(
    model: &dyn Constrains<N>,
    t: f64,
    q: &[f64; N],
    p: &[f64; N],
    v: &[f64; N],
) -> Result<[f64; N], LegendreError> {
    if matches!(model.form(), Form::Lagrangian) && !is_regular(model.mass_at(t, q, v)) {
        return Ok(*v);
    }
    model.free_velocity(t, q, p, v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_are_regular_in_any_units() {
        for length in [1.0, 1e-6, 1e-11, 1e-14, 1e-20, 1e11] {
            // A body of one with a pendulum of a half.
            let (turned, square) = (0.5 * length, 0.5 * length * length);
            assert!(is_regular([[1.5, turned], [turned, square]]), "{length}");
            assert!(is_regular([[square, turned], [turned, 1.5]]), "{length}");
            // The same without the body: bob and angle move alike.
            let alone = [[0.5, turned], [turned, square]];
            assert!(!is_regular(alone), "{length}");
        }
        // Of rank one, with entries that are not exact.
        let direction: [f64; 3] = [0.3, 0.7, -1.1];
        assert!(!is_regular(
            direction.map(|a| direction.map(|b| a * b / 3.0))
        ));
        // Eigenvalues of both signs: regular, although a pivot vanishes without exchanges.
        assert!(is_regular([
            [1.0, 1.0, 0.0],
            [1.0, 1.0, 1.0],
            [0.0, 1.0, 1.0]
        ]));
        assert!(is_regular([[0.0, 1.0], [1.0, 0.0]]));
    }

    /// The kinetic energy of a unit quaternion does not see the velocity along it, whatever its direction.
    #[test]
    fn masses_of_quaternions_are_singular() {
        const PAIRS: [(f64, f64); 6] = [
            (0.0, 0.0),
            (-5e-33, -4e-33),
            (1e-17, 3e-18),
            (1e-9, 0.3),
            (0.23, 1.5e-4),
            (0.23, 1e-7),
        ];
        for angle in 0..2000 {
            let (sine, cosine) = crate::real::Real::sin_cos(0.001 * f64::from(angle));
            for (y, z) in PAIRS {
                let [e, x] = [cosine, sine];
                // The angular velocity of the body is 2 Σ B_ka dot(e_a).
                let rates = [[-x, e, z, -y], [-y, -z, e, x], [-z, y, -x, e]];
                let mut zz = [[0.0; 5]; 5];
                zz[0][0] = 1.0;
                for a in 0..4 {
                    for b in 0..4 {
                        let products = rates.iter().zip([1.0, 1.0, 0.5]);
                        zz[1 + a][1 + b] = products.map(|(row, j)| 4.0 * j * row[a] * row[b]).sum();
                    }
                }
                assert!(!is_regular(zz), "{angle} {y} {z}");
            }
        }
    }
}
