//! Transition matrices: the derivative of a step by its start, by implicit differentiation (T-30).
//!
//! Rows are solved for the unknown rates given (p₀, q₀); the interior block of a primal element,
//! singular at isolated steps, is never inverted.

use core::fmt;

use crate::element::ElementError;
use crate::equations::Span;
use crate::error::StepError;
use crate::lu;
#[cfg(feature = "alloc")]
use crate::model::State;
use crate::model::{First, Model, Second};
use crate::phase_form::PhaseForm;
use crate::scheme::Tables;
use crate::step::{Impulse, Interval, Memory, Method, is_phase, set_kicks};
use crate::velocity_form::{PointDerivatives, VelocityForm};
use crate::workspace::{Parts, Workspace, transition_len};

/// Why there is no transition matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum TransitionError {
    /// The element is none.
    Element(ElementError),
    /// The step itself failed, or its tangent is singular.
    Step(StepError),
    /// No step has been done whose matrix could be meant.
    NoStep,
    /// The result needs more room.
    Shape {
        /// Numbers that are needed.
        needed: usize,
        /// Numbers that were given.
        given: usize,
    },
}

impl From<ElementError> for TransitionError {
    fn from(error: ElementError) -> Self {
        Self::Element(error)
    }
}

impl From<StepError> for TransitionError {
    fn from(error: StepError) -> Self {
        Self::Step(error)
    }
}

impl fmt::Display for TransitionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Element(error) => error.fmt(f),
            Self::Step(error) => error.fmt(f),
            Self::NoStep => f.write_str("no step has been done"),
            Self::Shape { needed, given } => {
                write!(
                    f,
                    "the transition matrix needs {needed} numbers, not {given}"
                )
            }
        }
    }
}

impl core::error::Error for TransitionError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Element(error) => error.source(),
            Self::Step(error) => error.source(),
            _ => None,
        }
    }
}

/// Writes the transition matrix of one step from `state`, 2N × 2N, row by row, ordered (p, q);
/// returns the end of the step.
///
/// # Errors
/// [`TransitionError`] if the element is none, the step fails, or `matrix` is shorter than 4N².
#[cfg(feature = "alloc")]
pub fn of_step<M, const N: usize>(
    model: &M,
    element: crate::element::Element,
    state: &State<N>,
    t: f64,
    h: f64,
    matrix: &mut [f64],
) -> Result<State<N>, TransitionError>
where
    M: Model<N>,
{
    let control = crate::newton::Control::default();
    let mut stepper = crate::step::Stepper::new(model, element, control)?;
    let mut end = *state;
    stepper.advance(t, h, &mut end, &[])?;
    stepper.transition(matrix)?;
    Ok(end)
}

