//! Constrained models: consistent initial conditions, reactions, and the motions that the constraints allow.
//!
//! A model with `constraint(name) = …` is simulated like any other. A constraint is either holonomic, φ(q, t) = 0, or
//! linear in the velocities, A(q, t) v + a(q, t) = 0; for a holonomic one A = φ_q and a = φ_t. The equations of motion
//! with multipliers are (T-92) in `docs/theory.md`, §11, and those of an element (T-72), (T-73) and (T-80).

pub(crate) mod allowed;
mod projection;

use crate::numbers::{distance, larger, norm, row_of};
use allowed::ConstrainedMotions;
use nalgebra::{DMatrix, DVector};
use projection::{Led, Projection, all_hold, hold, holonomic, step_to_planes};
use std::fmt;
use tfe_runtime::constrained::{self, Gradients, Residual};
use tfe_runtime::{Constraint, LegendreError, Model, ModelError, State, StepError, legendre};

/// A consistent state, which satisfies all constraints, with its distance from the values given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Consistent<const N: usize> {
    /// The state.
    pub state: State<N>,
    /// The velocities of the state.
    pub velocities: [f64; N],
    /// The distance by which the coordinates moved: |q − q given|, the Euclidean norm.
    pub position: f64,
    /// The distance by which the velocities moved: |v − v given|, the Euclidean norm.
    pub velocity: f64,
    /// The number of independent constraints at the state (the rank of the constraint Jacobian A).
    pub rank: usize,
}

/// Why no consistent state was found near the values given.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ConsistentError {
    /// Newton's method did not reach the constraints: they contradict each other, or the values given are too far
    /// away.
    Unreached {
        /// The violation that is left, one entry for each constraint.
        residuals: Vec<Residual>,
        /// Iterations done.
        iterations: u32,
    },
    /// A value is not finite, or the mass matrix is singular there, so that no momentum or velocity belongs to the
    /// state.
    Model(StepError),
    /// The model does not pass its [check](Model::check).
    Check(ModelError),
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
            Self::Check(source) => source.fmt(f),
        }
    }
}

impl std::error::Error for ConsistentError {}

impl From<ModelError> for ConsistentError {
    fn from(error: ModelError) -> Self {
        Self::Check(error)
    }
}

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

/// Writes each constraint that is violated, with its residuals.
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

/// The largest violation of the constraints over all recorded nodes of a run; zeros for models without constraints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstraintResidual {
    /// max |φ| over the holonomic constraints, in their own units.
    pub position: f64,
    /// max |A v + a| over all constraints.
    pub velocity: f64,
    /// The smallest number of independent constraints at any node. For models of run-time length, whose constraints
    /// must all be independent, this is the number of constraints.
    pub rank: usize,
}

impl ConstraintResidual {
    /// Includes the residual at another node.
    pub(crate) fn include(&mut self, other: Self) {
        self.position = larger(self.position, other.position);
        self.velocity = larger(self.velocity, other.velocity);
        self.rank = self.rank.min(other.rank);
    }
}

/// The reactions (Lagrange multipliers) λ of the constraints at the recorded nodes. The reaction forces on the
/// coordinates are Aᵀλ, with A = φ_q for a holonomic constraint, and A the coefficients of the velocities for others.
///
/// They are computed from the state at each node alone (`docs/theory.md` (T-77)), so that they are as accurate as the
/// state. If constraints are dependent, several λ give the same forces; the one with least Σ λ² is returned.
///
/// Constraints of models of run-time length are named by their sites: `rod[0]`, `rod[1]`, …
///
/// ```
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x, y), lagrangian = m/2*(dot(x)^2 + dot(y)^2) - m*g*y, constraint(rod) = x^2 + y^2 - l^2)]
/// struct RodPendulum { m: f64, l: f64, g: f64 }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let pendulum = RodPendulum { m: 1.0, l: 2.0, g: 9.81 };
/// let hanging = pendulum.state([0.0, -2.0], [0.0, 0.0]);
/// let motion = Simulation::new(&pendulum).step(0.1).run(hanging, 0.0..1.0)?;
/// let rod = motion.reactions().column("rod").ok_or("the model declares it")?;
/// // The force Aᵀλ with A = (2x, 2y) carries the weight: 2 y λ = m g.
/// assert!((2.0 * (-2.0) * rod[0] - 9.81).abs() < 1e-12);
/// # Ok(())
/// # }
/// ```
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

    /// The reactions of one constraint at the recorded nodes; `None` if the model declares no constraint of this name.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let is_it = |candidate: &Name| candidate.to_string() == name;
        let at = self.names.iter().position(is_it)?;
        let rows = self.values.chunks_exact(self.names.len());
        Some(rows.map(|row| row[at]).collect())
    }

    /// All reactions at one recorded node, in the order of [`names`](Self::names); `None` if there is no such node and
    /// the model has constraints.
    pub fn row(&self, node: usize) -> Option<&[f64]> {
        row_of(&self.values, self.names.len(), node)
    }
}

