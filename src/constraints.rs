//! Constrained models: consistent starts, reactions, and the motions that constraints allow.
//!
//! A model with `constraint(name) = …` is run like any other; this module holds what is asked about it besides. Theory: `docs/theory.md`,
//! constraints.

pub(crate) mod allowed;

use crate::numbers::row_of;
use allowed::Held;
use nalgebra::{DMatrix, DVector};
use std::fmt;
use tfe_runtime::constrained::{self, Residual};
use tfe_runtime::{LegendreError, Model, State, StepError, legendre};

/// A state on the constraints, and how far the values that were given lay from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Consistent<const N: usize> {
    /// The state.
    pub state: State<N>,
    /// Its velocities.
    pub velocities: [f64; N],
    /// How far the coordinates moved: |q − q given|.
    pub position: f64,
    /// How far the velocities moved: |v − v given|.
    pub velocity: f64,
    /// The number of independent constraints there.
    pub rank: usize,
}

/// Why there is no consistent state near the values that were given.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ConsistentError {
    /// Newton's method did not reach the constraints: they contradict one another, or the values are too far away.
    Unreached {
        /// What is left, one entry for each constraint.
        residuals: Vec<Residual>,
        /// Iterations done.
        iterations: u32,
    },
    /// A value is not finite, or the model has no velocity (momentum) there.
    Model(StepError),
}

impl fmt::Display for ConsistentError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreached {
                residuals,
                iterations,
            } => {
                write!(
                    f,
                    "after {iterations} iterations the constraints are still violated:"
                )?;
                write_residuals(f, residuals)
            }
            Self::Model(source) => source.fmt(f),
        }
    }
}

impl std::error::Error for ConsistentError {}

impl From<StepError> for ConsistentError {
    fn from(error: StepError) -> Self {
        Self::Model(error)
    }
}

impl From<LegendreError> for ConsistentError {
    fn from(error: LegendreError) -> Self {
        Self::Model(error.into())
    }
}

/// Each constraint that does not hold, with what it leaves.
pub(crate) fn write_residuals(f: &mut fmt::Formatter<'_>, residuals: &[Residual]) -> fmt::Result {
    let mut separator = "";
    for residual in residuals {
        if residual.relative() <= constrained::START_TOLERANCE {
            continue;
        }
        write!(f, "{separator} `{}`", residual.constraint)?;
        if !(residual.relative_position <= constrained::START_TOLERANCE) {
            write!(f, " = {:.3e}", residual.position)?;
        }
        if !(residual.relative_velocity <= constrained::START_TOLERANCE) {
            write!(f, ", its velocity {:.3e}", residual.velocity)?;
        }
        separator = ";";
    }
    Ok(())
}

/// What a run leaves of its constraints, over all recorded nodes; zeros for models without any.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstraintResidual {
    /// max |φ| of the holonomic ones.
    pub position: f64,
    /// max |A v + a|
    pub velocity: f64,
    /// The smallest number of independent constraints; of models of run-time length, which need all to be so, their number.
    pub rank: usize,
}

/// The reactions λ of the constraints at the recorded nodes: the forces on the coordinates are Aᵀλ, with A = φ_q or the coefficients of the velocities.
///
/// They are those of the instant, from the state alone (theory.md (T-77)), so that they have the accuracy of the state. Of dependent constraints any
/// reactions with the same forces would do; these have the least Σ λ².
///
/// Constraints of models of run-time length are called by their sites, `rod[0]`, `rod[1]`, …
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reactions<Name = &'static str> {
    pub(crate) names: Vec<Name>,
    pub(crate) values: Vec<f64>,
}

impl<Name: fmt::Display> Reactions<Name> {
    /// The names of the constraints, in the order of declaration and of sites.
    pub fn names(&self) -> &[Name] {
        &self.names
    }

    /// The reactions of one constraint at the recorded nodes; `None` where the model declares no such name.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let is_it = |candidate: &Name| candidate.to_string() == name;
        let at = self.names.iter().position(is_it)?;
        let rows = self.values.chunks_exact(self.names.len());
        Some(rows.map(|row| row[at]).collect())
    }

    /// All reactions at one recorded node; `None` beyond the last node, if there are constraints.
    pub fn row(&self, node: usize) -> Option<&[f64]> {
        row_of(&self.values, self.names.len(), node)
    }
}

