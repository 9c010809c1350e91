//! The derivative of one step of a model of run-time length, as an operator: implicit differentiation (T-30).

mod directions;
mod error;
pub(super) mod pull;

pub use error::OperatorError;

use super::blocked::Blocked;
use super::dense::{DenseElement, jumps};
use super::held::Held;
use super::model::{Block, FamilyState, Gradient, Model};
use super::pattern::Pattern;
use super::projection::{Explicit, Places};
use super::rates::Rates;
use super::view::View;
use crate::condense::{Direction, Parameter, add_multiple};
use crate::consistency::ModelError;
use crate::element::Element;
use crate::error::StepError;
use crate::model::Form;
use crate::newton::Control;
use crate::registers::storage::MAX_GROUPS;
use crate::scheme::{SchemeTable, Tables as _};
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;
use nalgebra::DMatrix;

/// The derivative of one step of a model of run-time length, (δp₀, δq₀) ↦ (δp₁, δq₁): an operator on 2n numbers,
/// ordered (p, q).
///
/// At the solution ν of the step, with J the matrix of Newton's method,
///
/// ```text
/// (J δν)_i = δp₀ − Σ_l P_il L_vq,l δq₀ + h Σ_l G_il F_q,l δq₀ ,     F = L_q + Q ,
/// δv_l = Σ_j E_lj δν_j ,     δq_l = δq₀ + h Σ_j C_lj δν_j ,
/// δp₁ = δp₀ + h Σ_l b_l (F_v δv_l + F_q δq_l) ,     δq₁ = δq₀ + h Σ_j β_j δν_j .
/// ```
///
/// with constraints (T-160). It is the derivative of the result of the step, independent of the iteration that computes
/// it. It holds the sparse factors of J and the second derivatives at the points: memory, and the time of
/// [`apply`](Self::apply), are linear in their number of entries.
///
/// # Example
/// The example is at [`stability::transition`](https://docs.rs/tfe), which makes it.
#[derive(Clone, Debug)]
pub struct TransitionOperator {
    h: f64,
    table: SchemeTable,
    matrix: Blocked,
    pattern: Arc<Pattern>,
    /// The second derivatives, point by point.
    values: Vec<f64>,
    end: FamilyState,
    dense: DenseElement,
    /// The contributions of constraints, and the map from momenta to the coefficients of the polynomial, which is then
    /// needed.
    held: Option<Held>,
    jumps: Arc<[f64]>,
    by_length: Vec<f64>,
    by_damping: Vec<f64>,
    by_parameters: Vec<Vec<f64>>,
    inside_by_parameters: Vec<Vec<f64>>,
}

/// What all steps of a model with an element have in common.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    pub(super) table: SchemeTable,
    pub(super) pattern: Arc<Pattern>,
    pub(super) places: Arc<Places>,
    /// The map from the momenta of an element with constraints to its polynomial.
    jumps: Arc<[f64]>,
}

impl Ground {
    /// For a model that has been checked.
    pub(super) fn of<V: Model>(view: &V, table: SchemeTable) -> Self {
        let jumps = match V::CONSTRAINED {
            true => jumps(&table.view()),
            false => Vec::new(),
        };
        Self {
            table,
            pattern: Arc::new(Pattern::of(view)),
            places: Arc::new(Places::of(view)),
            jumps: jumps.into(),
        }
    }
}

/// The direct changes in an element. By point and coordinate: q_l, L_v,l and F_l at fixed rates; by coordinate: p₀, and
/// q₁ − h Σ β ν; and those of the constraints.
struct Change<'a, S, L, F, P, A> {
    shift: S,
    lift: L,
    push: F,
    impulse: P,
    advance: A,
    explicit: Option<&'a Explicit>,
}

impl TransitionOperator {
    /// The derivative of the step from `state` at time t to t + h.
    ///
    /// # Errors
    /// [`OperatorError::Family`] if the model or the element is invalid or not supported, or the state has another length;
    /// [`OperatorError::Step`] if the step fails or its tangent is singular; [`OperatorError::Cut`] if it had to be cut.
    pub fn of_step<M: Model>(
        model: &M,
        element: Element,
        state: &FamilyState,
        t: f64,
        h: f64,
    ) -> Result<Self, OperatorError> {
        let table = Self::admitted::<M>(model, element)?;
        let view = View::new(model, 0.0)?;
        let mut rates = Rates::new(&view, table.clone(), Control::default())?;
        Self::next(&view, &mut rates, &Ground::of(&view, table), state, (t, h))
    }

