//! The linearised equations of an element: its interior unknowns as a linear function of its start and of parameters
//! (T-30).
//!
//! With r(x, y₀, γ) = 0 for the interior rates x and y₁ = Y(x, y₀, γ) for the end,
//!
//! ```text
//! δx = X_y δy₀ + X_γ δγ ,     X = −(∂r/∂x)⁻¹ ∂r/∂(y₀, γ) ,     δy₁ = Y_x δx + Y_y δy₀ + Y_γ δγ .
//! ```
//!
//! The rows are solved for x at a given start. The interior block of the nodal form of a primal element, which
//! is singular at isolated steps, is never inverted.

use crate::dual::{Dual, duals};
use crate::error::{StepError, TransitionError};
use crate::lu;
use crate::model::{By, First, Model, Second};
use crate::phase_form::PhaseForm;
use crate::scheme::SchemeRef;
use crate::velocity_form::{PointDerivatives, PointTangent, VelocityForm, add_row};

/// The change of one element, besides that of its start, for a unit change of a global unknown γ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Direction {
    /// dt/dγ of the time at the start of the element.
    pub time: f64,
    /// dh/dγ of the length of the element.
    pub length: f64,
    /// The parameter of the model that γ is, if it is one.
    pub parameter: Option<Parameter>,
    /// The factor of an additional force along the velocities, Q += damping · γ v.
    pub damping: f64,
}

impl Direction {
    /// The start of the element moves in time, its end does not.
    pub const START: Self = Self {
        time: 1.0,
        length: -1.0,
        parameter: None,
        damping: 0.0,
    };

    /// Only the end moves in time.
    pub const END: Self = Self {
        time: 0.0,
        length: 1.0,
        parameter: None,
        damping: 0.0,
    };
}

/// Checks that there is a sum for each column.
pub(crate) fn check_sums<const N: usize>(
    directions: &[Direction],
    lambda: &[f64],
    by_direction: &[f64],
) -> Result<(), TransitionError> {
    if lambda.len() == 2 * N && by_direction.len() == directions.len() {
        return Ok(());
    }
    Err(TransitionError::Shape {
        needed: 2 * N + directions.len(),
        given: lambda.len().min(2 * N) + by_direction.len(),
    })
}

/// A parameter of a model by which derivatives are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// By index in [`Model::SENSITIVITIES`]; differentiated by the kernel [`Model::first_by`].
    Named(usize),
    /// By index among all parameters ([`Model::parameter_name`]); differentiated by dual numbers.
    Any(usize),
}

impl Parameter {
    /// Its index among all parameters.
    #[cfg(feature = "alloc")]
    pub(crate) fn any<M: Model<N>, const N: usize>(self, model: &M) -> Option<usize> {
        match self {
            Self::Named(index) => model.find_parameter(M::SENSITIVITIES.get(index)?),
            Self::Any(index) => Some(index),
        }
    }
}

/// The linear system of one element: tangent, residual and right-hand sides, which the solutions later replace. The
/// sides have a row for each interior unknown and a column for each direction: first the 2N components of the start,
/// (p₀, q₀), then the other directions.
pub(crate) struct System<'a> {
    pub(crate) tangent: &'a mut [f64],
    pub(crate) pivots: &'a mut [usize],
    pub(crate) residual: &'a mut [f64],
    pub(crate) sides: &'a mut [f64],
}

/// The derivatives of h Σ b F, through which the momentum at the end of an element in velocity form depends on
/// everything.
pub(crate) struct EndForces<'a, const N: usize> {
    /// By the interior unknowns, N rows.
    pub(crate) by_interior: &'a mut [f64],
    /// By the coordinates at the start.
    pub(crate) by_start: &'a mut [[f64; N]],
    /// By the directions.
    pub(crate) by_direction: &'a mut [[f64; N]],
}

impl<'a, const N: usize> EndForces<'a, N> {
    /// The number of values needed for so many interior unknowns and directions.
    #[cfg(feature = "alloc")]
    pub(crate) const fn length(interior: usize, directions: usize) -> usize {
        N * (interior + N + directions)
    }