impl<M, T> Method<'_, M, T>
where
    T: Tables,
{
    /// Writes the transition matrix of the last step, 2N × 2N, row by row, ordered (p, q).
    ///
    /// `extra` needs [`transition_len`] numbers; `impulses` are those of the step.
    ///
    /// # Errors
    /// [`TransitionError`] if there is no last step, its tangent is singular, or memory is short.
    pub fn transition<const N: usize>(
        &self,
        memory: &mut Memory<N>,
        workspace: Workspace<'_>,
        extra: &mut [f64],
        impulses: &[Impulse<N>],
        matrix: &mut [f64],
    ) -> Result<(), TransitionError>
    where
        M: Model<N>,
    {
        let Some(last) = memory.last else {
            return Err(TransitionError::NoStep);
        };
        let scheme = self.tables.view();
        let parts = Parts::of(workspace, &scheme.element, M::FORM)?;
        let needed = transition_len(scheme.element, M::FORM, N);
        if extra.len() < needed {
            return Err(StepError::Workspace {
                needed,
                given: extra.len(),
            }
            .into());
        }
        if matrix.len() < 4 * N * N {
            return Err(TransitionError::Shape {
                needed: 4 * N * N,
                given: matrix.len(),
            });
        }
        let interval = Interval {
            start: last.t,
            length: last.h,
            impulses,
        };
        set_kicks(&scheme, &interval, parts.kicks);
        // The factors of a linear model are overwritten with equal ones, but that is not promised.
        memory.forget_factors();
        let kicks: &[[f64; N]] = parts.kicks;
        let span = Span {
            t: last.t,
            h: last.h,
            start: &last.start,
            low: &last.start_low,
            kicks,
        };
        let m = parts.unknowns.len();
        // One right side, or solution, for each of the 2N directions of the start.
        let (sides, derivatives) = extra.split_at_mut(2 * N * m);
        if is_phase::<M, N>(&scheme) {
            let mut equations = PhaseForm {
                model: self.model,
                scheme,
                span,
                momenta: parts.momenta,
                velocities: parts.forces,
                masses: parts.masses,
                swept: false,
                statistics: &mut memory.statistics,
            };
            phase_sides(&mut equations, parts.unknowns, parts.tangent, sides);
            solve_sides(m, parts.tangent, parts.tangent_pivots, sides)?;
            phase_matrix::<N>(&equations.scheme, span.h, sides, matrix);
        } else {
            let mut equations = VelocityForm {
                model: self.model,
                scheme,
                span,
                forces: parts.forces,
                momenta: parts.momenta,
                masses: parts.masses,
                mass_pivots: parts.mass_pivots,
                constant_mass: &mut memory.mass,
                statistics: &mut memory.statistics,
            };
            let points = derivatives.as_chunks_mut::<N>().0;
            velocity_sides(&mut equations, parts.unknowns, parts.tangent, sides, points)?;
            solve_sides(m, parts.tangent, parts.tangent_pivots, sides)?;
            velocity_matrix::<N>(&equations.scheme, span.h, sides, points, matrix);
        }
        Ok(())
    }
}

fn solve_sides(
    size: usize,
    tangent: &mut [f64],
    pivots: &mut [usize],
    sides: &mut [f64],
) -> Result<(), StepError> {
    lu::factor(size, tangent, pivots).map_err(|singular| StepError::SingularTangent {
        unknown: singular.column,
    })?;
    for side in sides.chunks_exact_mut(size) {
        lu::solve(size, tangent, pivots, side);
    }
    Ok(())
}

/// Tangent, and the derivatives of f by the start of each stage.
fn phase_sides<M, const N: usize>(
    equations: &mut PhaseForm<'_, M, N>,
    unknowns: &[f64],
    tangent: &mut [f64],
    sides: &mut [f64],
) where
    M: Model<N>,
{
    let points = equations.scheme.points();
    let (half, m) = (points * N, 2 * points * N);
    let (mut first, mut second) = (First::ZERO, Second::ZERO);
    for k in 0..points {
        equations.derivatives(k, unknowns, &mut first, &mut second);
        equations.set_tangent(k, &second, tangent);
        for a in 0..N {
            let (pi, kappa) = (k * N + a, half + k * N + a);
            for b in 0..N {
                let (p, q) = (b * m, (N + b) * m);
                sides[p + pi] = second.force_z[a][b] - second.zq[b][a];
                sides[q + pi] = second.force_q[a][b] - second.qq[a][b];
                sides[p + kappa] = second.zz[a][b];
                sides[q + kappa] = second.zq[a][b];
            }
        }
    }
}

/// δy₁ = δy₀ + h Σ b δx.
fn phase_matrix<const N: usize>(
    scheme: &crate::scheme::SchemeRef<'_>,
    h: f64,
    sides: &[f64],
    matrix: &mut [f64],
) {
    let points = scheme.points();
    for (column, side) in sides.chunks_exact(2 * points * N).enumerate() {
        for (block, half) in side.chunks_exact(points * N).enumerate() {
            for a in 0..N {
                let row = block * N + a;
                let mut sum = 0.0;
                for (weight, rate) in scheme.weights.iter().zip(half.as_chunks::<N>().0) {
                    sum += weight * rate[a];
                }
                matrix[row * 2 * N + column] = h * sum + if row == column { 1.0 } else { 0.0 };
            }
        }
    }
}

