//! The linearised equations of an element with constraints: derivatives by its start, and by its time and length
//! (T-30).

use crate::condense::{Direction, System};
use crate::constrained::element::{ConstrainedForm, Derivatives};
#[cfg(feature = "alloc")]
use crate::error::ConstraintError;
use crate::error::StepError;
use crate::model::Model;
#[cfg(feature = "alloc")]
use crate::{
    basis::legendre_slopes,
    constrained::rows::Rows,
    dual::{Dual, duals},
    legendre::conjugate,
    lu::Block,
    model::{ConstraintSecond, First},
};
#[cfg(feature = "alloc")]
use alloc::{vec, vec::Vec};

/// Solves for the interior as a linear function of the start and of the directions, and writes the derivatives of the
/// end: 2N rows with the columns of the right-hand sides, ordered (p, q). With `newton_step` the last column is the
/// Newton step of the interior itself. Returns the solved sides.
pub(crate) fn linearise<'s, M, const N: usize>(
    form: &mut ConstrainedForm<'_, M, N>,
    x: &[f64],
    directions: &[Direction],
    newton_step: bool,
    system: System<'s>,
    ends: &mut [f64],
) -> Result<&'s [f64], StepError>
where
    M: Model<N>,
{
    let layout = form.constraints.layout;
    let size = layout.size();
    let columns = system.sides.len() / size;
    // The first N columns of the sides hold the derivatives by the coordinates until they are distributed.
    let (by_start, _) = system.sides.split_at_mut(size * N);
    form.evaluate(
        x,
        system.residual,
        Some(Derivatives {
            tangent: system.tangent,
            by_start,
        }),
    )?;
    for row in (0..size).rev() {
        let mut by_start = [0.0; N];
        by_start.copy_from_slice(&system.sides[row * N..(row + 1) * N]);
        let side = &mut system.sides[row * columns..(row + 1) * columns];
        side.fill(0.0);
        for b in 0..N {
            side[N + b] = -by_start[b];
        }
    }
    for a in 0..N {
        for i in 0..form.inner.scheme.unknowns() {
            system.sides[(i * N + a) * columns + a] = 1.0;
        }
        system.sides[layout.end(a) * columns + a] = 1.0;
    }
    let end = form.end(x, true)?;
    let scheme = form.inner.scheme;
    let h = form.inner.span.h;
    let rates = x[..layout.rates()].as_chunks::<N>().0;
    ends.fill(0.0);
    for (k, direction) in directions.iter().enumerate() {
        let column = 2 * N + k;
        let momentum = along(form, x, direction, |row, value| {
            system.sides[row * columns + column] = -value;
        })?;
        for a in 0..N {
            ends[a * columns + column] = momentum[a];
            let mut rate = 0.0;
            for (weight, row) in scheme.advance.iter().zip(rates) {
                rate += weight * row[a];
            }
            ends[(N + a) * columns + column] = direction.length * rate;
        }
    }
    if newton_step {
        for (row, residual) in system.residual.iter().enumerate() {
            system.sides[(row + 1) * columns - 1] = -residual;
        }
    }
    let factored = system.solve_by(|tangent, pivots| layout.factor(tangent, pivots))?;
    let sides = &*factored.sides;
    for a in 0..N {
        for (u, weight) in scheme.advance.iter().enumerate() {
            for k in 0..columns {
                ends[(N + a) * columns + k] += h * weight * sides[(u * N + a) * columns + k];
            }
        }
        ends[(N + a) * columns + N + a] += 1.0;
    }
    // δp₁ = L_vv δv₁ + L_vq δq₁ + the direct effect of the directions at fixed unknowns, which already contains δq₁ of
    // the directions.
    let (momenta, coordinates) = ends.split_at_mut(N * columns);
    for a in 0..N {
        for b in 0..N {
            let (mass, mixed) = (end.second.zz[a][b], end.second.zq[a][b]);
            let velocity = &sides[layout.end(b) * columns..][..columns];
            for k in 0..columns {
                momenta[a * columns + k] +=
                    mass * velocity[k] + mixed * coordinates[b * columns + k];
            }
        }
    }
    for (k, direction) in directions.iter().enumerate() {
        let column = 2 * N + k;
        for a in 0..N {
            for b in 0..N {
                let mut rate = 0.0;
                for (weight, row) in scheme.advance.iter().zip(rates) {
                    rate += weight * row[b];
                }
                momenta[a * columns + column] -= end.second.zq[a][b] * direction.length * rate;
            }
        }
    }
    Ok(sides)
}

