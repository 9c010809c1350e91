//! The equations of an element with constraints (T-72, T-73, T-80): positions by the variational rows, velocities by
//! the symmetric ones.
//!
//! ```text
//! rows     Σ_l P_il (L_v + A_Sᵀ μ)_l − h Σ_l G_il (L_q + Q + Ȧ_Sᵀ μ − A_Vᵀ μ̇)_l = p₀ + A₀,Sᵀ η_S − A₀,Vᵀ μ₀
//! V        φ(q₁, t₁) = 0 ,   Σ_l b_l P_j′(2c_l − 1) φ(q_l, t_l) = 0 ,   j = 1 … s − 1
//! S        A v + a = 0 at the stages
//! end      L_v(v₁, q₁, t₁) + A₁,Vᵀ η_V − A₁,Sᵀ η_S = p*₁ ,   A₁ v₁ + a₁ = 0
//! ```
//!
//! with μ̇_l = Σ_j m_j P_j′(2c_l − 1). The equations without constraints are those of [`VelocityForm`]; constraints
//! only add to the momenta and forces at its points. Dependent holonomic rows are combined ([`Rows::combine`], T-118);
//! dependent velocity rows are replaced by μ = 0.

use crate::constrained::constrains::Constrains;
use crate::constrained::layout::Layout;
use crate::constrained::own::violated;
#[cfg(feature = "alloc")]
use crate::constrained::reach::{diagonal, sparse, speeds};
use crate::constrained::residual::relative_residual;
use crate::constrained::rows::Rows;
use crate::control::{POSITION_ROUND_OFF, START_TOLERANCE};
use crate::equations::{Equations, Increment, Span, moved, relative, weighted};
use crate::error::{ConstraintError, StepError};
use crate::legendre::{conjugate, lagrangian_view_from, largest};
use crate::lu;
use crate::model::{Constraint, First, Model, Second, State};
use crate::scheme::SchemeRef;
use crate::statistics::Statistics;
use crate::unlike::{by_coordinate, own_increment, raise};
use crate::velocity_form::{PointDerivatives, VelocityForm};
#[cfg(feature = "alloc")]
use {crate::control::ROUGH_ROUND_OFF, alloc::vec::Vec};

pub(crate) struct ConstrainedForm<'a, M, const N: usize> {
    /// The element without constraints; its `momenta` become L_v at the points, its `forces` all forces there.
    pub(crate) inner: VelocityForm<'a, M, N>,
    pub(crate) constraints: ElementConstraints<'a, N>,
}

/// The constraints as they are declared.
pub(super) type Declared = &'static [Constraint];

/// The contributions of constraints to an element. The constraints are passed as declared, not through the type of the
/// model, so that this code is compiled once for a number of coordinates.
pub(crate) struct ElementConstraints<'a, const N: usize> {
    pub(super) scheme: SchemeRef<'a>,
    pub(super) span: Span<'a, N>,
    pub(crate) layout: Layout,
    pub(crate) rows: Rows<'a, N>,
    /// One for each constraint that is in use.
    pub(crate) active: &'a [usize],
    /// The contribution of impulses to the momentum at the end.
    pub(super) impulse: [f64; N],
    /// Whether constraints on velocities act at the points.
    pub(super) on_velocities: bool,
    /// Whether holonomic constraints act at the points.
    pub(super) on_positions: bool,
}

/// Whether the violation of a constraint, by positions and velocities at a time, is a rounding error.
pub(crate) type IsRounding<'a, const N: usize> =
    dyn Fn((&Rows<'_, N>, usize), f64, (&[f64; N], &[f64; N])) -> bool + 'a;

/// A point of the element.
pub(super) struct Place<const N: usize> {
    pub(super) l: usize,
    pub(super) t: f64,
    pub(super) q: [f64; N],
    pub(super) v: [f64; N],
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

/// The residual and, on request, its derivatives.
pub(super) struct Output<'a> {
    pub(super) residual: &'a mut [f64],
    pub(super) derivatives: Option<Derivatives<'a>>,
}

impl Output<'_> {
    fn clear(&mut self) {
        self.residual.fill(0.0);
        if let Some(derivatives) = &mut self.derivatives {
            derivatives.tangent.fill(0.0);
            derivatives.by_start.fill(0.0);
        }
    }
}

impl<'a, const N: usize> ElementConstraints<'a, N> {
    /// With the constraints that `active` marks.
    fn new(
        declared: Declared,
        (scheme, span): (SchemeRef<'a>, Span<'a, N>),
        layout: Layout,
        rows: Rows<'a, N>,
        active: &'a [usize],
        impulse: [f64; N],
    ) -> Self {
        let mut constraints = Self {
            scheme,
            span,
            layout,
            rows,
            active,
            impulse,
            on_velocities: false,
            on_positions: false,
        };
        constraints.on_velocities = constraints.has(declared, false);
        constraints.on_positions = constraints.has(declared, true) && layout.degree() > 1;
        constraints
    }
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
                self.span.h * x[self.layout.inside(l, c)]
            };
        }
    }

    /// Sets the multipliers of the node at the end, or those that change the momentum at the start.
    #[inline]
    pub(crate) fn set_node_mu(&mut self, declared: Declared, x: &[f64], at_start: bool) {
        let h = self.span.h;
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
    pub(super) fn hold_dependent(&self, x: &[f64], output: &mut Output<'_>) {
        let size = self.layout.size();
        for (c, _) in self
            .active
            .iter()
            .enumerate()
            .filter(|(_, mark)| **mark == 0)
        {
            let inside = (0..self.layout.degree()).map(|j| self.layout.inside(j, c));
            for at in inside.chain([self.layout.node(c)]) {
                output.residual[at] = x[at];
                if let Some(derivatives) = &mut output.derivatives {
                    derivatives.tangent[at * size + at] = 1.0;
                }
            }
        }
    }
}

