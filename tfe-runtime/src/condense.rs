//! The equations of an element, differentiated: its interior as a linear function of its start and of parameters (T-30).
//!
//! With r(x, y₀, γ) = 0 for the interior rates x and y₁ = Y(x, y₀, γ) for the end,
//!
//! ```text
//! δx = X_y δy₀ + X_γ δγ ,     X = −(∂r/∂x)⁻¹ ∂r/∂(y₀, γ) ,     δy₁ = Y_x δx + Y_y δy₀ + Y_γ δγ .
//! ```
//!
//! The rows are solved for x given the start; the interior block of a primal element, singular at isolated steps, is never
//! inverted.

use crate::error::StepError;
use crate::lu;
use crate::model::{By, First, Form, Model, Second};
use crate::phase_form::PhaseForm;
use crate::scheme::SchemeRef;
use crate::velocity_form::{PointDerivatives, VelocityForm};

/// What a unit of a global unknown γ changes in one element, beside its start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Direction {
    /// dt/dγ of the start of the element.
    pub time: f64,
    /// dh/dγ of its length.
    pub length: f64,
    /// The parameter, by its index in [`Model::SENSITIVITIES`], that γ is.
    pub parameter: Option<usize>,
    /// Its part of the additional force along the velocities, Q += damping · γ v.
    pub damping: f64,
}

/// The linear system of one element: tangent, residual, and a right side, later the solution, for each direction: first the 2N of
/// the start, (p₀, q₀), then the others.
pub(crate) struct System<'a> {
    pub(crate) tangent: &'a mut [f64],
    pub(crate) pivots: &'a mut [usize],
    pub(crate) residual: &'a mut [f64],
    pub(crate) sides: &'a mut [f64],
}

