//! The derivative of one step of a model of run-time length, as an operator: implicit differentiation (T-30).

mod directions;
mod error;
pub(super) mod pull;
mod respond;

pub use error::OperatorError;

use super::blocked::Blocked;
use super::dense::{DenseElement, jumps};
use super::held::Held;
use super::model::{FamilyState, Gradient, Model};
use super::pattern::Pattern;
use super::projection::Places;
use super::rates::Rates;
use super::view::View;
use crate::condense::{Direction, Parameter};
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
                transition.differentiate_along(&view, &rates, (t, h), directions.as_ref());
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
}
