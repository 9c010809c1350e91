//! The stepper of models of run-time length, and the choice of its unknowns.

mod kinks;

use super::dense::DenseElement;
use super::forces::Forces;
use super::inertia::Legendre;
#[cfg(feature = "sparse")]
use super::instant::Instant;
use super::model::{FamilyState, Model};
#[cfg(feature = "sparse")]
use super::rates::Rates;
use crate::consistency::ModelError;
use crate::cut::{Halving, in_halves, may_be_cut};
use crate::element::Element;
use crate::error::StepError;
use crate::legendre::largest;
use crate::model::Form;
use crate::newton::Control;
use crate::registers::storage::MAX_GROUPS;
use crate::scheme::{SchemeTable, Tables as _};
use crate::share::Share;
use crate::statistics::Statistics;
use alloc::boxed::Box;
use alloc::vec::Vec;
use core::convert::Infallible;

/// Steps a model of run-time length with one element, on memory of its own.
///
/// Equations M q̈ = f(q, q̇, t) with a constant diagonal M are solved for the forces at all points, in time and memory
/// linear in the number of coordinates: by a fixed-point iteration and, where that contracts badly (with the feature
/// `sparse`), by Newton's method with a sparse factorisation. With the feature `sparse`, Lagrangians with any other
/// kinetic energy, and with holonomic constraints, are solved for rates and multipliers, by Newton's method only (T-45,
/// T-72, T-73).
///
/// # Example
/// The example is at [`Simulation::new`](https://docs.rs/tfe), with which families are run.
#[derive(Clone, Debug)]
pub struct Stepper<'m, M> {
    model: Share<'m, M>,
    element: Element,
    length: usize,
    way: Way<Share<'m, M>>,
    legendre: Legendre,
    /// For reactions; made on first use.
    #[cfg(feature = "sparse")]
    instant: Option<Instant>,
    control: Control,
    /// Whether steps are cut at kinks, if there are any.
    at_kinks: bool,
    /// Whether constraints have branches.
    has_constraint_kinks: bool,
    /// The pieces of the last step, if it was cut.
    pieces: Vec<DenseElement>,
}

/// The unknowns, and the stepper that solves for them.
#[derive(Clone, Debug)]
enum Way<M> {
    Forces(Box<Forces<M>>),
    #[cfg(feature = "sparse")]
    Rates(Box<Rates<M>>),
}

impl<M> Way<M> {
    fn hand_over<H>(self, model: H) -> Way<H> {
        match self {
            Self::Forces(forces) => Way::Forces(Box::new(forces.hand_over(model))),
            #[cfg(feature = "sparse")]
            Self::Rates(rates) => Way::Rates(Box::new(rates.hand_over(model))),
        }
    }

    fn control_mut(&mut self) -> &mut Control {
        match self {
            Self::Forces(forces) => &mut forces.control,
            #[cfg(feature = "sparse")]
            Self::Rates(rates) => &mut rates.control,
        }
    }
}

/// Everything that a [`Stepper`] carries from step to step, without its model: after [`Stepper::resume`] the next step
/// is the same to the last bit.
#[derive(Clone, Debug)]
pub struct Suspended {
    element: Element,
    length: usize,
    /// The bits of the parameters of the model, and of what its kernels read besides.
    parameters: Vec<u64>,
    way: Way<()>,
}

fn parameters<M: Model>(model: &M) -> Vec<u64> {
    let bits = |index| model.parameter(index).to_bits();
    let mut all: Vec<u64> = (0..model.parameters()).map(bits).collect();
    model.unnumbered(&mut |value| all.push(value));
    all
}

impl Suspended {
    /// The element of the stepper.
    #[must_use]
    pub fn element(&self) -> Element {
        self.element
    }

    /// Whether the stepper had this model: one of the same lengths and parameters.
    #[must_use]
    pub fn is_of<M: Model>(&self, model: &M) -> bool {
        self.length == model.len() && self.parameters == parameters(model)
    }
}

impl<'m, M: Model> Stepper<'m, M> {
    /// A stepper that has made no step.
    ///
    /// # Errors
    /// [`ModelError`] for inconsistent lengths, an invalid element, and models that are not supported.
    pub fn new(model: &'m M, element: Element, control: Control) -> Result<Self, ModelError> {
        Self::sharing(model.into(), element, control)
    }