impl System<'_> {
    /// Sets it up in phase space.
    pub(crate) fn of_phase<M, const N: usize>(
        &mut self,
        equations: &mut PhaseForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
    ) where
        M: Model<N>,
    {
        let points = equations.scheme.points();
        let (half, m) = (points * N, x.len());
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
                    let (p, q) = (b * m, (N + b) * m);
                    self.sides[p + pi] = second.force_z[a][b] - second.zq[b][a];
                    self.sides[q + pi] = second.force_q[a][b] - second.qq[a][b];
                    self.sides[p + kappa] = second.zz[a][b];
                    self.sides[q + kappa] = second.zq[a][b];
                }
            }
            for (direction, side) in directions
                .iter()
                .zip(self.sides[2 * N * m..].chunks_exact_mut(m))
            {
                let node = equations.scheme.nodes[k];
                let explicit = explicit(equations.model, t, &q, &p, direction, node);
                // The stage moves with h at a fixed interior.
                let row = k * points..(k + 1) * points;
                let (forces, velocities) = x.as_chunks::<N>().0.split_at(points);
                let mut moved = ([0.0; N], [0.0; N]);
                for (l, weight) in equations.scheme.position[row].iter().enumerate() {
                    for a in 0..N {
                        moved.0[a] += direction.length * weight * forces[l][a];
                        moved.1[a] += direction.length * weight * velocities[l][a];
                    }
                }
                for a in 0..N {
                    let mut force = explicit.force[a] - explicit.q[a]
                        + direction.damping * first.z[a]
                        + equations.span.damping * explicit.z[a];
                    let mut velocity = explicit.z[a];
                    for b in 0..N {
                        force += (second.force_z[a][b] - second.zq[b][a]) * moved.0[b]
                            + (second.force_q[a][b] - second.qq[a][b]) * moved.1[b];
                        velocity += second.zz[a][b] * moved.0[b] + second.zq[a][b] * moved.1[b];
                    }
                    side[k * N + a] = force;
                    side[half + k * N + a] = velocity;
                }
            }
        }
    }

    /// Sets it up for velocities; `points` keeps, at each point, the derivatives of L_q + Q by v, by q and by the directions.
    pub(crate) fn of_velocities<M, const N: usize>(
        &mut self,
        equations: &mut VelocityForm<'_, M, N>,
        x: &[f64],
        directions: &[Direction],
        points: &mut [[f64; N]],
    ) -> Result<(), StepError>
    where
        M: Model<N>,
    {
        let rates = x.as_chunks::<N>().0;
        let scheme = equations.scheme;
        let (count, rows, m) = (scheme.points(), rates.len(), x.len());
        let h = equations.span.h;
        self.tangent.fill(0.0);
        self.sides.fill(0.0);
        self.residual.fill(0.0);
        for i in 0..rows {
            for a in 0..N {
                self.sides[a * m + i * N + a] = 1.0;
            }
        }
        let mut point = PointDerivatives {
            p: [0.0; N],
            force: [0.0; N],
            second: Second::ZERO,
        };
        let stored = points.chunks_exact_mut(2 * N + directions.len());
        for (l, stored) in stored.enumerate().take(count) {
            equations.derivatives(l, rates, &mut point)?;
            equations.add_to_tangent(l, &point.second, self.tangent);
            equations.forces[l] = point.force;
            let second = &point.second;
            let (by_v, rest) = stored.split_at_mut(N);
            let (by_q, by_direction) = rest.split_at_mut(N);
            for a in 0..N {
                for b in 0..N {
                    by_v[a][b] = second.zq[b][a] + second.force_z[a][b];
                    by_q[a][b] = second.qq[a][b] + second.force_q[a][b];
                }
            }
            for i in 0..rows {
                let momentum = scheme.momentum[i * count + l];
                let force = h * scheme.force[i * count + l];
                for a in 0..N {
                    self.residual[i * N + a] += momentum * point.p[a];
                    for b in 0..N {
                        self.sides[(N + b) * m + i * N + a] +=
                            force * by_q[a][b] - momentum * second.zq[a][b];
                    }
                }
            }
            let sides = self.sides[2 * N * m..].chunks_exact_mut(m);
            for ((direction, side), of_force) in directions.iter().zip(sides).zip(by_direction) {
                let (of_momentum, moved) = equations.along(l, rates, &point, direction, of_force);
                for a in 0..N {
                    for b in 0..N {
                        of_force[a] += by_q[a][b] * moved[b];
                    }
                }
                for i in 0..rows {
                    let momentum = scheme.momentum[i * count + l];
                    let force = scheme.force[i * count + l];
                    for a in 0..N {
                        side[i * N + a] += force
                            * (direction.length * point.force[a] + h * of_force[a])
                            - momentum * of_momentum[a];
                    }
                }
            }
        }
        equations.subtract_impulse(self.residual.as_chunks_mut::<N>().0);
        Ok(())
    }

    /// Solves all sides.
    pub(crate) fn solve(self) -> Result<Self, StepError> {
        let size = self.residual.len();
        lu::factor(size, self.tangent, self.pivots).map_err(|singular| {
            StepError::SingularTangent {
                unknown: singular.column,
            }
        })?;
        for side in self.sides.chunks_exact_mut(size) {
            lu::solve(size, self.tangent, self.pivots, side);
        }
        Ok(self)
    }
}

impl<M, const N: usize> VelocityForm<'_, M, N>
where
    M: Model<N>,
{
    /// What a direction changes at a point while velocities and start stay: writes the explicit part of the derivative of the
    /// force, returns that of the momentum (with that of the moved coordinates) and how the coordinates move.
    fn along(
        &self,
        l: usize,
        rates: &[[f64; N]],
        point: &PointDerivatives<N>,
        direction: &Direction,
        of_force: &mut [f64; N],
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
        let mut of_momentum = [0.0; N];
        match M::FORM {
            Form::Lagrangian => {
                let by = explicit(self.model, t, &q, &v, direction, node);
                for a in 0..N {
                    of_force[a] = by.q[a] + by.force[a];
                    of_momentum[a] = by.z[a];
                }
            }
            // At fixed v the momentum moves: H_pp δp = −H_pa, and with it H_q and Q.
            Form::Hamiltonian => {
                let by = explicit(self.model, t, &q, &point.p, direction, node);
                for a in 0..N {
                    // The additional force is one of v, which stays.
                    of_force[a] = by.force[a] - by.q[a] + self.span.damping * by.z[a];
                    for b in 0..N {
                        of_momentum[a] -= second.zz[a][b] * by.z[b];
                        of_force[a] -= (second.zq[b][a] + second.force_z[a][b]) * by.z[b];
                    }
                }
            }
        }
        for a in 0..N {
            of_force[a] += direction.damping * v[a];
            for b in 0..N {
                of_momentum[a] += second.zq[a][b] * moved[b];
            }
        }
        (of_momentum, moved)
    }
}

