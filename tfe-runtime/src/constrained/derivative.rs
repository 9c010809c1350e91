//! The linearised equations of an element with constraints: derivatives by its start, and by its time and length
//! (T-30).

use crate::condense::{Direction, System};
use crate::constrained::element::{ConstrainedForm, Derivatives};
use crate::equations::combination;
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
    mut system: System<'s>,
    ends: &mut [f64],
) -> Result<&'s [f64], StepError>
where
    M: Model<N>,
{
    let (layout, scheme) = (form.constraints.layout, form.inner.scheme);
    let columns = system.sides.len() / layout.size();
    evaluate_sides(form, x, &mut system)?;
    let end = form.end(x, true)?;
    let rate: [f64; N] = combination(scheme.advance, x[..layout.rates()].as_chunks().0);
    ends.fill(0.0);
    for (k, direction) in directions.iter().enumerate() {
        let column = 2 * N + k;
        let momentum = along(form, x, direction, |row, value| {
            system.sides[row * columns + column] = -value;
        })?;
        for a in 0..N {
            ends[a * columns + column] = momentum[a];
            ends[(N + a) * columns + column] = direction.length * rate[a];
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
                ends[(N + a) * columns + k] +=
                    form.inner.span.h * weight * sides[(u * N + a) * columns + k];
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
                momenta[a * columns + column] -= end.second.zq[a][b] * direction.length * rate[b];
            }
        }
    }
    Ok(sides)
}

/// Evaluates residual and tangent, and the right-hand sides for the start, (p₀, q₀); the others are set to zero.
fn evaluate_sides<M, const N: usize>(
    form: &mut ConstrainedForm<'_, M, N>,
    x: &[f64],
    system: &mut System<'_>,
) -> Result<(), StepError>
where
    M: Model<N>,
{
    let layout = form.constraints.layout;
    let size = layout.size();
    let columns = system.sides.len() / size;
    // The first N columns of the sides hold the derivatives by the coordinates until they are distributed.
    let derivatives = Derivatives {
        tangent: system.tangent,
        by_start: &mut system.sides[..size * N],
    };
    form.evaluate(x, system.residual, Some(derivatives))?;
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
    Ok(())
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
    let points = form.inner.scheme.points();
    let mut along = Along::new(form, x, direction)?;
    for l in 0..points {
        along.add_point(l)?;
    }
    let start_impulse = along.subtract_start_impulse();
    let momentum = along.write_end(&start_impulse)?;
    for (row, value) in along.residual.into_iter().enumerate() {
        write(row, value);
    }
    Ok(momentum)
}

/// The residual of an element while it moves along a direction.
#[cfg(feature = "alloc")]
struct Along<'f, 'a, M, const N: usize> {
    form: &'f mut ConstrainedForm<'a, M, N>,
    x: &'f [f64],
    direction: &'f Direction,
    parameter: Option<usize>,
    /// The relative change of the length of the element.
    stretch: f64,
    /// The constraints where they were evaluated last.
    rows: DualRows<N>,
    residual: Vec<f64>,
    /// The change of the impulse of all forces.
    impulse: [f64; N],
}