#[cfg(not(feature = "alloc"))]
fn along<M, const N: usize>(
    _: &mut ConstrainedForm<'_, M, N>,
    _: &[f64],
    _: &Direction,
    _: impl FnMut(usize, f64),
) -> Result<[f64; N], StepError>
where
    M: Model<N>,
{
    // Assembled problems need an allocator.
    Err(StepError::NonFinite)
}

/// The derivative of the residual along a direction at fixed unknowns and a fixed start, row by row, and that of the
/// momentum at the end.
#[cfg(feature = "alloc")]
fn along<M, const N: usize>(
    form: &mut ConstrainedForm<'_, M, N>,
    x: &[f64],
    direction: &Direction,
    mut write: impl FnMut(usize, f64),
) -> Result<[f64; N], StepError>
where
    M: Model<N>,
{
    let layout = form.constraints.layout;
    let (scheme, h) = (form.inner.scheme, form.inner.span.h);
    let (points, unknowns) = (scheme.points(), scheme.unknowns());
    let parameter = match direction.parameter {
        None => None,
        Some(parameter) => {
            let found = parameter.any(form.inner.model);
            Some(found.ok_or(ConstraintError::Parameter)?)
        }
    };
    let rates = x[..layout.rates()].as_chunks::<N>().0;
    let stretch = direction.length / h;
    let mut rows = DualRows::<N>::new(M::CONSTRAINTS.len());
    let mut residual = vec![0.0; layout.size()];
    let mut end_force = [0.0; N];
    for l in 0..points {
        let (t, q, v) = form.inner.place(l, rates);
        let node = scheme.nodes[l];
        let weights = &scheme.position[l * unknowns..(l + 1) * unknowns];
        let (time, q_dual) = moving(direction, node, t, &q, weights, rates);
        let time = time.by_parameter(parameter);
        let guess = form.inner.momenta[l];
        let (mut momentum, mut force) = explicit(form.inner.model, time, &q_dual, &v, &guess)?;
        for a in 0..N {
            force[a] += direction.damping * v[a];
        }
        rows.evaluate_like(
            &form.constraints.rows,
            form.inner.model,
            (time, &q_dual),
            &v,
        );
        let slopes = legendre_slopes(node, layout.degree());
        for holonomic in [true, false] {
            form.constraints
                .set_mu(M::CONSTRAINTS, l, x, &slopes, holonomic);
            for (c, mu) in form.constraints.rows.mu.iter().enumerate() {
                for a in 0..N {
                    let (row, rate) = (rows.rows[c][a], rows.rates[c][a]);
                    if holonomic {
                        force[a] -= row.slope * mu;
                    } else {
                        // μ is h times the unknown.
                        momentum[a] += (row.slope + row.value * stretch) * mu;
                        force[a] += (rate.slope + rate.value * stretch) * mu;
                    }
                }
            }
        }
        for a in 0..N {
            let impulse = direction.length * form.inner.forces[l][a] + h * force[a];
            end_force[a] += scheme.weights[l] * impulse;
            for i in 0..unknowns {
                residual[i * N + a] += scheme.momentum[i * points + l] * momentum[a]
                    - scheme.force[i * points + l] * impulse;
            }
        }
        for (c, holonomic) in form.constraints.active(M::CONSTRAINTS) {
            if holonomic {
                for j in 1..layout.degree() {
                    residual[layout.inside(j, c)] +=
                        scheme.weights[l] * slopes[j] * rows.value_over(c, h, stretch);
                }
            } else {
                residual[layout.inside(l, c)] = rows.psi_slope(c, &v);
            }
        }
    }
    let span = form.inner.span;
    let still = duals(&span.start.q, &[0.0; N]);
    let start = Dual::new(span.t, direction.time).by_parameter(parameter);
    rows.evaluate_like(
        &form.constraints.rows,
        form.inner.model,
        (start, &still),
        &[0.0; N],
    );
    form.constraints.set_node_mu(M::CONSTRAINTS, x, true);
    let kick = rows.stretched(form.constraints.rows.mu, stretch);
    for row in residual[..layout.rates()].as_chunks_mut::<N>().0 {
        for a in 0..N {
            row[a] -= kick[a];
        }
    }
    let (t, q, v) = form.constraints.end_place(x);
    let (time, q_dual) = moving(direction, 1.0, t, &q, scheme.advance, rates);
    let time = time.by_parameter(parameter);
    let (momentum, _) = explicit(form.inner.model, time, &q_dual, &v, &span.start.p)?;
    rows.evaluate_like(
        &form.constraints.rows,
        form.inner.model,
        (time, &q_dual),
        &v,
    );
    form.constraints.set_node_mu(M::CONSTRAINTS, x, false);
    let reaction = rows.stretched(form.constraints.rows.mu, stretch);
    for a in 0..N {
        residual[layout.end(a)] = momentum[a] + reaction[a] - kick[a] - end_force[a];
    }
    for (c, holonomic) in form.constraints.active(M::CONSTRAINTS) {
        residual[layout.node(c)] = rows.psi_slope(c, &v);
        if holonomic {
            residual[layout.inside(0, c)] = rows.value_over(c, h, stretch);
        }
    }
    for (row, value) in residual.into_iter().enumerate() {
        write(row, value);
    }
    Ok(momentum)
}