/// Finds states that satisfy the constraints of a model.
pub trait ConsistentState<const N: usize>: Model<N> + Sized {
    /// The consistent state nearest to (q, v) at t = 0; see [`consistent_state_at`](Self::consistent_state_at).
    ///
    /// # Errors
    /// [`ConsistentError`].
    ///
    /// ```
    /// use tfe::prelude::*;
    ///
    /// #[dynamics(coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y, constraint(rod) = x^2 + y^2 - l^2)]
    /// struct RodPendulum { m: f64, l: f64, g: f64 }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let pendulum = RodPendulum { m: 1.0, l: 1.0, g: 9.81 };
    /// // 45° and a velocity that is not quite along the circle.
    /// let start = pendulum.consistent_state([0.7, -0.7], [1.0, 1.1])?;
    /// assert!((start.state.q[0] - 0.5_f64.sqrt()).abs() < 1e-14);
    /// assert!((start.velocities[0] - 1.05).abs() < 1e-14);
    /// println!("moved by {:.3} and {:.3}", start.position, start.velocity);
    /// let motion = Simulation::new(&pendulum).step(0.01).run(start.state, 0.0..1.0)?;
    /// assert!(motion.constraint_residual().position < 1e-14);
    /// # Ok(())
    /// # }
    /// ```
    fn consistent_state(&self, q: [f64; N], v: [f64; N]) -> Result<Consistent<N>, ConsistentError> {
        self.consistent_state_at(0.0, q, v)
    }

    /// The consistent state nearest to (q, v) at the time t.
    ///
    /// Coordinates move by the least |δq| to φ(q, t) = 0, velocities by the least kinetic energy, ½ δvᵀ L_vv δv, to A v + a = 0: as by a blow
    /// of the reactions. Without constraints it is the state itself.
    ///
    /// # Errors
    /// [`ConsistentError`] if the constraints are not reached from there, or the model has no velocity there.
    fn consistent_state_at(
        &self,
        t: f64,
        q: [f64; N],
        v: [f64; N],
    ) -> Result<Consistent<N>, ConsistentError> {
        consistent(self, t, q, v)
    }
}

impl<M: Model<N>, const N: usize> ConsistentState<N> for M {}

/// The most iterations of a projection.
const MOST: u32 = 200;

fn consistent<M: Model<N>, const N: usize>(
    model: &M,
    t: f64,
    given: [f64; N],
    v: [f64; N],
) -> Result<Consistent<N>, ConsistentError> {
    let mut q = given;
    let (mut last, mut iterations) = (f64::INFINITY, 0);
    while let Some(step) = step_to_constraints::<M, N>(model, t, &given, &q) {
        iterations += 1;
        for a in 0..N {
            q[a] += step[a];
        }
        let (size, scale) = (step.norm(), q.iter().map(|q| q * q).sum::<f64>().sqrt());
        if !size.is_finite() {
            return Err(StepError::NonFinite.into());
        }
        let is_stuck = size >= last && size <= 1e-12 * scale;
        // What is nothing beside large coordinates may be much to small ones.
        if is_stuck || (size <= 2.0 * f64::EPSILON * scale && hold(model, t, &q)) {
            break;
        }
        if iterations == MOST {
            return Err(ConsistentError::Unreached {
                residuals: constrained::start_residuals(model, t, &q, &[0.0; N], 1.0),
                iterations,
            });
        }
        last = size;
    }
    let velocities = constrained::velocity_for(model, t, &q, &v)?;
    let residuals = constrained::start_residuals(model, t, &q, &velocities, 1.0);
    if residuals
        .iter()
        .any(|residual| !(residual.relative() <= constrained::START_TOLERANCE))
    {
        return Err(ConsistentError::Unreached {
            residuals,
            iterations,
        });
    }
    let distance = |a: &[f64; N], b: &[f64; N]| {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>().sqrt()
    };
    let independent = constrained::independent(model, t, &q);
    Ok(Consistent {
        state: legendre::state(model, t, &q, &velocities)?,
        velocities,
        position: distance(&q, &given),
        velocity: distance(&velocities, &v),
        rank: independent.into_iter().filter(|one| *one).count(),
    })
}

/// Whether the holonomic constraints hold at a position, as far as a start must.
fn hold<M: Model<N>, const N: usize>(model: &M, t: f64, q: &[f64; N]) -> bool {
    let residuals = constrained::start_residuals(model, t, q, &[0.0; N], 1.0);
    let mut positions = residuals.iter().map(|one| one.relative_position);
    positions.all(|position| position <= constrained::START_TOLERANCE)
}