/// The explicit derivative of first derivatives and forces, by time and parameter, at the place `node` ∈ [0, 1] of the element.
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
    if let Some(parameter) = direction.parameter {
        model.first_by(By::Parameter(parameter), t, q, z, &mut sum);
    }
    let rate = direction.time + node * direction.length;
    if M::FACTS.time_dependent && rate != 0.0 {
        let mut by_time = First::ZERO;
        model.first_by(By::Time, t, q, z, &mut by_time);
        for a in 0..N {
            sum.z[a] += rate * by_time.z[a];
            sum.q[a] += rate * by_time.q[a];
            sum.force[a] += rate * by_time.force[a];
        }
    }
    sum
}

/// The derivatives of the end, row by row: one column for each of the 2N directions of the start and for each other one. A further side, if there
/// is one, is a change of the interior alone and gives the last column.
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
    for (column, side) in sides.chunks_exact(x.len()).enumerate() {
        let length = column
            .checked_sub(2 * N)
            .and_then(|direction| directions.get(direction))
            .map_or(0.0, |direction| direction.length);
        for (block, (half, rates)) in side
            .chunks_exact(half)
            .zip(x.chunks_exact(half))
            .enumerate()
        {
            let (half, rates) = (half.as_chunks::<N>().0, rates.as_chunks::<N>().0);
            for a in 0..N {
                let row = block * N + a;
                let (mut sum, mut rate) = (0.0, 0.0);
                for (l, weight) in scheme.weights.iter().enumerate() {
                    sum += weight * half[l][a];
                    rate += weight * rates[l][a];
                }
                let start = if row == column { 1.0 } else { 0.0 };
                ends[row * columns + column] = h * sum + length * rate + start;
            }
        }
    }
}

/// The same for velocities:
///
/// ```text
/// δq₁ = δq₀ + h Σ β δν + δh Σ β ν ,     δp₁ = δp₀ + h Σ b (F_v δv + F_q δq + F_γ δγ) + δh Σ b F .
/// ```
pub(crate) fn velocity_ends<M, const N: usize>(
    equations: &VelocityForm<'_, M, N>,
    x: &[f64],
    directions: &[Direction],
    points: &[[f64; N]],
    sides: &[f64],
    ends: &mut [f64],
) where
    M: Model<N>,
{
    let (scheme, h) = (&equations.scheme, equations.span.h);
    let unknowns = scheme.unknowns();
    let columns = sides.len() / x.len();
    let width = 2 * N + directions.len();
    for (column, side) in sides.chunks_exact(x.len()).enumerate() {
        let rates = side.as_chunks::<N>().0;
        let direction = column
            .checked_sub(2 * N)
            .filter(|direction| *direction < directions.len());
        let length = direction.map_or(0.0, |direction| directions[direction].length);
        let (mut dp, mut dq) = ([0.0; N], [0.0; N]);
        for ((weight, rate), old) in scheme.advance.iter().zip(rates).zip(x.as_chunks::<N>().0) {
            for a in 0..N {
                dq[a] += weight * (h * rate[a] + length * old[a]);
            }
        }
        for (l, stored) in points.chunks_exact(width).enumerate().take(scheme.points()) {
            let (mut velocity, mut position) = ([0.0; N], [0.0; N]);
            for (j, rate) in rates.iter().enumerate() {
                let row = l * unknowns + j;
                for a in 0..N {
                    velocity[a] += scheme.velocity[row] * rate[a];
                    position[a] += h * scheme.position[row] * rate[a];
                }
            }
            if (N..2 * N).contains(&column) {
                position[column - N] += 1.0;
            }
            let (by_v, rest) = stored.split_at(N);
            let (by_q, by_direction) = rest.split_at(N);
            for a in 0..N {
                let mut force = direction.map_or(0.0, |direction| by_direction[direction][a]);
                for b in 0..N {
                    force += by_v[a][b] * velocity[b] + by_q[a][b] * position[b];
                }
                dp[a] += scheme.weights[l] * (h * force + length * equations.forces[l][a]);
            }
        }
        if column < N {
            dp[column] += 1.0;
        } else if column < 2 * N {
            dq[column - N] += 1.0;
        }
        for a in 0..N {
            ends[a * columns + column] = dp[a];
            ends[(N + a) * columns + column] = dq[a];
        }
    }
}