/// A point of the element as a dual number: it moves in time, and in space because the element is stretched.
#[cfg(feature = "alloc")]
fn moving<const N: usize>(
    direction: &Direction,
    node: f64,
    t: f64,
    q: &[f64; N],
    weights: &[f64],
    rates: &[[f64; N]],
) -> (Dual, [Dual; N]) {
    let mut slope = [0.0; N];
    for (weight, rate) in weights.iter().zip(rates) {
        for a in 0..N {
            slope[a] += direction.length * weight * rate[a];
        }
    }
    let time = Dual::new(t, direction.time + node * direction.length);
    (time, duals(q, &slope))
}

/// The derivatives of L_v and L_q + Q along moving time and coordinates, at fixed velocities.
#[cfg(feature = "alloc")]
pub(crate) fn explicit<M, const N: usize>(
    model: &M,
    t: Dual,
    q: &[Dual; N],
    v: &[f64; N],
    guess: &[f64; N],
) -> Result<([f64; N], [f64; N]), StepError>
where
    M: Model<N>,
{
    let mut first = First::zero();
    let (mut momentum, mut force) = ([0.0; N], [0.0; N]);
    if const { M::FORM.is_lagrangian() } {
        model.first(t, q, &duals(v, &[0.0; N]), &mut first);
        for a in 0..N {
            momentum[a] = first.z[a].slope;
            force[a] = first.q[a].slope + first.force[a].slope;
        }
    } else {
        // At constant v the momentum moves: H_pp δp = −δH_p.
        let mut place = [0.0; N];
        for a in 0..N {
            place[a] = q[a].value;
        }
        let p = conjugate(model, t.value, &place, v, guess)?;
        model.first(t, q, &duals(&p, &[0.0; N]), &mut first);
        let (mut plain, mut zz) = (First::ZERO, [[0.0; N]; N]);
        model.first_and_mass(t.value, &place, &p, &mut plain, &mut zz);
        for a in 0..N {
            momentum[a] = -first.z[a].slope;
        }
        let block = Block::of(&zz).map_err(|singular| {
            StepError::Legendre(crate::error::LegendreError::Singular {
                coordinate: singular.column,
            })
        })?;
        block.solve(&mut momentum);
        let mut first = First::zero();
        model.first(t, q, &duals(&p, &momentum), &mut first);
        for a in 0..N {
            force[a] = first.force[a].slope - first.q[a].slope;
        }
    }
    Ok((momentum, force))
}

