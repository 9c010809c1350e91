//! Constraints at one state: the velocity that belongs to its momentum, independent constraints, residuals.

use super::choose::choose;
use super::constrains::Constrains;
use super::node::{Bordered, own_velocity, solve_velocity};
use crate::constrained::residual::relative_residual;
use crate::constrained::rows::{Rows, rows_len};
use crate::error::StepError;
use crate::model::Model;
use alloc::vec;
use alloc::vec::Vec;

/// The violation of one constraint by a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Residual {
    /// The name of the constraint.
    pub constraint: &'static str,
    /// φ; zero for a velocity constraint.
    pub position: f64,
    /// A v + a
    pub velocity: f64,
    /// The distance |φ| / |A| relative to the positions; of a start relative to what the constraint is made of, where
    /// that is more.
    pub relative_position: f64,
    /// |A v + a| / |A| relative to the velocities; of a start likewise.
    pub relative_velocity: f64,
}

impl Residual {
    /// The larger of the two relative violations; NaN if one of them is NaN.
    #[must_use]
    pub fn relative(&self) -> f64 {
        let (position, velocity) = (self.relative_position, self.relative_velocity);
        if position.is_nan() || velocity.is_nan() {
            f64::NAN
        } else {
            position.max(velocity)
        }
    }
}

/// The violation of the constraints of a model by positions and velocities, one entry for each.
///
/// The length `h` of a time, such as a step, sets the scale for velocities.
#[must_use]
pub fn residuals<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    v: &[f64; N],
    h: f64,
) -> Vec<Residual>
where
    M: Model<N>,
{
    residuals_of(model, t, (q, v), h)
}

pub(super) fn residuals_of<const N: usize>(
    model: &dyn Constrains<N>,
    t: f64,
    (q, v): (&[f64; N], &[f64; N]),
    h: f64,
) -> Vec<Residual> {
    let declared = model.declared();
    let mut memory = vec![0.0; rows_len(N, declared.len())];
    let mut rows = Rows::of(&mut memory, declared.len());
    rows.evaluate(model, t, q);
    let of = |(c, constraint): (usize, &crate::model::Constraint)| {
        let (relative_position, relative_velocity) = relative_residual(&rows, c, q, v, h);
        Residual {
            constraint: constraint.name,
            position: rows.values[c],
            velocity: rows.psi(c, v),
            relative_position,
            relative_velocity,
        }
    };
    declared.iter().enumerate().map(of).collect()
}

/// Which constraints are independent at a position; the others follow from them there.
#[must_use]
pub fn independent<M, const N: usize>(model: &M, t: f64, q: &[f64; N]) -> Vec<bool>
where
    M: Model<N>,
{
    let mut memory = vec![0.0; rows_len(N, M::CONSTRAINTS.len())];
    let (_, active) = chosen(model, (t, q), &mut memory);
    active.into_iter().map(|mark| mark != 0).collect()
}

/// The units of the coordinates in which the independence of constraints shows at a position: ones or, for lengths that
/// are tiny beside angles, those that the kinetic energy gives to each coordinate.
#[must_use]
pub fn units<M, const N: usize>(model: &M, t: f64, q: &[f64; N]) -> [f64; N]
where
    M: Model<N>,
{
    let count = M::CONSTRAINTS.len();
    let mut memory = vec![0.0; rows_len(N, count)];
    let mut rows = evaluated(model, (t, q), &mut memory);
    choose(&mut rows, model, (t, q), &mut vec![0; count])
}

/// The rows at a position, and marks of the independent ones, in memory of [`rows_len`] numbers.
pub(super) fn chosen<'a, const N: usize>(
    model: &dyn Constrains<N>,
    (t, q): (f64, &[f64; N]),
    memory: &'a mut [f64],
) -> (Rows<'a, N>, Vec<usize>) {
    let mut rows = evaluated(model, (t, q), memory);
    let mut active = vec![0; model.declared().len()];
    choose(&mut rows, model, (t, q), &mut active);
    (rows, active)
}

fn evaluated<'a, const N: usize>(
    model: &dyn Constrains<N>,
    (t, q): (f64, &[f64; N]),
    memory: &'a mut [f64],
) -> Rows<'a, N> {
    let mut rows = Rows::of(memory, model.declared().len());
    rows.evaluate(model, t, q);
    rows
}

/// The velocity that belongs to a momentum: L_v(q, v, t) + Aᵀν = p, A v + a = 0 (T-74). Without constraints, the
/// Legendre transform.
///
/// # Errors
/// [`StepError`] if there is none: the kinetic energy is singular for motions that the constraints allow.
pub fn velocity<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    p: &[f64; N],
    guess: &[f64; N],
) -> Result<[f64; N], StepError>
where
    M: Model<N>,
{
    if const { M::CONSTRAINTS.is_empty() } {
        return Ok(crate::legendre::velocity(model, t, q, p, guess)?);
    }
    held_velocity(model, t, (q, p), guess)
}

/// The same for a model that has constraints.
fn held_velocity<const N: usize>(
    model: &dyn Constrains<N>,
    t: f64,
    (q, p): (&[f64; N], &[f64; N]),
    guess: &[f64; N],
) -> Result<[f64; N], StepError> {
    let count = model.declared().len();
    let size = N + count;
    let mut numbers = vec![0.0; rows_len(N, count)];
    let (rows, active) = chosen(model, (t, q), &mut numbers);
    let mut memory = Bordered {
        matrix: &mut vec![0.0; size * size],
        vector: &mut vec![0.0; size],
        pivots: &mut vec![0; size],
    };
    solve_velocity(model, t, (q, p), guess, &rows, &active, &mut memory)
}

/// The velocity that belongs to the momentum of a state, whether or not it satisfies the constraints; where the mass
/// matrix is singular, the velocity that the constraints determine.
///
/// # Errors
/// As for [`velocity`].
pub fn velocity_of<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    p: &[f64; N],
    guess: &[f64; N],
) -> Result<[f64; N], StepError>
where
    M: Model<N>,
{
    let v = velocity(model, t, q, p, guess)?;
    Ok(if const { M::CONSTRAINTS.is_empty() } {
        v
    } else {
        own_velocity(model, t, q, p, &v)?
    })
}

/// The velocity that satisfies the constraints and is nearest to `v` in the metric of the kinetic energy: the one that
/// belongs to the momentum L_v(q, v, t).
///
/// # Errors
/// As for [`velocity`].
pub fn velocity_for<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    v: &[f64; N],
) -> Result<[f64; N], StepError>
where
    M: Model<N>,
{
    let p = crate::legendre::momentum(model, t, q, v)?;
    velocity(model, t, q, &p, v)
}