/// The element as it follows from the unknowns x.
impl<const N: usize> ElementConstraints<'_, N> {
    /// The rates at the points.
    fn rates<'x>(&self, x: &'x [f64]) -> &'x [[f64; N]] {
        x[..self.layout.rates()].as_chunks().0
    }

    /// The place of a point.
    fn place(&self, l: usize, x: &[f64]) -> Place<N> {
        let (t, q, v) = self.span.place(&self.scheme, l, self.rates(x));
        Place { l, t, q, v }
    }

    /// Time, coordinates and velocity at the end.
    pub(crate) fn end_place(&self, x: &[f64]) -> (f64, [f64; N], [f64; N]) {
        let (scheme, span) = (&self.scheme, &self.span);
        let rate = weighted(scheme.advance, scheme.advance_low, self.rates(x));
        let q = moved(&span.start.q, &span.low.q, span.h, &rate);
        let mut v = [0.0; N];
        v.copy_from_slice(&x[self.layout.end(0)..self.layout.node(0)]);
        (span.t + span.h, q, v)
    }

    /// The rounding error of the coordinates q at the end; that of the momenta is not known.
    fn end_low(&self, x: &[f64], q: &[f64; N]) -> State<N> {
        let (scheme, span) = (&self.scheme, &self.span);
        let rate = weighted(scheme.advance, scheme.advance_low, self.rates(x));
        let mut low = State::ZERO;
        for a in 0..N {
            let increment = span.h * rate[a] + span.low.q[a];
            let part = q[a] - span.start.q[a];
            low.q[a] = (span.start.q[a] - (q[a] - part)) + (increment - part);
        }
        low
    }

    /// Checks that all constraints hold at the end up to roundings, including those that were omitted as
    /// dependent. These are not solved for, so that they are also compared with the size of their own terms.
    pub(crate) fn check_end(
        &mut self,
        model: &dyn Constrains<N>,
        x: &[f64],
        tolerance: f64,
        is_rounding: &IsRounding<'_, N>,
    ) -> Result<(), StepError> {
        let (t, q, v) = self.end_place(x);
        let (declared, h) = (model.declared(), self.span.h);
        self.rows.evaluate_declared(model, t, &q);
        let rows = &self.rows;
        let refused = |c: usize, residual: f64| {
            Err(ConstraintError::Dependent {
                constraint: declared[c].name,
                residual,
            }
            .into())
        };
        let is_rounding = |c| is_rounding((rows, c), t, (&q, &v));
        for c in 0..declared.len() {
            let (position, velocity) = relative_residual(rows, c, &q, &v, h);
            for residual in [position, velocity] {
                if !(residual <= START_TOLERANCE || is_rounding(c)) {
                    return refused(c, residual);
                }
            }
        }
        if self.active.iter().all(|mark| *mark == 1) {
            return Ok(());
        }
        match violated(model, t, (&q, &v), (h, tolerance), Some(rows)) {
            Some((c, _, residual)) if !is_rounding(c) => refused(c, residual),
            _ => Ok(()),
        }
    }

    /// The size of an increment of x, relative to the state.
    fn measure(&self, x: &[f64], step: &[f64]) -> Increment {
        let rates = self.layout.rates();
        let end = self.layout.end(0)..self.layout.node(0);
        let inner = self.span.measure_rates(&x[..rates], &step[..rates]);
        let end = 0.25 * relative(1.0, &[], &x[end.clone()], &step[end]);
        // `f64::max` would ignore a NaN.
        let relative = if end > inner.relative || end.is_nan() {
            end
        } else {
            inner.relative
        };
        Increment { relative, ..inner }
    }

    /// The size of an increment, and of the velocities, relative to the velocities that the reactions alone would cause;
    /// `None` if they are no rounding errors of these.
    #[cfg(feature = "alloc")]
    #[cold]
    #[inline(never)]
    fn measure_beside_reactions(
        &self,
        model: &dyn Constrains<N>,
        x: &[f64],
        step: &[f64],
    ) -> Option<Increment> {
        let (t, q, v) = self.end_place(x);
        let (_, mass) = model.momentum_and_mass(t, &q, &v, &mut [0.0; N]).ok()?;
        let reaction = |c| {
            let inside = (0..self.layout.degree()).map(|j| self.layout.inside(j, c));
            let places = inside.chain([self.layout.node(c)]);
            places.map(|at| x[at].abs()).sum()
        };
        let reactions: Vec<f64> = (0..self.rows.rows.len()).map(reaction).collect();
        let (rows, masses) = (sparse(self.rows.rows), diagonal(&mass));
        let speeds = speeds(self.span.h, &masses, &rows, &reactions);
        // At rest the velocities themselves are rounding errors.
        let (steps, rates) = (self.largest_rates(step), self.largest_rates(x));
        let mut size = 0.0;
        for a in 0..N {
            for rate in [steps[a], rates[a]] {
                if rate != 0.0 {
                    raise(&mut size, rate / speeds[a]);
                }
            }
        }
        let increment = Increment {
            relative: size,
            position: size,
        };
        (size <= ROUGH_ROUND_OFF).then_some(increment)
    }

    /// The largest of the rates x of each coordinate, and of its velocity at the end.
    fn largest_rates(&self, x: &[f64]) -> [f64; N] {
        let mut sizes = by_coordinate(&x[..self.layout.rates()]);
        let end: [f64; N] = by_coordinate(&x[self.layout.end(0)..self.layout.node(0)]);
        for a in 0..N {
            raise(&mut sizes[a], end[a]);
        }
        sizes
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
        let element = (inner.scheme, inner.span);
        Self {
            inner,
            constraints: ElementConstraints::new(
                M::CONSTRAINTS,
                element,
                layout,
                rows,
                active,
                impulse,
            ),
        }
    }

    /// L_v at the end, and on request second derivatives.
    pub(crate) fn end(&self, x: &[f64], with_second: bool) -> Result<End<N>, StepError> {
        let (t, q, v) = self.constraints.end_place(x);
        let model = self.inner.model;
        let guess = &self.inner.span.start.p;
        let mut second = Second::ZERO;
        let p = if const { M::FORM.is_lagrangian() } {
            let mut first = First::ZERO;
            if with_second {
                model.second(t, &q, &v, &mut first, &mut second);
            } else {
                model.first(t, &q, &v, &mut first);
            }
            first.z
        } else if with_second {
            let view = lagrangian_view_from(model, t, &q, &v, guess)?;
            second = view.second;
            view.p
        } else {
            conjugate(model, t, &q, &v, guess)?
        };
        Ok(End { t, q, v, p, second })
    }

    /// The state at the end and its rounding error.
    pub(crate) fn end_state(&self, x: &[f64]) -> Result<(State<N>, State<N>), StepError> {
        let End { q, p, .. } = self.end(x, false)?;
        Ok((State { q, p }, self.constraints.end_low(x, &q)))
    }

    /// The residual at x, and on request its derivative.
    pub(crate) fn evaluate(
        &mut self,
        x: &[f64],
        residual: &mut [f64],
        derivatives: Option<Derivatives<'_>>,
    ) -> Result<(), StepError> {
        let with_second = derivatives.is_some();
        let mut output = Output {
            residual,
            derivatives,
        };
        output.clear();
        let mut point = PointDerivatives::ZERO;
        for l in 0..self.inner.scheme.points() {
            let place = self.constraints.place(l, x);
            let at = (place.t, &place.q, &place.v);
            if with_second {
                self.inner.derivatives_at(l, at, &mut point)?;
            } else {
                self.inner.values_at(l, at, &mut point)?;
            }
            self.inner.momenta[l] = point.p;
            let model = self.inner.model;
            self.constraints
                .add_at(model, &place, x, &mut point, &mut output);
            self.inner.forces[l] = point.force;
        }
        let end = self.end(x, with_second)?;
        let (model, forces) = (self.inner.model, &*self.inner.forces);
        self.constraints
            .add_nodes(model, forces, x, &end, &mut output);
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

    fn factor(
        &self,
        _: usize,
        tangent: &mut [f64],
        pivots: &mut [usize],
    ) -> Result<(), lu::Singular> {
        self.constraints.layout.factor(tangent, pivots)
    }

    fn measure(&self, x: &[f64], step: &[f64]) -> Increment {
        self.constraints.measure(x, step)
    }

    #[cfg(feature = "alloc")]
    fn measure_at_rest(&self, x: &[f64], step: &[f64]) -> Option<Increment> {
        (self.constraints).measure_beside_reactions(self.inner.model, x, step)
    }

    fn measure_own(&self, x: &[f64], step: &[f64]) -> Option<f64> {
        if const { N == 1 } {
            return None;
        }
        let [sizes, increments] = [x, step].map(|rows| self.constraints.largest_rates(rows));
        let Span { h, start, .. } = self.constraints.span;
        // The rounding errors of positions appear in the velocities divided by the step.
        let noise = POSITION_ROUND_OFF * largest(&start.q) / h.abs();
        own_increment::<M, N>(&sizes, &increments, noise)
    }

    fn finish(&mut self, _: &[f64], _: &mut [f64]) -> Result<(), StepError> {
        // The end is a function of the unknowns alone.
        Ok(())
    }

    fn statistics(&mut self) -> &mut Statistics {
        self.inner.statistics
    }
}