    /// Divides a slice of [`EndForces::length`] numbers into the three parts.
    pub(crate) fn of(memory: &'a mut [f64], interior: usize) -> Self {
        memory.fill(0.0);
        let (by_interior, rest) = memory.split_at_mut(N * interior);
        let (by_start, by_direction) = rest.as_chunks_mut().0.split_at_mut(N);
        Self {
            by_interior,
            by_start,
            by_direction,
        }
    }
}

impl System<'_> {
    /// The number of columns of the right-hand sides.
    fn columns(&self) -> usize {
        self.sides.len() / self.residual.len()
    }

    /// Sets up the system in phase space.
    pub(crate) fn of_phase<M, const N: usize>(
        &mut self,
        equations: &mut PhaseForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
    ) where
        M: Model<N>,
    {
        let points = equations.scheme.points();
        let (half, columns) = (points * N, self.columns());
        let (mut first, mut second) = (First::ZERO, Second::ZERO);
        for k in 0..points {
            let (t, q, p) = equations.place(k, x);
            equations.derivatives(k, x, &mut first, &mut second);
            equations.set_tangent(k, &second, self.tangent);
            for a in 0..N {
                let (pi, kappa) = (k * N + a, half + k * N + a);
                self.residual[pi] = x[pi] - (first.force[a] - first.q[a]);
                self.residual[kappa] = x[kappa] - first.z[a];
                for b in 0..N {
                    self.sides[pi * columns + b] = second.force_z[a][b] - second.zq[b][a];
                    self.sides[pi * columns + N + b] = second.force_q[a][b] - second.qq[a][b];
                    self.sides[kappa * columns + b] = second.zz[a][b];
                    self.sides[kappa * columns + N + b] = second.zq[a][b];
                }
            }
            for (direction, column) in directions.iter().zip(2 * N..) {
                let node = equations.scheme.nodes[k];
                let explicit = explicit(equations.model, t, &q, &p, direction, node);
                // At fixed interior rates, the stage moves with h.
                let row = k * points..(k + 1) * points;
                let (forces, velocities) = x.as_chunks::<N>().0.split_at(points);
                let (mut dp, mut dq) = ([0.0; N], [0.0; N]);
                for (l, weight) in equations.scheme.position[row].iter().enumerate() {
                    for a in 0..N {
                        dp[a] += direction.length * weight * forces[l][a];
                        dq[a] += direction.length * weight * velocities[l][a];
                    }
                }
                for a in 0..N {
                    let mut force = explicit.force[a] - explicit.q[a]
                        + direction.damping * first.z[a]
                        + equations.span.damping * explicit.z[a];
                    let mut velocity = explicit.z[a];
                    for b in 0..N {
                        force += (second.force_z[a][b] - second.zq[b][a]) * dp[b]
                            + (second.force_q[a][b] - second.qq[a][b]) * dq[b];
                        velocity += second.zz[a][b] * dp[b] + second.zq[a][b] * dq[b];
                    }
                    self.sides[(k * N + a) * columns + column] = force;
                    self.sides[(half + k * N + a) * columns + column] = velocity;
                }
            }
        }
    }

    /// Sets up the system in velocity form.
    pub(crate) fn of_velocities<M, const N: usize>(
        &mut self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
        ends: &mut EndForces<'_, N>,
    ) -> Result<(), StepError>
    where
        M: Model<N>,
    {
        let rates = x.as_chunks::<N>().0;
        let scheme = equations.scheme;
        let (count, rows, columns) = (scheme.points(), rates.len(), self.columns());
        let h = equations.span.h;
        self.tangent.fill(0.0);
        self.sides.fill(0.0);
        self.residual.fill(0.0);
        for i in 0..rows {
            for a in 0..N {
                self.sides[(i * N + a) * columns + a] = 1.0;
            }
        }
        let mut point = PointDerivatives::ZERO;
        for l in 0..count {
            equations.derivatives(l, rates, &mut point)?;
            equations.forces[l] = point.force;
            let by = PointTangent::of(h, &point.second);
            equations.add_to_tangent(l, &by, self.tangent);
            let end = h * scheme.weights[l];
            for (a, row) in ends.by_interior.chunks_exact_mut(x.len()).enumerate() {
                add_row(&equations.scheme, l, &by, a, 0.0, end, row);
            }
            let second = &point.second;
            let mut by_q = [[0.0; N]; N];
            for a in 0..N {
                for b in 0..N {
                    by_q[a][b] = second.qq[a][b] + second.force_q[a][b];
                    ends.by_start[a][b] += end * by_q[a][b];
                }
            }
            for i in 0..rows {
                let force = h * scheme.force[i * count + l];
                for a in 0..N {
                    let side = &mut self.sides[(i * N + a) * columns + N..][..N];
                    for b in 0..N {
                        side[b] += force * by_q[a][b];
                    }
                }
                let momentum = scheme.momentum[i * count + l];
                if momentum != 0.0 {
                    for a in 0..N {
                        self.residual[i * N + a] += momentum * point.p[a];
                        for b in 0..N {
                            self.sides[(i * N + a) * columns + N + b] -= momentum * second.zq[a][b];
                        }
                    }
                }
            }
            for (k, direction) in directions.iter().enumerate() {
                let (of_momentum, of_force) = equations.along(l, rates, &point, &by_q, direction);
                for a in 0..N {
                    ends.by_direction[k][a] +=
                        end * of_force[a] + direction.length * scheme.weights[l] * point.force[a];
                }
                for i in 0..rows {
                    let momentum = scheme.momentum[i * count + l];
                    let force = scheme.force[i * count + l];
                    for a in 0..N {
                        self.sides[(i * N + a) * columns + 2 * N + k] += force
                            * (direction.length * point.force[a] + h * of_force[a])
                            - momentum * of_momentum[a];
                    }
                }
            }
        }
        equations.subtract_impulse(self.residual.as_chunks_mut::<N>().0);
        Ok(())
    }

    /// Factors the tangent and solves for all right-hand sides.
    pub(crate) fn solve(self) -> Result<Self, StepError> {
        let size = self.residual.len();
        self.solve_by(|tangent, pivots| lu::factor(size, tangent, pivots))
    }

    /// The same with another way to factor the tangent.
    pub(crate) fn solve_by(
        self,
        factor: impl FnOnce(&mut [f64], &mut [usize]) -> Result<(), lu::Singular>,
    ) -> Result<Self, StepError> {
        let columns = self.columns();
        factor(self.tangent, self.pivots).map_err(|singular| StepError::SingularTangent {
            unknown: singular.column,
        })?;
        lu::solve_columns(self.tangent, self.pivots, columns, self.sides);
        Ok(self)
    }
}

