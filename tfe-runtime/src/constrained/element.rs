//! The equations of an element with constraints (T-72, T-73): positions by the variational rows, velocities by the symmetric ones.
//!
//! ```text
//! rows     Σ_l P_il (L_v + A_Sᵀ μ)_l − h Σ_l G_il (L_q + Q + Ȧ_Sᵀ μ − A_Vᵀ μ̇)_l = p₀ + A₀,Sᵀ ν_S − A₀,Vᵀ μ₀
//! V        φ(q₁, t₁) = 0 ,   Σ_l b_l P_j′(2c_l − 1) φ(q_l, t_l) = 0 ,   j = 1 … s − 1
//! S        A v + a = 0 at the stages
//! end      L_v(v₁, q₁, t₁) + A₁,Vᵀ ν_V − A₁,Sᵀ ν_S = p*₁ ,   A₁ v₁ + a₁ = 0
//! ```
//!
//! with μ̇_l = Σ_j m_j P_j′(2c_l − 1). The equations without constraints are those of [`VelocityForm`]; constraints
//! only add to the momenta and forces at its points. Dependent holonomic rows are combined ([`Rows::combine`], T-118);
//! dependent velocity rows are replaced by μ = 0.

use crate::constrained::layout::Layout;
use crate::constrained::own::violated;
use crate::constrained::residual::relative_residual;
use crate::constrained::rows::Rows;
use crate::control::START_TOLERANCE;
use crate::equations::{Equations, Increment, Span, moved, relative, weighted};
use crate::error::{ConstraintError, StepError};
use crate::legendre::{conjugate, lagrangian_view_from};
use crate::model::{Constraint, First, Form, Model, Second, State};
use crate::scheme::{MAX_RATES, SchemeRef};
use crate::statistics::Statistics;
use crate::velocity_form::{PointDerivatives, PointTangent, VelocityForm};

pub(crate) struct ConstrainedForm<'a, M, const N: usize> {
    /// The element without constraints; its `momenta` become L_v at the points, its `forces` all forces there.
    pub(crate) inner: VelocityForm<'a, M, N>,
    pub(crate) constraints: ElementConstraints<'a, N>,
    /// The contribution of impulses to the momentum at the end.
    pub(crate) impulse: [f64; N],
}

/// The constraints as they are declared.
pub(super) type Declared = &'static [Constraint];

/// The contributions of constraints to an element. The constraints are passed as declared, not through the type of the
/// model, so that this code is compiled once for a number of coordinates.
pub(crate) struct ElementConstraints<'a, const N: usize> {
    pub(super) scheme: SchemeRef<'a>,
    /// The length of the element.
    pub(super) h: f64,
    pub(crate) layout: Layout,
    pub(crate) rows: Rows<'a, N>,
    /// One for each constraint that is in use.
    pub(crate) active: &'a [usize],
}

/// The end of the element as it follows from the unknowns.
pub(crate) struct End<const N: usize> {
    pub(crate) t: f64,
    pub(crate) q: [f64; N],
    pub(crate) v: [f64; N],
    pub(crate) p: [f64; N],
    pub(crate) second: Second<f64, N>,
}

/// The memory for the derivatives of the residual.
pub(crate) struct Derivatives<'a> {
    /// By the unknowns.
    pub(crate) tangent: &'a mut [f64],
    /// By the coordinates at the start, N columns; empty if they are not requested.
    pub(crate) by_start: &'a mut [f64],
}

/// P_j′(2c − 1), j = 0 … s − 1.
pub(crate) fn slopes(node: f64, degree: usize) -> [f64; MAX_RATES] {
    let x = 2.0 * node - 1.0;
    let (mut values, mut slopes) = ([1.0, x], [0.0; MAX_RATES]);
    for j in 1..degree.min(MAX_RATES) {
        let before = if j >= 2 { slopes[j - 2] } else { 0.0 };
        slopes[j] = before + (2 * j - 1) as f64 * values[0];
        let next = ((2 * j + 1) as f64 * x * values[1] - j as f64 * values[0]) / (j + 1) as f64;
        values = [values[1], next];
    }
    slopes
}