    /// The derivatives of several steps (t, h, state), with an additional force γ v, γ = `damping`; each is passed to a
    /// function. The steps may start from states that violate the constraints, as iterations over many elements do.
    ///
    /// # Errors
    /// As [`of_step`](Self::of_step), with the index of the step.
    pub fn of_steps<'s, M: Model>(
        model: &M,
        element: Element,
        damping: f64,
        steps: impl IntoIterator<Item = (f64, f64, &'s FamilyState)>,
        mut each: impl FnMut(Self),
    ) -> Result<(), (usize, OperatorError)> {
        let each = |transition| {
            each(transition);
            Ok(())
        };
        Self::of_steps_by(model, element, (damping, &[]), steps, each)
    }

    /// The same, with the derivatives by the parameters of given indices; `each` may end the iteration over steps.
    ///
    /// # Errors
    /// As [`of_steps`](Self::of_steps), and the error of `each`.
    pub fn of_steps_by<'s, M: Model>(
        model: &M,
        element: Element,
        (damping, parameters): (f64, &[usize]),
        steps: impl IntoIterator<Item = (f64, f64, &'s FamilyState)>,
        each: impl FnMut(Self) -> Result<(), OperatorError>,
    ) -> Result<(), (usize, OperatorError)> {
        let by = |&index: &usize| Direction {
            parameter: Some(Parameter::Any(index)),
            ..Direction::default()
        };
        let directions: Vec<Direction> = parameters.iter().map(by).collect();
        let steps = steps.into_iter().map(|step| (step, &directions[..]));
        Self::of_steps_towards(model, element, damping, steps, each)
    }