impl<'a> System<'a> {
    /// The adjoint solution of (T-127): a single solve with the transposed factors, whatever the number of columns. On
    /// entry the residual holds λᵀ ∂(end)/∂(interior); the solution is returned.
    pub(crate) fn product(
        self,
        lambda: &mut [f64],
        by_direction: &mut [f64],
    ) -> Result<&'a [f64], StepError> {
        let (size, columns) = (self.residual.len(), self.columns());
        lu::factor(size, self.tangent, self.pivots).map_err(|singular| {
            StepError::SingularTangent {
                unknown: singular.column,
            }
        })?;
        lu::solve_transposed(size, self.tangent, self.pivots, self.residual);
        for (weight, side) in self.residual.iter().zip(self.sides.chunks_exact(columns)) {
            let sums = lambda.iter_mut().chain(by_direction.iter_mut());
            for (sum, entry) in sums.zip(side) {
                *sum += weight * entry;
            }
        }
        Ok(self.residual)
    }
}

/// Writes λᵀ ∂(end)/∂(interior) into `weights`, in phase space, together with the derivatives by the directions at
/// fixed interior rates.
pub(crate) fn phase_weights<const N: usize>(
    scheme: &SchemeRef<'_>,
    h: f64,
    x: &[f64],
    directions: &[Direction],
    (lambda, by_direction, weights): (&[f64], &mut [f64], &mut [f64]),
) {
    let half = scheme.points() * N;
    weights.fill(0.0);
    for (row, lambda) in lambda.iter().enumerate() {
        let (block, a) = (row / N, row % N);
        for (l, weight) in scheme.weights.iter().enumerate() {
            let at = block * half + l * N + a;
            weights[at] += h * weight * lambda;
            for (sum, direction) in by_direction.iter_mut().zip(directions) {
                *sum += direction.length * weight * x[at] * lambda;
            }
        }
    }
}