impl<const N: usize> ElementConstraints<'_, N> {
    /// The constraints in use, with their kinds: true for holonomic ones.
    pub(crate) fn active(
        &self,
        declared: Declared,
    ) -> impl Iterator<Item = (usize, bool)> + use<'_, N> {
        let marked = declared.iter().zip(self.active).enumerate();
        marked
            .filter(|(_, (_, active))| **active != 0)
            .map(|(c, (constraint, _))| (c, constraint.kind.is_holonomic()))
    }

    fn has(&self, declared: Declared, holonomic: bool) -> bool {
        self.active(declared).any(|(_, kind)| kind == holonomic)
    }

    /// Sets the multipliers at a point for one kind of constraint, and the others to zero.
    #[inline]
    pub(crate) fn set_mu(
        &mut self,
        declared: Declared,
        l: usize,
        x: &[f64],
        slopes: &[f64],
        holonomic: bool,
    ) {
        self.rows.mu.fill(0.0);
        for (c, constraint) in declared.iter().enumerate() {
            if self.active[c] == 0 || constraint.kind.is_holonomic() != holonomic {
                continue;
            }
            self.rows.mu[c] = if holonomic {
                let coefficients = (1..self.layout.degree()).map(|j| x[self.layout.inside(j, c)]);
                coefficients.zip(&slopes[1..]).map(|(m, p)| m * p).sum()
            } else {
                self.h * x[self.layout.inside(l, c)]
            };
        }
    }

    /// Sets the multipliers of the node at the end, or those that change the momentum at the start.
    #[inline]
    pub(crate) fn set_node_mu(&mut self, declared: Declared, x: &[f64], at_start: bool) {
        let h = self.h;
        for (c, constraint) in declared.iter().enumerate() {
            let node = h * x[self.layout.node(c)];
            self.rows.mu[c] = match (
                self.active[c] != 0,
                constraint.kind.is_holonomic(),
                at_start,
            ) {
                (false, _, _) => 0.0,
                (true, true, true) => -h * x[self.layout.inside(0, c)],
                (true, true, false) | (true, false, true) => node,
                (true, false, false) => -node,
            };
        }
    }

    /// The equations of constraints that are not in use: their multipliers are zero.
    fn hold_dependent(
        &self,
        x: &[f64],
        residual: &mut [f64],
        mut derivatives: Option<Derivatives<'_>>,
    ) {
        let size = self.layout.size();
        for (c, _) in self
            .active
            .iter()
            .enumerate()
            .filter(|(_, mark)| **mark == 0)
        {
            let inside = (0..self.layout.degree()).map(|j| self.layout.inside(j, c));
            for at in inside.chain([self.layout.node(c)]) {
                residual[at] = x[at];
                if let Some(derivatives) = &mut derivatives {
                    derivatives.tangent[at * size + at] = 1.0;
                }
            }
        }
    }
}