/// One step of the projection: to the tangents of the constraints, and along them towards the given position. None without holonomic ones.
fn step_to_constraints<M: Model<N>, const N: usize>(
    model: &M,
    t: f64,
    given: &[f64; N],
    q: &[f64; N],
) -> Option<DVector<f64>> {
    let count = M::CONSTRAINTS.len();
    let (mut rows, mut drift) = (vec![[0.0; N]; count], vec![0.0; count]);
    let mut values = vec![0.0; count];
    model.constraint_rows(t, q, &mut rows, &mut drift);
    model.constraint_values(t, q, &mut values);
    let holonomic: Vec<usize> = (0..count)
        .filter(|c| M::CONSTRAINTS[*c].kind.is_holonomic())
        .collect();
    if holonomic.is_empty() {
        return None;
    }
    // Rows of length one, so that the rank does not depend on the units of constraints.
    let length = |c: usize| {
        let length = rows[c].iter().map(|a| a * a).sum::<f64>().sqrt();
        if length > 0.0 { length } else { 1.0 }
    };
    let a = DMatrix::from_fn(holonomic.len(), N, |row, column| {
        rows[holonomic[row]][column] / length(holonomic[row])
    });
    let phi = DVector::from_fn(holonomic.len(), |row, _| {
        values[holonomic[row]] / length(holonomic[row])
    });
    let back = DVector::from_fn(N, |a, _| given[a] - q[a]);
    let inverse = a.clone().pseudo_inverse(1e-10).ok()?;
    let tangent = &back - &inverse * (&a * &back);
    Some(tangent - inverse * phi)
}

/// An orthonormal basis of the motions (δp, δq) that the constraints allow at a state: 2N rows ordered (p, q), a column for each.
///
/// ```text
/// A_V δq = 0 ,   ∂(A v + a)/∂q δq + A δv = 0 ,   δp = L_vq δq + L_vv δv             (theory.md (T-78))
/// ```
///
/// With h independent holonomic constraints and n others there are 2N − 2h − n of them. Without constraints it is the identity.
///
/// # Errors
/// [`StepError`] if the model has no velocity at the state.
pub fn tangent_basis<M: Model<N>, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
) -> Result<DMatrix<f64>, StepError> {
    if const { M::CONSTRAINTS.is_empty() } {
        return Ok(DMatrix::identity(2 * N, 2 * N));
    }
    let v = constrained::velocity(model, t, &state.q, &state.p, &[0.0; N])?;
    let gradients = constrained::gradients(model, t, state, &v)?;
    let mut held = Vec::new();
    for (c, constraint) in M::CONSTRAINTS.iter().enumerate() {
        if !gradients.independent[c] {
            continue;
        }
        let (row, psi_q) = (&gradients.rows[c], &gradients.psi_q[c]);
        let both = |q: &[f64; N], v: &[f64; N]| {
            let entries = q.iter().chain(v).copied();
            DVector::from_iterator(2 * N, entries)
        };
        held.push(both(psi_q, row));
        if constraint.kind.is_holonomic() {
            held.push(both(row, &[0.0; N]));
        }
    }
    let second = &gradients.second;
    let to_momenta = DMatrix::from_fn(2 * N, 2 * N, |row, column| {
        if row >= N {
            f64::from(u8::from(row - N == column))
        } else if column < N {
            second.zq[row][column]
        } else {
            second.zz[row][column - N]
        }
    });
    let held = Held {
        gradients: held,
        to_momenta,
    };
    Ok(held.basis())
}

/// The transition matrices of a chain on the motions that the constraints allow at its nodes.
///
/// The last one leads back to the tangent space of the start, which is that of the end of a periodic motion.
pub(crate) fn reduced<M: Model<N>, const N: usize>(
    model: &M,
    nodes: impl IntoIterator<Item = (f64, State<N>)>,
    transitions: &[DMatrix<f64>],
) -> Result<Vec<DMatrix<f64>>, StepError> {
    let bases = nodes
        .into_iter()
        .take(transitions.len())
        .map(|(t, state)| tangent_basis(model, t, &state))
        .collect::<Result<Vec<_>, _>>()?;
    allowed::reduced(&bases, transitions.iter())
}