/// Finds consistent initial conditions: states that satisfy the constraints of a model, near given coordinates and
/// velocities. Implemented for every model of fixed size.
pub trait ConsistentState<const N: usize>: Model<N> + Sized {
    /// The consistent state nearest to (q, v) at t = 0; see [`consistent_state_at`](Self::consistent_state_at).
    ///
    /// # Errors
    /// As from [`consistent_state_at`](Self::consistent_state_at).
    ///
    /// # Example
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
    /// The coordinates move to the nearest point with φ(q, t) = 0, in the sense of least |δq|; where constraints of
    /// tiny lengths beside angles are independent only in the units of the kinetic energy, in these. The velocities
    /// then change to satisfy A v + a = 0 with the least kinetic energy ½ δvᵀ L_vv δv of the change, as by an impulse
    /// of the reactions:
    ///
    /// ```text
    /// q ← q − A⁺ φ(q, t) + (I − A⁺A)(q_given − q)   (repeated) ;     L_v(v) + Aᵀν = L_v(v_given) ,   A v + a = 0      (T-96)
    /// ```
    ///
    /// with A⁺ the pseudoinverse of A = φ_q. Without constraints, the state itself is returned.
    ///
    /// # Errors
    /// [`ConsistentError::Unreached`] if the constraints are not reached from (q, v), [`ConsistentError::Model`] if a value
    /// is not finite or the mass matrix is singular there, [`ConsistentError::Check`] if the model does not pass its check.
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

/// The largest number of iterations of a projection.
const MAX: u32 = 200;

fn consistent<M: Model<N>, const N: usize>(
    model: &M,
    t: f64,
    given: [f64; N],
    v: [f64; N],
) -> Result<Consistent<N>, ConsistentError> {
    model.check()?;
    let residuals = |q: &[f64; N], v: &[f64; N]| constrained::start_residuals(model, t, q, v, 1.0);
    let still = [0.0; N];
    let mut q = given;
    let mut projection = Projection::BEGUN;
    while let Some(step) = step_to_constraints::<M, N>(model, t, &given, &q) {
        let is_reached = match projection.pass(&step, &mut q)? {
            Led::Reached => true,
            Led::Settled => hold(&residuals(&q, &still)),
            Led::Closer => false,
        };
        if is_reached || (projection.iterations == MAX && without_roundings(q, &given) != q) {
            break;
        }
        if projection.iterations == MAX {
            return Err(ConsistentError::Unreached {
                residuals: residuals(&q, &still),
                iterations: projection.iterations,
            });
        }
    }
    let mut velocities = constrained::velocity_for(model, t, &q, &v)?;
    if !all_hold(&residuals(&q, &velocities)) {
        // Numbers that are nothing but rounding errors of those given violate constraints by as much as they are.
        q = without_roundings(q, &given);
        velocities = without_roundings(constrained::velocity_for(model, t, &q, &v)?, &v);
    }
    let residuals = residuals(&q, &velocities);
    if !all_hold(&residuals) {
        return Err(ConsistentError::Unreached {
            residuals,
            iterations: projection.iterations,
        });
    }
    let independent = constrained::independent(model, t, &q);
    Ok(Consistent {
        state: legendre::state(model, t, &q, &velocities)?,
        velocities,
        position: distance(&q, &given),
        velocity: distance(&velocities, &v),
        rank: rank_of(&independent),
    })
}

/// These numbers, or zeros if they are rounding errors of those from which they come.
fn without_roundings<const N: usize>(numbers: [f64; N], given: &[f64; N]) -> [f64; N] {
    const ROUNDINGS: f64 = 64.0 * f64::EPSILON;
    match norm(&numbers) <= ROUNDINGS * norm(given) {
        true => [0.0; N],
        false => numbers,
    }
}

/// The number of independent constraints.
pub(crate) fn rank_of(independent: &[bool]) -> usize {
    independent.iter().filter(|one| **one).count()
}

/// One step of the projection; see [`step_to_planes`]. `None` without holonomic constraints.
fn step_to_constraints<M: Model<N>, const N: usize>(
    model: &M,
    t: f64,
    given: &[f64; N],
    q: &[f64; N],
) -> Option<DVector<f64>> {
    let holonomic = holonomic(M::CONSTRAINTS);
    if holonomic.is_empty() {
        return None;
    }
    let count = M::CONSTRAINTS.len();
    let (mut rows, mut drift) = (vec![[0.0; N]; count], vec![0.0; count]);
    let mut values = vec![0.0; count];
    model.constraint_rows(t, q, &mut rows, &mut drift);
    model.constraint_values(t, q, &mut values);
    let units = constrained::units(model, t, q);
    let numbers = (rows.as_flattened_mut(), &values[..]);
    step_to_planes(&holonomic, numbers, &units, (&given[..], &q[..]))
}

/// An orthonormal basis of the variations (δp, δq) that the constraints allow at a state: a matrix of 2N rows, ordered
/// (p, q), with one column for each basis vector.
///
/// ```text
/// A_V δq = 0 ,   ∂(A v + a)/∂q δq + A δv = 0 ,   δp = L_vq δq + L_vv δv             (theory.md (T-78))
/// ```
///
/// With a independent holonomic constraints and b others there are 2N − 2a − b columns. Without constraints the result
/// is the identity.
///
/// # Errors
/// [`StepError::Inconsistent`] if the model does not pass its [check](Model::check); [`StepError::Constraint`],
/// [`StepError::Legendre`] or [`StepError::NonFinite`] if no velocity belongs to the momenta at the state.
///
/// # Example
/// ```
/// use tfe::constraints::tangent_basis;
/// use tfe::prelude::*;
///
/// #[dynamics(coordinates(x, y), lagrangian = (dot(x)^2 + dot(y)^2)/2 - y, constraint(rod) = x^2 + y^2 - 1)]
/// struct Pendulum;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let hanging = Pendulum.state([0.0, -1.0], [0.0, 0.0]);
/// let basis = tangent_basis(&Pendulum, 0.0, &hanging)?;
/// assert_eq!(basis.shape(), (4, 2)); // δp_x and δx only
/// assert!(basis.row(1).norm() < 1e-14 && basis.row(3).norm() < 1e-14);
/// # Ok(())
/// # }
/// ```
pub fn tangent_basis<M: Model<N>, const N: usize>(
    model: &M,
    t: f64,
    state: &State<N>,
) -> Result<DMatrix<f64>, StepError> {
    if const { M::CONSTRAINTS.is_empty() } {
        return Ok(DMatrix::identity(2 * N, 2 * N));
    }
    if model.check().is_err() {
        return Err(StepError::Inconsistent);
    }
    let v = constrained::velocity(model, t, &state.q, &state.p, &[0.0; N])?;
    let gradients = constrained::gradients(model, t, state, &v)?;
    Ok(held(M::CONSTRAINTS, &gradients).basis())
}

/// The motions that constraints with these derivatives allow.
fn held<const N: usize>(declared: &[Constraint], gradients: &Gradients<N>) -> ConstrainedMotions {
    let mut held = Vec::new();
    for (c, constraint) in declared.iter().enumerate() {
        if !gradients.independent[c] {
            continue;
        }
        let (row, psi_q) = (&gradients.rows[c], &gradients.psi_q[c]);
        held.push(DVector::from_vec([&psi_q[..], row].concat()));
        if constraint.kind.is_holonomic() {
            held.push(DVector::from_vec([&row[..], &[0.0; N]].concat()));
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
    ConstrainedMotions {
        gradients: held,
        to_momenta,
    }
}

/// The transition matrices of a chain, restricted to the motions that the constraints allow at its nodes.
///
/// The last one maps to the tangent space of the start, which is that of the end of a periodic motion.
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