    /// The same, with the derivatives along directions that may differ between steps;
    /// [`by_parameters`](Self::by_parameters) then has one entry for each direction. The index of a [`Parameter`] of
    /// either variant is that among all parameters of the model.
    ///
    /// # Errors
    /// As [`of_steps_by`](Self::of_steps_by).
    pub fn of_steps_towards<'s, M: Model>(
        model: &M,
        element: Element,
        damping: f64,
        steps: impl IntoIterator<Item = ((f64, f64, &'s FamilyState), impl AsRef<[Direction]>)>,
        mut each: impl FnMut(Self) -> Result<(), OperatorError>,
    ) -> Result<(), (usize, OperatorError)> {
        let refused = |error: OperatorError| (0, error);
        let table = Self::admitted::<M>(model, element).map_err(refused)?;
        let view = View::new(model, damping).map_err(|error| refused(error.into()))?;
        let rates = Rates::new(&view, table.clone(), Control::default());
        let mut rates = rates.map_err(|error| refused(error.into()))?;
        rates.begin_anywhere();
        let ground = Ground::of(&view, table);
        for (number, ((t, h, state), directions)) in steps.into_iter().enumerate() {
            let transition = Self::next(&view, &mut rates, &ground, state, (t, h));
            let done = transition.and_then(|mut transition| {
                transition.answer(&view, &rates, (t, h), directions.as_ref())?;
                each(transition)
            });
            done.map_err(|error| (number, error))?;
        }
        Ok(())
    }

    /// The tables of an element with which this model can be stepped.
    pub(super) fn admitted<M: Model>(
        model: &M,
        element: Element,
    ) -> Result<SchemeTable, OperatorError> {
        model.check()?;
        let table = SchemeTable::new(element).map_err(ModelError::Element)?;
        if M::CONSTRAINED && M::FORM == Form::Hamiltonian {
            return Err(ModelError::ConstraintsNotSupported.into());
        }
        if M::CONSTRAINED && !(element.is_collocated() && element.holds(true)) {
            return Err(ModelError::ElementNotSupported { element }.into());
        }
        let stepped = element.has_phase_form() && table.view().points() <= 4 * MAX_GROUPS;
        if M::FORM == Form::Hamiltonian && !stepped {
            return Err(ModelError::ElementNotSupported { element }.into());
        }
        Ok(table)
    }

    pub(super) fn next<V: Model>(
        view: &V,
        rates: &mut Rates<&V>,
        ground: &Ground,
        state: &FamilyState,
        (t, h): (f64, f64),
    ) -> Result<Self, OperatorError> {
        let n = view.len();
        for (vector, values) in [("q", &state.q), ("p", &state.p)] {
            if values.len() != n {
                return Err(ModelError::StateLength {
                    vector,
                    length: values.len(),
                    expected: n,
                }
                .into());
            }
            if !values.iter().all(|value| value.is_finite()) {
                return Err(StepError::NonFinite.into());
            }
        }
        if !(h.is_finite() && h != 0.0) {
            return Err(StepError::InvalidStep { step: h }.into());
        }
        let mut end = state.clone();
        rates.advance(t, h, &mut end, false)?;
        let matrix = rates.linearised(t, h)?;
        let (scheme, pattern) = (ground.table.view(), &ground.pattern);
        let count = pattern.places().len();
        let mut values = vec![0.0; count * scheme.points()];
        let mut unused = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        for (l, point) in rates.points.iter().enumerate() {
            let [z, q, force] = &mut unused;
            let mut entries = pattern.scatter(&mut values[l * count..(l + 1) * count]);
            let first = Gradient { z, q, force };
            let time = t + h * scheme.nodes[l];
            view.second(time, &point.q, &point.v, first, &mut entries);
        }
        let held = match V::CONSTRAINED {
            true => {
                let solved = rates.solved(&scheme, (t, h), pattern);
                Some(Held::of(view, &ground.places, &solved)?)
            }
            false => None,
        };
        let mut transition = Self {
            h,
            table: ground.table.clone(),
            matrix,
            pattern: Arc::clone(pattern),
            values,
            end,
            dense: rates.dense(t, t + h),
            held,
            jumps: Arc::clone(&ground.jumps),
            by_length: Vec::new(),
            by_damping: Vec::new(),
            by_parameters: Vec::new(),
            inside_by_parameters: Vec::new(),
        };
        transition.differentiate(rates);
        Ok(transition)
    }

    /// ∂(p₁, q₁)/∂a, one for each requested parameter or direction.
    #[must_use]
    pub fn by_parameters(&self) -> &[Vec<f64>] {
        &self.by_parameters
    }

    /// The derivatives of the Legendre coefficients of the element's polynomials by the same parameters or directions:
    /// of dq/dτ, a row of n each, then of dp/dτ.
    #[must_use]
    pub fn inside_by_parameters(&self) -> &[Vec<f64>] {
        &self.inside_by_parameters
    }

    /// The dimension of phase space, 2n.
    #[must_use]
    pub fn size(&self) -> usize {
        2 * self.end.q.len()
    }

    /// The state at the end of the step.
    #[must_use]
    pub fn end(&self) -> &FamilyState {
        &self.end
    }

    /// The polynomial of the step.
    #[must_use]
    pub fn dense(&self) -> &DenseElement {
        &self.dense
    }

    /// The polynomial of the step, dropping the derivative.
    #[must_use]
    pub fn into_dense(self) -> DenseElement {
        self.dense
    }

    /// ∂(p₁, q₁)/∂h, for a model in which the time does not appear.
    #[must_use]
    pub fn by_length(&self) -> &[f64] {
        &self.by_length
    }

    /// ∂(p₁, q₁)/∂γ of an additional force γ v.
    #[must_use]
    pub fn by_damping(&self) -> &[f64] {
        &self.by_damping
    }

    /// Computes (δp₁, δq₁) for (δp₀, δq₀) = `input`.
    ///
    /// # Errors
    /// [`OperatorError::Shape`] unless both have 2n numbers.
    pub fn apply(&self, input: &[f64], output: &mut [f64]) -> Result<(), OperatorError> {
        self.apply_inside(input, output, None)
    }

    /// The same, with the changes of the Legendre coefficients of the element's polynomials, in the order of
    /// [`inside_by_parameters`](Self::inside_by_parameters).
    ///
    /// # Errors
    /// As [`apply`](Self::apply).
    pub fn apply_inside(
        &self,
        input: &[f64],
        output: &mut [f64],
        inside: Option<&mut Vec<f64>>,
    ) -> Result<(), OperatorError> {
        let needed = self.size();
        for given in [input.len(), output.len()] {
            if given != needed {
                return Err(OperatorError::Shape { needed, given });
            }
        }
        let (p, q) = input.split_at(needed / 2);
        output.copy_from_slice(&self.respond_to((p, q), inside));
        Ok(())
    }

    /// The change of the end of the step for a change of its start.
    fn respond_to(&self, (p, q): (&[f64], &[f64]), inside: Option<&mut Vec<f64>>) -> Vec<f64> {
        let explicit = self.held.as_ref().map(|held| held.impulse_of(q));
        let change = Change {
            shift: |_, a: usize| q[a],
            lift: |_, _| 0.0,
            push: |_, _| 0.0,
            impulse: |a: usize| p[a],
            advance: |a: usize| q[a],
            explicit: explicit.as_ref(),
        };
        self.respond_inside(&change, inside)
    }

    /// The whole matrix, 2n × 2n, ordered (p, q); takes 2n applications and 4n² numbers.
    #[must_use]
    pub fn matrix(&self) -> DMatrix<f64> {
        let (size, n) = (self.size(), self.end.q.len());
        let mut matrix = DMatrix::zeros(size, size);
        let mut unit = vec![0.0; size];
        for (column, mut target) in matrix.column_iter_mut().enumerate() {
            unit[column] = 1.0;
            target.copy_from_slice(&self.respond_to(unit.split_at(n), None));
            unit[column] = 0.0;
        }
        matrix
    }

    /// The change of the end of the step for direct changes in the element.
    fn respond<S, L, F, P, A>(&self, change: &Change<'_, S, L, F, P, A>) -> Vec<f64>
    where
        S: Fn(usize, usize) -> f64,
        L: Fn(usize, usize) -> f64,
        F: Fn(usize, usize) -> f64,
        P: Fn(usize) -> f64,
        A: Fn(usize) -> f64,
    {
        self.respond_inside(change, None)
    }

    /// The same, with the coefficients of the polynomials if they are requested.
    fn respond_inside<S, L, F, P, A>(
        &self,
        change: &Change<'_, S, L, F, P, A>,
        mut inside: Option<&mut Vec<f64>>,
    ) -> Vec<f64>
    where
        S: Fn(usize, usize) -> f64,
        L: Fn(usize, usize) -> f64,
        F: Fn(usize, usize) -> f64,
        P: Fn(usize) -> f64,
        A: Fn(usize) -> f64,
    {
        let scheme = self.table.view();
        let (n, h) = (self.end.q.len(), self.h);
        let (count, points) = (scheme.unknowns(), scheme.points());
        let Change {
            shift,
            lift,
            push,
            impulse,
            advance,
            explicit,
        } = change;
        let held = self.held.as_ref();
        let mut unknowns = vec![0.0; self.matrix.size()];
        let (rates, multipliers) = unknowns.split_at_mut(n * count);
        let [mut q, mut v, mut momentum, mut force] =
            [vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        for l in 0..points {
            for a in 0..n {
                (q[a], momentum[a], force[a]) = (shift(l, a), lift(l, a), push(l, a));
            }
            self.bend(l, &q, &v, &mut momentum, &mut force);
            if let Some(held) = held {
                held.bend(l, &q, &mut force);
                held.add_constraint_sides(l, &q, *explicit, (scheme.weights[l], h), multipliers);
            }
            for (a, sides) in rates.chunks_exact_mut(count).enumerate() {
                for (i, side) in sides.iter_mut().enumerate() {
                    let at = i * points + l;
                    *side += h * scheme.force[at] * force[a] - scheme.momentum[at] * momentum[a];
                }
            }
        }
        let mut end: Vec<f64> = (0..n).map(impulse).chain((0..n).map(advance)).collect();
        let (end_p, end_q) = end.split_at_mut(n);
        if let Some(held) = held {
            held.add_end_sides(end_q, *explicit, h, multipliers);
            held.subtract_impulse(*explicit, end_p);
        }
        for (sides, impulse) in rates.chunks_exact_mut(count).zip(&*end_p) {
            sides.iter_mut().for_each(|side| *side += impulse);
        }
        self.matrix.solve(&mut unknowns);
        let (rates, multipliers) = unknowns.split_at(n * count);
        let product = |weights: &[f64], a: usize| -> f64 {
            let rates = &rates[a * count..(a + 1) * count];
            weights.iter().zip(rates).map(|(w, rate)| w * rate).sum()
        };
        if let Some(inside) = &mut inside {
            inside.clear();
            for weights in scheme.rate.chunks_exact(count) {
                inside.extend((0..n).map(|a| h * product(weights, a)));
            }
            inside.resize(2 * inside.len(), 0.0);
        }
        for l in 0..points {
            let row = l * count..(l + 1) * count;
            for a in 0..n {
                q[a] = shift(l, a) + h * product(&scheme.position[row.clone()], a);
                v[a] = product(&scheme.velocity[row.clone()], a);
                (momentum[a], force[a]) = (lift(l, a), push(l, a));
            }
            self.bend(l, &q, &v, &mut momentum, &mut force);
            if let Some(held) = held {
                held.bend(l, &q, &mut force);
                held.add_reactions(l, multipliers, &mut force);
            }
            for (p, force) in end_p.iter_mut().zip(&force) {
                *p += h * scheme.weights[l] * force;
            }
            let Some(inside) = &mut inside else { continue };
            let half = inside.len() / 2;
            let rows = inside[half..].chunks_exact_mut(n.max(1));
            if held.is_none() {
                for (row, weights) in rows.zip(scheme.force_rate.chunks_exact(points)) {
                    add_multiple(row, h * weights[l], &force);
                }
                continue;
            }
            self.add_inertia(l, &v, &mut momentum);
            for (row, weights) in rows.zip(self.jumps.chunks_exact(points + 2)) {
                add_multiple(row, weights[l], &momentum);
            }
        }
        for (a, end) in end_q.iter_mut().enumerate() {
            *end += h * product(scheme.advance, a);
        }
        let Some(held) = held else { return end };
        held.add_first_multipliers(h, multipliers, end_p);
        held.project(end_p, end_q, *explicit);
        if let Some(inside) = inside {
            let half = inside.len() / 2;
            let rows = inside[half..].chunks_exact_mut(n.max(1));
            let start: Vec<f64> = (0..n).map(impulse).collect();
            for (row, weights) in rows.zip(self.jumps.chunks_exact(points + 2)) {
                add_multiple(row, weights[points], &start);
                add_multiple(row, weights[points + 1], end_p);
            }
        }
        end
    }

    /// Adds L_vv δv at one point.
    fn add_inertia(&self, l: usize, v: &[f64], momentum: &mut [f64]) {
        for (block, row, column, value) in self.second(l) {
            if block == Block::ZZ {
                momentum[row] += value * v[column];
            }
        }
    }

    /// Adds L_vq δq to `momentum`, F_v δv + F_q δq to `force`, at one point.
    fn bend(&self, l: usize, q: &[f64], v: &[f64], momentum: &mut [f64], force: &mut [f64]) {
        for (block, row, column, value) in self.second(l) {
            match block {
                Block::ZZ => {}
                Block::ZQ => {
                    momentum[row] += value * q[column];
                    force[column] += value * v[row];
                }
                Block::ForceZ => force[row] += value * v[column],
                // From L_qq, and from forces by coordinates.
                _ => force[row] += value * q[column],
            }
        }
    }

    /// The second derivatives at one point.
    fn second(&self, l: usize) -> impl Iterator<Item = (Block, usize, usize, f64)> {
        let places = self.pattern.places();
        let values = &self.values[l * places.len()..];
        let both = places.iter().zip(values);
        both.map(|((block, row, column), value)| (*block, *row, *column, *value))
    }
}