#[cfg(feature = "alloc")]
impl<'f, 'a, M, const N: usize> Along<'f, 'a, M, N>
where
    M: Model<N>,
{
    fn new(
        form: &'f mut ConstrainedForm<'a, M, N>,
        x: &'f [f64],
        direction: &'f Direction,
    ) -> Result<Self, StepError> {
        let parameter = match direction.parameter {
            None => None,
            Some(parameter) => {
                let found = parameter.any(form.inner.model);
                Some(found.ok_or(ConstraintError::Parameter)?)
            }
        };
        Ok(Self {
            x,
            direction,
            parameter,
            stretch: direction.length / form.inner.span.h,
            rows: DualRows::new(M::CONSTRAINTS.len()),
            residual: vec![0.0; form.constraints.layout.size()],
            impulse: [0.0; N],
            form,
        })
    }

    fn rates(&self) -> &'f [[f64; N]] {
        let rates = self.form.constraints.layout.rates();
        self.x[..rates].as_chunks().0
    }

    /// Evaluates the constraints, combined as the rows of the element are.
    fn evaluate_rows(&mut self, time: Dual, q: &[Dual; N], v: &[f64; N]) {
        let (element, model) = (&self.form.constraints.rows, self.form.inner.model);
        self.rows.evaluate_like(element, model, (time, q), v);
    }

    /// Adds the contributions of point l.
    fn add_point(&mut self, l: usize) -> Result<(), StepError> {
        let (scheme, h) = (self.form.inner.scheme, self.form.inner.span.h);
        let (points, unknowns) = (scheme.points(), scheme.unknowns());
        let (rates, node) = (self.rates(), scheme.nodes[l]);
        let (t, q, v) = self.form.inner.place(l, rates);
        let weights = &scheme.position[l * unknowns..(l + 1) * unknowns];
        let (time, q_dual) = moving(self.direction, node, t, &q, weights, rates);
        let time = time.by_parameter(self.parameter);
        let guess = self.form.inner.momenta[l];
        let (mut momentum, mut force) = explicit(self.form.inner.model, time, &q_dual, &v, &guess)?;
        for a in 0..N {
            force[a] += self.direction.damping * v[a];
        }
        self.evaluate_rows(time, &q_dual, &v);
        let slopes = legendre_slopes(node, self.form.constraints.layout.degree());
        self.add_reactions(l, &slopes, (&mut momentum, &mut force));
        for a in 0..N {
            let impulse = self.direction.length * self.form.inner.forces[l][a] + h * force[a];
            self.impulse[a] += scheme.weights[l] * impulse;
            for i in 0..unknowns {
                self.residual[i * N + a] += scheme.momentum[i * points + l] * momentum[a]
                    - scheme.force[i * points + l] * impulse;
            }
        }
        let layout = self.form.constraints.layout;
        for (c, holonomic) in self.form.constraints.active(M::CONSTRAINTS) {
            if holonomic {
                for j in 1..layout.degree() {
                    self.residual[layout.inside(j, c)] +=
                        scheme.weights[l] * slopes[j] * self.rows.value_over(c, h, self.stretch);
                }
            } else {
                self.residual[layout.inside(l, c)] = self.rows.psi_slope(c, &v);
            }
        }
        Ok(())
    }

    /// Adds the changes of the reactions at point l, at fixed multipliers.
    fn add_reactions(
        &mut self,
        l: usize,
        slopes: &[f64],
        (momentum, force): (&mut [f64; N], &mut [f64; N]),
    ) {
        for holonomic in [true, false] {
            let constraints = &mut self.form.constraints;
            constraints.set_mu(M::CONSTRAINTS, l, self.x, slopes, holonomic);
            for (c, mu) in constraints.rows.mu.iter().enumerate() {
                for a in 0..N {
                    let (row, rate) = (self.rows.rows[c][a], self.rows.rates[c][a]);
                    if holonomic {
                        force[a] -= row.slope * mu;
                    } else {
                        // μ is h times the unknown.
                        momentum[a] += (row.slope + row.value * self.stretch) * mu;
                        force[a] += (rate.slope + rate.value * self.stretch) * mu;
                    }
                }
            }
        }
    }

    /// Subtracts the change of the impulse of the constraints at the start, and returns it.
    fn subtract_start_impulse(&mut self) -> [f64; N] {
        let span = self.form.inner.span;
        let still = duals(&span.start.q, &[0.0; N]);
        let time = Dual::new(span.t, self.direction.time).by_parameter(self.parameter);
        self.evaluate_rows(time, &still, &[0.0; N]);
        let constraints = &mut self.form.constraints;
        constraints.set_node_mu(M::CONSTRAINTS, self.x, true);
        let impulse = self.rows.stretched(constraints.rows.mu, self.stretch);
        let rates = constraints.layout.rates();
        for row in self.residual[..rates].as_chunks_mut::<N>().0 {
            for a in 0..N {
                row[a] -= impulse[a];
            }
        }
        impulse
    }

    /// Writes the rows of the end of the element; returns the change of L_v there.
    fn write_end(&mut self, start_impulse: &[f64; N]) -> Result<[f64; N], StepError> {
        let (scheme, span) = (self.form.inner.scheme, self.form.inner.span);
        let (t, q, v) = self.form.constraints.end_place(self.x);
        let (time, q_dual) = moving(self.direction, 1.0, t, &q, scheme.advance, self.rates());
        let time = time.by_parameter(self.parameter);
        let (momentum, _) = explicit(self.form.inner.model, time, &q_dual, &v, &span.start.p)?;
        self.evaluate_rows(time, &q_dual, &v);
        let constraints = &mut self.form.constraints;
        constraints.set_node_mu(M::CONSTRAINTS, self.x, false);
        let reaction = self.rows.stretched(constraints.rows.mu, self.stretch);
        let layout = constraints.layout;
        for a in 0..N {
            self.residual[layout.end(a)] =
                momentum[a] + reaction[a] - start_impulse[a] - self.impulse[a];
        }
        for (c, holonomic) in constraints.active(M::CONSTRAINTS) {
            self.residual[layout.node(c)] = self.rows.psi_slope(c, &v);
            if holonomic {
                self.residual[layout.inside(0, c)] = self.rows.value_over(c, span.h, self.stretch);
            }
        }
        Ok(momentum)
    }
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