    /// The same for a model that may be owned by the steppers that use it.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn sharing(
        model: Share<'m, M>,
        element: Element,
        control: Control,
    ) -> Result<Self, ModelError> {
        model.check()?;
        let table = SchemeTable::new(element).map_err(ModelError::Element)?;
        let way = Self::way(&model, element, table, control)?;
        Ok(Self::with(model, element, way, control))
    }

    fn with(
        model: Share<'m, M>,
        element: Element,
        way: Way<Share<'m, M>>,
        control: Control,
    ) -> Self {
        Self {
            length: model.len(),
            model,
            element,
            way,
            legendre: Legendre::default(),
            #[cfg(feature = "sparse")]
            instant: None,
            control,
            at_kinks: false,
            has_constraint_kinks: false,
            pieces: Vec::new(),
        }
    }

    /// Drops the model and keeps everything else.
    #[must_use]
    pub fn suspend(self) -> Suspended {
        Suspended {
            element: self.element,
            length: self.length,
            parameters: parameters(&*self.model),
            way: self.way.hand_over(()),
        }
    }

    /// A stepper that continues where another one was [suspended](Self::suspend), with all counts zero. If that had
    /// another element, length, kind of unknowns, parameters or lists of indices, the stepper starts anew.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn resume(
        model: Share<'m, M>,
        element: Element,
        control: Control,
        suspended: Suspended,
    ) -> Result<Self, ModelError> {
        model.check()?;
        let is_same = suspended.element == element && suspended.is_of(&*model);
        let mut way = suspended.way.hand_over(model.clone());
        if !is_same || way.control_mut().solve != control.solve {
            return Self::sharing(model, element, control);
        }
        *way.control_mut() = control;
        Ok(Self::with(model, element, way, control))
    }

    fn way(
        model: &Share<'m, M>,
        element: Element,
        table: SchemeTable,
        control: Control,
    ) -> Result<Way<Share<'m, M>>, ModelError> {
        let by_rates = cfg!(feature = "sparse") && M::FORM == Form::Lagrangian;
        let has_form = match M::FORM {
            Form::Lagrangian => element.is_collocated(),
            Form::Hamiltonian => element.has_phase_form(),
        };
        if M::CONSTRAINED {
            if !by_rates {
                return Err(ModelError::ConstraintsNotSupported);
            }
            if !(element.is_collocated() && element.holds(true)) {
                return Err(ModelError::ElementNotSupported { element });
            }
        } else if has_form && table.view().points() <= 4 * MAX_GROUPS {
            match Forces::new(model.clone(), table.clone(), control) {
                Err(ModelError::NotSecondOrder | ModelError::MassNotDiagonal { .. })
                    if by_rates => {}
                forces => return Ok(Way::Forces(Box::new(forces?))),
            }
        } else if !by_rates {
            return Err(ModelError::ElementNotSupported { element });
        }
        #[cfg(feature = "sparse")]
        return Ok(Way::Rates(Box::new(Rates::new(
            model.clone(),
            table,
            control,
        )?)));
        #[cfg(not(feature = "sparse"))]
        Err(ModelError::NotSecondOrder)
    }

    /// Moves `state` from t to t + h. The initial guess continues the last step if `state` is where that ended; any
    /// other state may be given as well.
    ///
    /// # Errors
    /// [`StepError`]; `state` is unchanged then. A state of another length than the model's counts as one that is not finite.
    pub fn advance(&mut self, t: f64, h: f64, state: &mut FamilyState) -> Result<(), StepError> {
        self.pieces.clear();
        if const { !M::FACTS.smooth } && self.at_kinks && self.has_kinks(t, state) {
            return self.advance_in_arcs(t, h, state);
        }
        let error = match self.whole(t, h, state, &[]) {
            Err(error) if may_be_cut(&error, M::FACTS.linear, self.control.solve) => error,
            outcome => return outcome,
        };
        let (start, steps) = (state.clone(), self.statistics().steps);
        let arrived = in_halves(self, (t, h), state, &[], 1);
        let statistics = self.statistics_mut();
        statistics.steps = steps;
        if !arrived {
            *state = start;
            self.pieces.clear();
            return Err(error);
        }
        statistics.steps += 1;
        statistics.cuts += 1;
        Ok(())
    }

    fn statistics_mut(&mut self) -> &mut Statistics {
        match &mut self.way {
            Way::Forces(forces) => &mut forces.statistics,
            #[cfg(feature = "sparse")]
            Way::Rates(rates) => &mut rates.statistics,
        }
    }

    fn advance_whole(&mut self, t: f64, h: f64, state: &mut FamilyState) -> Result<(), StepError> {
        if !(h.is_finite() && h != 0.0) {
            return Err(StepError::InvalidStep { step: h });
        }
        let is_right = state.q.len() == self.length && state.p.len() == self.length;
        let continues = is_right
            && match &self.way {
                Way::Forces(forces) => forces.ends_in(state),
                #[cfg(feature = "sparse")]
                Way::Rates(rates) => rates.ends_in(state),
            };
        // The end of a step is known to be finite.
        let is_finite = |values: &[f64]| largest(values).is_finite();
        if !(continues || is_right && is_finite(&state.q) && is_finite(&state.p)) {
            return Err(StepError::NonFinite);
        }
        match &mut self.way {
            Way::Forces(forces) => forces.advance(t, h, state, continues),
            #[cfg(feature = "sparse")]
            Way::Rates(rates) => rates.advance(t, h, state, continues),
        }
    }

    /// The polynomial of the last step, from time `start` to time `end`; before the first step, and after a failed one,
    /// a constant.
    #[must_use]
    pub fn dense(&self, start: f64, end: f64) -> DenseElement {
        DenseElement::of_pieces((start, end), self.pieces.clone())
            .unwrap_or_else(|| self.dense_of_last(start, end))
    }

    fn dense_of_last(&self, start: f64, end: f64) -> DenseElement {
        match &self.way {
            Way::Forces(forces) => forces.dense(start, end),
            #[cfg(feature = "sparse")]
            Way::Rates(rates) => rates.dense(start, end),
        }
    }

    /// The result of [`velocity`](super::velocity), to the last bit, with the memory and the ordering kept from one
    /// call to the next.
    ///
    /// # Errors
    /// As [`velocity`](super::velocity).
    pub fn velocity(&mut self, t: f64, state: &FamilyState) -> Result<Vec<f64>, ModelError> {
        self.legendre.velocity(&*self.model, t, state)
    }

    /// The result of [`reactions`](super::reactions), with the ordering kept from one call to the next.
    pub fn reactions(&mut self, t: f64, q: &[f64], v: &[f64]) -> Option<Vec<f64>> {
        #[cfg(feature = "sparse")]
        {
            let instant = match &mut self.instant {
                Some(instant) => instant,
                empty => empty.insert(Instant::new(&*self.model)?),
            };
            instant.reactions(&*self.model, (t, q), v).ok()
        }
        #[cfg(not(feature = "sparse"))]
        {
            let _ = (t, q, v);
            None
        }
    }

    /// The element it steps with.
    #[must_use]
    pub fn element(&self) -> Element {
        self.element
    }

    /// The control of the iterations, as requested.
    #[must_use]
    pub fn control(&self) -> Control {
        self.control
    }

    /// Changes the tolerance of the iterations from the next step on: [`Control::tolerance`].
    pub fn set_tolerance(&mut self, tolerance: f64) {
        self.way.control_mut().tolerance = tolerance;
    }

    /// Continues with another model, about which nothing is known yet; the counts are kept.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn set_model(&mut self, model: Share<'m, M>) -> Result<(), ModelError> {
        let mut other = Self::sharing(model, self.element, self.control)?;
        other.set_tolerance(self.way.control_mut().tolerance);
        *other.statistics_mut() = *self.statistics();
        other.at_kinks = self.at_kinks;
        *self = other;
        Ok(())
    }

    /// The cost of all steps so far.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        match &self.way {
            Way::Forces(forces) => &forces.statistics,
            #[cfg(feature = "sparse")]
            Way::Rates(rates) => &rates.statistics,
        }
    }

    /// The counts since the last call.
    pub fn take_statistics(&mut self) -> Statistics {
        core::mem::take(self.statistics_mut())
    }
}

impl<M: Model> Halving for Stepper<'_, M> {
    type State = FamilyState;
    type Kick = Infallible;
    type Kicks = Vec<Infallible>;

    fn whole(
        &mut self,
        t: f64,
        h: f64,
        state: &mut FamilyState,
        _: &[Infallible],
    ) -> Result<(), StepError> {
        self.advance_whole(t, h, state)
    }

    fn passed(&mut self, t: f64, h: f64, _: Vec<Infallible>) {
        let dense = self.dense_of_last(t, t + h);
        self.pieces.push(dense);
    }
}