/// The constraints at a moving point.
#[cfg(feature = "alloc")]
pub(crate) struct DualRows<const N: usize> {
    rows: Vec<[Dual; N]>,
    rates: Vec<[Dual; N]>,
    psi_q: Vec<[Dual; N]>,
    drift: Vec<Dual>,
    values: Vec<Dual>,
    mu: Vec<Dual>,
}

#[cfg(feature = "alloc")]
impl<const N: usize> DualRows<N> {
    pub(crate) fn new(count: usize) -> Self {
        let matrix = vec![[Dual::ZERO; N]; count];
        let vector = vec![Dual::ZERO; count];
        Self {
            rows: matrix.clone(),
            rates: matrix.clone(),
            psi_q: matrix,
            drift: vector.clone(),
            values: vector.clone(),
            mu: vector,
        }
    }

    pub(crate) fn evaluate<M: Model<N>>(
        &mut self,
        model: &M,
        t: Dual,
        q: &[Dual; N],
        v: &[f64; N],
    ) {
        model.constraint_rows(t, q, &mut self.rows, &mut self.drift);
        model.constraint_values(t, q, &mut self.values);
        let zero = [[Dual::ZERO; N]; N];
        let mut second = ConstraintSecond {
            psi_q: &mut self.psi_q,
            row_rates: &mut self.rates,
            bend: zero,
            rate_q: zero,
            rate_v: zero,
        };
        model.constraint_second(t, q, &duals(v, &[0.0; N]), &self.mu, &mut second);
    }

    /// The same, combined as the rows of an element are.
    fn evaluate_like<M: Model<N>>(
        &mut self,
        element: &Rows<'_, N>,
        model: &M,
        (t, q): (Dual, &[Dual; N]),
        v: &[f64; N],
    ) {
        let Some(weights) = element.combination() else {
            return self.evaluate(model, t, q, v);
        };
        // Kernels write only what can be non-zero.
        for matrix in [&mut self.rows, &mut self.rates, &mut self.psi_q] {
            matrix.fill([Dual::ZERO; N]);
        }
        self.drift.fill(Dual::ZERO);
        self.values.fill(Dual::ZERO);
        self.evaluate(model, t, q, v);
        let count = self.values.len();
        for matrix in [&mut self.rows, &mut self.rates, &mut self.psi_q] {
            let declared = matrix.clone();
            for (row, weights) in matrix.iter_mut().zip(weights.chunks_exact(count)) {
                *row = core::array::from_fn(|a| combined(weights, declared.iter().map(|r| r[a])));
            }
        }
        for numbers in [&mut self.drift, &mut self.values] {
            let declared = numbers.clone();
            for (number, weights) in numbers.iter_mut().zip(weights.chunks_exact(count)) {
                *number = combined(weights, declared.iter().copied());
            }
        }
    }

    /// d(A v + a), v constant.
    pub(crate) fn psi_slope(&self, c: usize, v: &[f64; N]) -> f64 {
        let mut sum = self.drift[c].slope;
        for a in 0..N {
            sum += self.rows[c][a].slope * v[a];
        }
        sum
    }

    /// dA, one row of it.
    pub(crate) fn row_slope(&self, c: usize) -> [f64; N] {
        core::array::from_fn(|a| self.rows[c][a].slope)
    }

    /// d(φ / h)
    fn value_over(&self, c: usize, h: f64, stretch: f64) -> f64 {
        (self.values[c].slope - self.values[c].value * stretch) / h
    }

    /// d(Aᵀμ), where μ is h times unknowns.
    fn stretched(&self, mu: &[f64], stretch: f64) -> [f64; N] {
        let mut sum = [0.0; N];
        for (row, mu) in self.rows.iter().zip(mu) {
            for a in 0..N {
                sum[a] += (row[a].slope + row[a].value * stretch) * mu;
            }
        }
        sum
    }
}

/// Σ weight · number
#[cfg(feature = "alloc")]
fn combined(weights: &[f64], numbers: impl Iterator<Item = Dual>) -> Dual {
    weights
        .iter()
        .zip(numbers)
        .fold(Dual::ZERO, |sum, (weight, number)| {
            sum + Dual::new(*weight, 0.0) * number
        })
}