impl<'a, M, const N: usize> ConstrainedForm<'a, M, N>
where
    M: Model<N>,
{
    /// An element with the constraints that `active` marks.
    pub(crate) fn new(
        inner: VelocityForm<'a, M, N>,
        layout: Layout,
        rows: Rows<'a, N>,
        active: &'a [usize],
        impulse: [f64; N],
    ) -> Self {
        let constraints = ElementConstraints {
            scheme: inner.scheme,
            h: inner.span.h,
            layout,
            rows,
            active,
        };
        Self {
            inner,
            constraints,
            impulse,
        }
    }

    /// Time, coordinates and velocity at the end.
    pub(crate) fn end_place(&self, x: &[f64]) -> (f64, [f64; N], [f64; N]) {
        let span = &self.inner.span;
        let scheme = &self.inner.scheme;
        let rates = x[..self.constraints.layout.rates()].as_chunks::<N>().0;
        let rate = weighted(scheme.advance, scheme.advance_low, rates);
        let q = moved(&span.start.q, &span.low.q, span.h, &rate);
        let mut v = [0.0; N];
        v.copy_from_slice(&x[self.constraints.layout.end(0)..self.constraints.layout.node(0)]);
        (span.t + span.h, q, v)
    }

    /// L_v at the end, and on request second derivatives.
    pub(crate) fn end(&self, x: &[f64], with_second: bool) -> Result<End<N>, StepError> {
        let (t, q, v) = self.end_place(x);
        let model = self.inner.model;
        let guess = &self.inner.span.start.p;
        let mut second = Second::ZERO;
        let p = match (M::FORM, with_second) {
            (Form::Lagrangian, false) => {
                let mut first = First::ZERO;
                model.first(t, &q, &v, &mut first);
                first.z
            }
            (Form::Lagrangian, true) => {
                let mut first = First::ZERO;
                model.second(t, &q, &v, &mut first, &mut second);
                first.z
            }
            (Form::Hamiltonian, false) => conjugate(model, t, &q, &v, guess)?,
            (Form::Hamiltonian, true) => {
                let view = lagrangian_view_from(model, t, &q, &v, guess)?;
                second = view.second;
                view.p
            }
        };
        Ok(End { t, q, v, p, second })
    }

    /// The state at the end and its rounding error.
    pub(crate) fn end_state(&self, x: &[f64]) -> Result<(State<N>, State<N>), StepError> {
        let end = self.end(x, false)?;
        let span = &self.inner.span;
        let rates = x[..self.constraints.layout.rates()].as_chunks::<N>().0;
        let rate = weighted(
            self.inner.scheme.advance,
            self.inner.scheme.advance_low,
            rates,
        );
        let mut low = State::ZERO;
        for a in 0..N {
            let increment = span.h * rate[a] + span.low.q[a];
            let part = end.q[a] - span.start.q[a];
            low.q[a] = (span.start.q[a] - (end.q[a] - part)) + (increment - part);
        }
        Ok((State { q: end.q, p: end.p }, low))
    }

    /// Checks that all constraints hold at the end, including those that were omitted as dependent. These are not
    /// solved for, so that they are also compared with the size of their own terms.
    pub(crate) fn check_end(&mut self, x: &[f64], tolerance: f64) -> Result<(), StepError> {
        let (t, q, v) = self.end_place(x);
        self.constraints
            .rows
            .evaluate_declared(self.inner.model, t, &q);
        let (rows, h) = (&self.constraints.rows, self.inner.span.h);
        let refused = |c: usize, residual: f64| {
            Err(ConstraintError::Dependent {
                constraint: M::CONSTRAINTS[c].name,
                residual,
            }
            .into())
        };
        for c in 0..M::CONSTRAINTS.len() {
            let (position, velocity) = relative_residual(rows, c, &q, &v, h);
            for residual in [position, velocity] {
                if !(residual <= START_TOLERANCE) {
                    return refused(c, residual);
                }
            }
        }
        if self.constraints.active.iter().all(|mark| *mark == 1) {
            return Ok(());
        }
        match violated(self.inner.model, t, (&q, &v), (h, tolerance), Some(rows)) {
            Some((c, _, residual)) => refused(c, residual),
            None => Ok(()),
        }
    }

    /// The residual at x, and on request its derivative.
    pub(crate) fn evaluate(
        &mut self,
        x: &[f64],
        residual: &mut [f64],
        mut derivatives: Option<Derivatives<'_>>,
    ) -> Result<(), StepError> {
        let layout = self.constraints.layout;
        let (scheme, h) = (self.inner.scheme, self.inner.span.h);
        let (points, unknowns) = (scheme.points(), scheme.unknowns());
        let rates = x[..layout.rates()].as_chunks::<N>().0;
        let velocities = self.constraints.has(M::CONSTRAINTS, false);
        let positions = self.constraints.has(M::CONSTRAINTS, true) && layout.degree() > 1;
        residual.fill(0.0);
        if let Some(derivatives) = &mut derivatives {
            derivatives.tangent.fill(0.0);
            derivatives.by_start.fill(0.0);
        }
        let mut point = PointDerivatives::ZERO;
        for l in 0..points {
            let (t, q, v) = self.inner.place(l, rates);
            if derivatives.is_some() {
                self.inner.derivatives(l, rates, &mut point)?;
            } else {
                self.inner.values(l, rates, &mut point)?;
            }
            self.inner.momenta[l] = point.p;
            let mut by = PointTangent::of(h, &point.second);
            self.constraints.rows.evaluate(self.inner.model, t, &q);
            let slopes = slopes(scheme.nodes[l], layout.degree());
            if velocities {
                self.constraints
                    .set_mu(M::CONSTRAINTS, l, x, &slopes, false);
                let bend = self
                    .constraints
                    .rows
                    .differentiate(self.inner.model, t, &q, &v);
                let momentum = transposed(self.constraints.rows.rows, self.constraints.rows.mu);
                let force = transposed(self.constraints.rows.rates, self.constraints.rows.mu);
                for a in 0..N {
                    point.p[a] += momentum[a];
                    point.force[a] += force[a];
                    for b in 0..N {
                        by.momentum_q[a][b] += h * bend.bend[a][b];
                        by.force_q[a][b] += h * bend.rate_q[a][b];
                        by.force_v[a][b] += bend.rate_v[a][b];
                    }
                }
            }
            if positions {
                self.constraints.set_mu(M::CONSTRAINTS, l, x, &slopes, true);
                let force = transposed(self.constraints.rows.rows, self.constraints.rows.mu);
                for a in 0..N {
                    point.force[a] -= force[a];
                }
                if derivatives.is_some() {
                    let bend = self
                        .constraints
                        .rows
                        .differentiate(self.inner.model, t, &q, &v);
                    for a in 0..N {
                        for b in 0..N {
                            by.force_q[a][b] -= h * bend.bend[a][b];
                        }
                    }
                }
            }
            self.inner.forces[l] = point.force;
            for i in 0..unknowns {
                let weight = scheme.momentum[i * points + l];
                for a in 0..N {
                    residual[i * N + a] += weight * point.p[a];
                }
            }
            for (c, holonomic) in self.constraints.active(M::CONSTRAINTS) {
                if holonomic {
                    for j in 1..layout.degree() {
                        residual[layout.inside(j, c)] +=
                            scheme.weights[l] * slopes[j] * self.constraints.rows.values[c] / h;
                    }
                } else {
                    residual[layout.inside(l, c)] = self.constraints.rows.psi(c, &v);
                }
            }
            if let Some(Derivatives { tangent, by_start }) = &mut derivatives {
                self.constraints.add_element(l, &by, tangent);
                self.constraints
                    .add_point(M::CONSTRAINTS, l, &slopes, tangent);
                if !by_start.is_empty() {
                    self.constraints
                        .add_start(M::CONSTRAINTS, l, &by, &slopes, by_start);
                }
            }
        }
        let rows = residual[..layout.rates()].as_chunks_mut::<N>().0;
        self.inner.subtract_impulse(rows);
        self.constraints.set_node_mu(M::CONSTRAINTS, x, true);
        let kick = transposed(self.constraints.rows.start, self.constraints.rows.mu);
        for row in rows {
            for a in 0..N {
                row[a] -= kick[a];
            }
        }
        if let Some(Derivatives { by_start, .. }) = &mut derivatives
            && !by_start.is_empty()
        {
            let Span { t, start, .. } = self.inner.span;
            let bend =
                self.constraints
                    .rows
                    .differentiate(self.inner.model, t, &start.q, &[0.0; N]);
            for row in (0..unknowns * N).chain(layout.end(0)..layout.node(0)) {
                let a = if row < layout.rates() {
                    row % N
                } else {
                    row - layout.end(0)
                };
                for b in 0..N {
                    by_start[row * N + b] -= bend.bend[a][b];
                }
            }
        }
        let end = self.end(x, derivatives.is_some())?;
        self.constraints
            .rows
            .evaluate(self.inner.model, end.t, &end.q);
        self.constraints.set_node_mu(M::CONSTRAINTS, x, false);
        let reaction = transposed(self.constraints.rows.rows, self.constraints.rows.mu);
        let force = weighted(scheme.weights, scheme.weights_low, self.inner.forces);
        let span = &self.inner.span;
        for a in 0..N {
            let impulse = h * force[a] + (span.low.p[a] + self.impulse[a] + kick[a]);
            residual[layout.end(a)] = (end.p[a] - span.start.p[a]) + (reaction[a] - impulse);
        }
        for (c, holonomic) in self.constraints.active(M::CONSTRAINTS) {
            residual[layout.node(c)] = self.constraints.rows.psi(c, &end.v);
            if holonomic {
                residual[layout.inside(0, c)] = self.constraints.rows.values[c] / h;
            }
        }
        if let Some(Derivatives { tangent, by_start }) = &mut derivatives {
            let bend = self
                .constraints
                .rows
                .differentiate(self.inner.model, end.t, &end.q, &end.v);
            self.constraints
                .add_ends(M::CONSTRAINTS, &end, &bend, tangent);
            if !by_start.is_empty() {
                self.constraints
                    .add_end_by_start(M::CONSTRAINTS, &end, &bend, by_start);
            }
        }
        self.constraints.hold_dependent(x, residual, derivatives);
        self.inner.statistics.residual_evaluations += 1;
        Ok(())
    }
}