/// Tangent, −∂r/∂(p₀, q₀), and at each point the derivatives of the force by v and by q.
fn velocity_sides<M, const N: usize>(
    equations: &mut VelocityForm<'_, M, N>,
    unknowns: &[f64],
    tangent: &mut [f64],
    sides: &mut [f64],
    derivatives: &mut [[f64; N]],
) -> Result<(), StepError>
where
    M: Model<N>,
{
    let rates = unknowns.as_chunks::<N>().0;
    let (points, rows, m) = (equations.scheme.points(), rates.len(), unknowns.len());
    let h = equations.span.h;
    tangent.fill(0.0);
    sides.fill(0.0);
    for i in 0..rows {
        for a in 0..N {
            sides[a * m + i * N + a] = 1.0;
        }
    }
    let mut point = PointDerivatives {
        p: [0.0; N],
        force: [0.0; N],
        second: Second::ZERO,
    };
    for l in 0..points {
        equations.derivatives(l, rates, &mut point)?;
        equations.add_to_tangent(l, &point.second, tangent);
        let second = &point.second;
        let (by_v, by_q) = derivatives[2 * l * N..2 * (l + 1) * N].split_at_mut(N);
        for a in 0..N {
            for b in 0..N {
                by_v[a][b] = second.zq[b][a] + second.force_z[a][b];
                by_q[a][b] = second.qq[a][b] + second.force_q[a][b];
            }
        }
        for i in 0..rows {
            let momentum = equations.scheme.momentum[i * points + l];
            let force = h * equations.scheme.force[i * points + l];
            for a in 0..N {
                for b in 0..N {
                    sides[(N + b) * m + i * N + a] +=
                        force * by_q[a][b] - momentum * second.zq[a][b];
                }
            }
        }
    }
    Ok(())
}

/// δq₁ = δq₀ + h Σ β δν and δp₁ = δp₀ + h Σ b (F_v δv + F_q δq).
fn velocity_matrix<const N: usize>(
    scheme: &crate::scheme::SchemeRef<'_>,
    h: f64,
    sides: &[f64],
    derivatives: &[[f64; N]],
    matrix: &mut [f64],
) {
    let (points, unknowns) = (scheme.points(), scheme.unknowns());
    for (column, side) in sides.chunks_exact(unknowns * N).enumerate() {
        let rates = side.as_chunks::<N>().0;
        let (mut dp, mut dq) = ([0.0; N], [0.0; N]);
        for (weight, rate) in scheme.advance.iter().zip(rates) {
            for a in 0..N {
                dq[a] += h * weight * rate[a];
            }
        }
        for l in 0..points {
            let (mut velocity, mut position) = ([0.0; N], [0.0; N]);
            for (j, rate) in rates.iter().enumerate() {
                let row = l * unknowns + j;
                for a in 0..N {
                    velocity[a] += scheme.velocity[row] * rate[a];
                    position[a] += h * scheme.position[row] * rate[a];
                }
            }
            if column >= N {
                position[column - N] += 1.0;
            }
            let (by_v, by_q) = derivatives[2 * l * N..2 * (l + 1) * N].split_at(N);
            for a in 0..N {
                for b in 0..N {
                    dp[a] += h
                        * scheme.weights[l]
                        * (by_v[a][b] * velocity[b] + by_q[a][b] * position[b]);
                }
            }
        }
        if column < N {
            dp[column] += 1.0;
        } else {
            dq[column - N] += 1.0;
        }
        for a in 0..N {
            matrix[a * 2 * N + column] = dp[a];
            matrix[(N + a) * 2 * N + column] = dq[a];
        }
    }
}
