//! The stepper that owns its memory, and its options.

use super::carried::Carried;
use super::common::{Common, Shape};
use crate::consistency::ModelError;
use crate::element::Element;
use crate::model::Model;
use crate::newton::{Control, Solve};
use crate::points::Points;
use crate::points::forms::are_possible;
use crate::points::tables;
use crate::scheme::{SchemeTable, Tables};
use crate::share::Share;
use crate::statistics::Statistics;

/// Steps a model with one element, on memory of its own.
///
/// # Example
/// ```
/// # use tfe_runtime::{CoordinateName, Facts, First, Form, Mixed, Model, Real, Second, State};
/// use tfe_runtime::step::{Control, Stepper};
///
/// # struct Oscillator;
/// # impl Model<1> for Oscillator {
/// #     const FORM: Form = Form::Hamiltonian;
/// #     const FACTS: Facts = Facts::UNKNOWN;
/// #     fn energy_function<R: Real>(&self, _: R, q: &[R; 1], p: &[R; 1]) -> R {
/// #         (q[0] * q[0] + p[0] * p[0]) * R::from_f64(0.5)
/// #     }
/// #     fn first<R: Real>(&self, _: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>) {
/// #         (first.z, first.q) = (*p, *q);
/// #     }
/// #     fn first_and_mass<R: Real>(
/// #         &self, t: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>, zz: &mut [[R; 1]; 1],
/// #     ) {
/// #         self.first(t, q, p, first);
/// #         zz[0][0] = R::from_f64(1.0);
/// #     }
/// #     fn second<R: Real>(
/// #         &self, t: R, q: &[R; 1], p: &[R; 1], first: &mut First<R, 1>, second: &mut Second<R, 1>,
/// #     ) {
/// #         self.first_and_mass(t, q, p, first, &mut second.zz);
/// #         second.qq[0][0] = R::from_f64(1.0);
/// #     }
/// #     fn coordinate_name(_: usize) -> CoordinateName {
/// #         CoordinateName { name: "x", index: None }
/// #     }
/// # }
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut stepper = Stepper::new(&Oscillator, Mixed::<4>.into(), Control::default())?;
/// let mut state = State { q: [1.0], p: [0.0] };
/// for step in 0..10 {
///     stepper.advance(0.1 * step as f64, 0.1, &mut state, &[])?;
/// }
/// assert!((state.q[0] - 1.0_f64.cos()).abs() < 1e-9);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Stepper<'m, M, const N: usize> {
    pub(super) model: Share<'m, M>,
    /// All the rest.
    pub(super) common: Common<N>,
}

// Not derived: the model is borrowed and need not be `Clone`.
impl<M, const N: usize> Clone for Stepper<'_, M, N> {
    fn clone(&self) -> Self {
        Self {
            model: self.model.clone(),
            common: self.common.clone(),
        }
    }
}

impl<'m, M, const N: usize> Stepper<'m, M, N>
where
    M: Model<N>,
{
    /// Whether forces may have kinks. This and the next ones are constants, so that code that a model never uses is not
    /// compiled.
    pub(super) const MAY_HAVE_KINKS: bool = !M::FACTS.smooth;
    pub(super) const HAS_CONSTRAINTS: bool = !M::CONSTRAINTS.is_empty();

    /// Whether steps with all points at once are possible.
    pub(super) const MAY_HAVE_POINTS: bool = !M::FACTS.linear && M::CONSTRAINTS.is_empty();

    /// Whether all steps of one length have the same matrix.
    pub(super) const MAY_BE_PROPAGATED: bool =
        M::FACTS.linear && !M::FACTS.time_dependent && M::CONSTRAINTS.is_empty();

    /// A stepper that has made no step.
    ///
    /// # Errors
    /// [`ModelError`] if the model does not pass its [check](Model::check), or the element is invalid.
    pub fn new(model: &'m M, element: Element, control: Control) -> Result<Self, ModelError> {
        Self::sharing(Share::Borrowed(model), element, control)
    }

    /// The same for a model that may be owned by the stepper.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn sharing(
        model: Share<'m, M>,
        element: Element,
        control: Control,
    ) -> Result<Self, ModelError> {
        model.check()?;
        let table = SchemeTable::new(element)?;
        let points = if Self::MAY_HAVE_POINTS
            && control.solve != Solve::Newton
            && are_possible::<M, N>(&table.element())
        {
            Points::new(&*model, tables::Tables::of(&table.view()))
        } else {
            None
        };
        let carried = Carried::at_rest(points);
        let common = Common::new(Shape::of::<M, N>(), table, control, carried);
        Ok(Self { model, common })
    }

    /// Continues with another model, about which nothing is known yet; the counts are kept.
    ///
    /// # Errors
    /// Only those of [`new`](Self::new).
    pub fn set_model(&mut self, model: Share<'m, M>) -> Result<(), ModelError> {
        let other = Self::sharing(model, self.element(), self.control())?;
        self.model = other.model;
        self.common.replaced_by(other.common);
        Ok(())
    }

    /// Changes the tolerance of the iterations from the next step on: [`Control::tolerance`].
    pub fn set_tolerance(&mut self, tolerance: f64) {
        self.common.control.tolerance = tolerance;
    }

    /// Declares that [`dense`](Self::dense) and [`transition`](Self::transition) will be called only now and then.
    ///
    /// Linear models with constant coefficients are then stepped by a matrix, y₁ = y₀ + D y₀ + c, made after 2N + 1
    /// steps of one length, so that a step is a product of a 2N × 2N matrix and a vector. Dense output of an element
    /// then costs a step of its own.
    #[must_use]
    pub fn ends_only(mut self) -> Self {
        self.common.carried.ends_only = true;
        self
    }

    /// Cuts steps where the argument of an `abs` or `sign`, the condition of a `select`, or the difference of the
    /// arguments of a `min` or `max` changes its sign, so that elements keep their order (T-119); [`Statistics::kinks`]
    /// counts the crossings. Models without such functions are stepped as before.
    #[must_use]
    pub fn at_kinks(mut self) -> Self {
        self.common.at_kinks = true;
        self
    }

    /// The element with which it steps.
    #[must_use]
    pub fn element(&self) -> Element {
        self.common.table.element()
    }

    /// The control of its iterations.
    #[must_use]
    pub fn control(&self) -> Control {
        self.common.control()
    }

    /// The model that is stepped.
    #[must_use]
    pub fn model(&self) -> &M {
        &self.model
    }

    /// The cost of all steps so far.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        &self.common.carried.memory.statistics
    }

    /// The counts since the last call.
    pub fn take_statistics(&mut self) -> Statistics {
        core::mem::take(&mut self.common.carried.memory.statistics)
    }
}