impl<M, const N: usize> Equations for ConstrainedForm<'_, M, N>
where
    M: Model<N>,
{
    fn is_by_newton_alone(&self) -> bool {
        true
    }

    fn sweep(&mut self, _: &[f64], _: &mut [f64], _: bool) -> Result<(), StepError> {
        Err(ConstraintError::NeedsNewton.into())
    }

    fn residual(&mut self, x: &[f64], residual: &mut [f64]) -> Result<(), StepError> {
        self.evaluate(x, residual, None)
    }

    fn tangent(
        &mut self,
        x: &[f64],
        residual: &mut [f64],
        tangent: &mut [f64],
    ) -> Result<(), StepError> {
        let by_start = &mut [];
        self.evaluate(x, residual, Some(Derivatives { tangent, by_start }))
    }

    fn measure(&self, x: &[f64], step: &[f64]) -> Increment {
        let (rates, end) = (
            self.constraints.layout.rates(),
            self.constraints.layout.end(0)..self.constraints.layout.node(0),
        );
        let inner = self.inner.measure(&x[..rates], &step[..rates]);
        let end = 0.25 * relative(1.0, &[], &x[end.clone()], &step[end]);
        // `f64::max` would ignore a NaN.
        let relative = if end > inner.relative || end.is_nan() {
            end
        } else {
            inner.relative
        };
        Increment { relative, ..inner }
    }

    fn finish(&mut self, _: &[f64], _: &mut [f64]) -> Result<(), StepError> {
        // The end is a function of the unknowns alone.
        Ok(())
    }

    fn statistics(&mut self) -> &mut Statistics {
        self.inner.statistics
    }
}

/// Σ rows_c μ_c
fn transposed<const N: usize>(rows: &[[f64; N]], mu: &[f64]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (row, mu) in rows.iter().zip(mu) {
        if *mu != 0.0 {
            for a in 0..N {
                sum[a] += row[a] * mu;
            }
        }
    }
    sum
}