/// The same in velocity form, with the derivatives by the coordinates at the start as well.
pub(crate) fn velocity_weights<const N: usize>(
    scheme: &SchemeRef<'_>,
    h: f64,
    x: &[f64],
    (directions, forces): (&[Direction], &EndForces<'_, N>),
    (lambda, by_direction, weights): (&mut [f64], &mut [f64], &mut [f64]),
) {
    weights.fill(0.0);
    let (of_p, of_q) = lambda.split_at_mut(N);
    for (a, of_q) in of_q.iter().enumerate() {
        for (j, weight) in scheme.advance.iter().enumerate() {
            let at = j * N + a;
            weights[at] += h * weight * of_q;
            for (sum, direction) in by_direction.iter_mut().zip(directions) {
                *sum += direction.length * weight * x[at] * of_q;
            }
        }
    }
    for (a, of_p) in of_p.iter().enumerate() {
        add_multiple(
            weights,
            *of_p,
            &forces.by_interior[a * x.len()..][..x.len()],
        );
        add_multiple(of_q, *of_p, &forces.by_start[a]);
        for (sum, by_direction) in by_direction.iter_mut().zip(&*forces.by_direction) {
            *sum += by_direction[a] * of_p;
        }
    }
}

impl<M, const N: usize> VelocityForm<'_, M, N>
where
    M: Model<N>,
{
    /// The derivatives of the momentum and of the force at a point along a direction, at fixed velocities and a fixed
    /// start.
    pub(crate) fn along(
        &self,
        l: usize,
        rates: &[[f64; N]],
        point: &PointDerivatives<N>,
        by_q: &[[f64; N]; N],
        direction: &Direction,
    ) -> ([f64; N], [f64; N]) {
        let (t, q, v) = self.place(l, rates);
        let second = &point.second;
        let mut moved = [0.0; N];
        if direction.length != 0.0 {
            let row = l * rates.len()..(l + 1) * rates.len();
            for (weight, rate) in self.scheme.position[row].iter().zip(rates) {
                for a in 0..N {
                    moved[a] += direction.length * weight * rate[a];
                }
            }
        }
        let node = self.scheme.nodes[l];
        let (mut of_momentum, mut of_force) = ([0.0; N], [0.0; N]);
        if const { M::FORM.is_lagrangian() } {
            let by = explicit(self.model, t, &q, &v, direction, node);
            for a in 0..N {
                of_force[a] = by.q[a] + by.force[a];
                of_momentum[a] = by.z[a];
            }
        } else {
            // At fixed v the momentum moves: H_pp δp = −H_pa, and with it H_q and Q.
            let by = explicit(self.model, t, &q, &point.p, direction, node);
            for a in 0..N {
                // The additional force is a function of v, which is held fixed.
                of_force[a] = by.force[a] - by.q[a] + self.span.damping * by.z[a];
                for b in 0..N {
                    of_momentum[a] -= second.zz[a][b] * by.z[b];
                    of_force[a] -= (second.zq[b][a] + second.force_z[a][b]) * by.z[b];
                }
            }
        }
        for a in 0..N {
            of_force[a] += direction.damping * v[a];
            for b in 0..N {
                of_momentum[a] += second.zq[a][b] * moved[b];
                of_force[a] += by_q[a][b] * moved[b];
            }
        }
        (of_momentum, of_force)
    }
}

/// The explicit derivatives of the first derivatives and of the forces by the time and the parameter, at the place
/// `node` ∈ [0, 1] of the element.
fn explicit<M, const N: usize>(
    model: &M,
    t: f64,
    q: &[f64; N],
    z: &[f64; N],
    direction: &Direction,
    node: f64,
) -> First<f64, N>
where
    M: Model<N>,
{
    let mut sum = First::ZERO;
    let rate = if M::FACTS.time_dependent {
        direction.time + node * direction.length
    } else {
        0.0
    };
    let by_dual = match direction.parameter {
        Some(Parameter::Any(index)) => Some(index),
        Some(Parameter::Named(index)) => {
            model.first_by(By::Parameter(index), t, q, z, &mut sum);
            None
        }
        None => None,
    };
    if rate != 0.0 && by_dual.is_none() && const { !M::SENSITIVITIES.is_empty() } {
        let mut by_time = First::ZERO;
        model.first_by(By::Time, t, q, z, &mut by_time);
        for a in 0..N {
            sum.z[a] += rate * by_time.z[a];
            sum.q[a] += rate * by_time.q[a];
            sum.force[a] += rate * by_time.force[a];
        }
    } else if rate != 0.0 || by_dual.is_some() {
        let mut first = First::zero();
        let time = Dual::new(t, rate).by_parameter(by_dual);
        model.first(time, &duals(q, &[0.0; N]), &duals(z, &[0.0; N]), &mut first);
        for a in 0..N {
            sum.z[a] += first.z[a].slope;
            sum.q[a] += first.q[a].slope;
            sum.force[a] += first.force[a].slope;
        }
    }
    sum
}

/// The derivatives of the end, row by row, with the columns of the right-hand sides. A column beyond those of start and
/// directions is a change of the interior alone.
///
/// ```text
/// δy₁ = δy₀ + h Σ b δx + δh Σ b x
/// ```
pub(crate) fn phase_ends<const N: usize>(
    scheme: &SchemeRef<'_>,
    h: f64,
    x: &[f64],
    directions: &[Direction],
    sides: &[f64],
    ends: &mut [f64],
) {
    let half = scheme.points() * N;
    let columns = sides.len() / x.len();
    for (row, end) in ends.chunks_exact_mut(columns).enumerate().take(2 * N) {
        let (block, a) = (row / N, row % N);
        let mut rate = 0.0;
        end.fill(0.0);
        for (l, weight) in scheme.weights.iter().enumerate() {
            let at = block * half + l * N + a;
            rate += weight * x[at];
            add_multiple(end, h * weight, &sides[at * columns..(at + 1) * columns]);
        }
        for (entry, direction) in end[2 * N..].iter_mut().zip(directions) {
            *entry += direction.length * rate;
        }
        end[row] += 1.0;
    }
}

/// The same in velocity form:
///
/// ```text
/// δq₁ = δq₀ + h Σ β δν + δh Σ β ν ,     δp₁ = δp₀ + δ(h Σ b F) .
/// ```
pub(crate) fn velocity_ends<const N: usize>(
    scheme: &SchemeRef<'_>,
    h: f64,
    x: &[f64],
    directions: &[Direction],
    forces: &EndForces<'_, N>,
    sides: &[f64],
    ends: &mut [f64],
) {
    let columns = sides.len() / x.len();
    let (momenta, coordinates) = ends.split_at_mut(N * columns);
    let rows = momenta.chunks_exact_mut(columns);
    for (a, (end, weights)) in rows
        .zip(forces.by_interior.chunks_exact(x.len()))
        .enumerate()
    {
        end.fill(0.0);
        for (weight, side) in weights.iter().zip(sides.chunks_exact(columns)) {
            add_multiple(end, *weight, side);
        }
        end[a] += 1.0;
        for b in 0..N {
            end[N + b] += forces.by_start[a][b];
        }
        for (entry, by_direction) in end[2 * N..].iter_mut().zip(&*forces.by_direction) {
            *entry += by_direction[a];
        }
    }
    for (a, end) in coordinates.chunks_exact_mut(columns).enumerate().take(N) {
        let mut rate = 0.0;
        end.fill(0.0);
        for (j, weight) in scheme.advance.iter().enumerate() {
            let at = j * N + a;
            rate += weight * x[at];
            add_multiple(end, h * weight, &sides[at * columns..(at + 1) * columns]);
        }
        end[N + a] += 1.0;
        for (entry, direction) in end[2 * N..].iter_mut().zip(directions) {
            *entry += direction.length * rate;
        }
    }
}

/// sum += weight · row
#[inline(always)]
pub(crate) fn add_multiple(sum: &mut [f64], weight: f64, row: &[f64]) {
    // Plain loops instead of iterators, which would be compiled for the instruction set of the crate.
    let count = sum.len().min(row.len());
    let (sum, row) = (&mut sum[..count], &row[..count]);
    for a in 0..count {
        sum[a] += weight * row[a];
    }
}
